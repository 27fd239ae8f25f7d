"""The command line in tests: run in this process or another, in a folder with a scenario."""

import subprocess
import sys

import pytest

from fieldsim.cli import program

# A planet and pebbles, with the cells of the donut scenario, so that its kernels serve here, too.
PLANET = """
    '''A small planet.

    pebbles: number of pebbles
    '''

    import fieldsim as fs


    def build(pebbles: int = 3, duration: float = 0.2, threshold: float = 1.0) -> fs.Scenario:
        ring = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
        world = fs.World()
        clay = fs.Material("terracotta", radius=0.25, threshold=threshold)
        world.add_body(fs.Body(ring, gravity=fs.Newtonian(), surface=clay))
        world.add_particles(**fs.sampling.shell(pebbles, radius=2.0, seed=1), contact=fs.Bounce(0.5))
        return fs.Scenario(world, fs.Camera((4, 0, 2)), duration=duration, fps=10)


    if __name__ == "__main__":
        fs.main(build)
"""


def fieldsim(*arguments):
    """Exit status of the command."""
    with pytest.raises(SystemExit) as end:
        program.main(argv=[str(a) for a in arguments])
    return end.value.code


def start(*arguments, **options):
    """The command as a process."""
    command = [sys.executable, "-m", "fieldsim", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def films(folder):
    return sorted(p.name for p in folder.iterdir() if p.name != "scenarios")
