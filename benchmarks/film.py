"""How long a user waits: the donut film with cold and warm caches, the first frame, imports."""

import os
import pathlib
import subprocess
import sys
import tempfile
import time

DONUT = pathlib.Path(__file__).parents[1] / "scenarios" / "donut.py"
COMMAND = (sys.executable, "-m", "fieldsim")


def rows():
    """Figures in seconds of wall time; each is one run of the command as a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        # Warp's cache alone: nothing else is compiled for a film.
        environment = os.environ | {"WARP_CACHE_PATH": f"{folder}/cache"}

        def film(name, out, *options):
            seconds = _run([*COMMAND, "run", DONUT, "--out", f"{folder}/{out}", *options], environment)
            return {"name": name, "value": seconds, "unit": "s"}

        yield film("donut film, 640x360, 6 s, 30 fps, 400 pebbles, cold", "cold.mp4")
        yield film("donut film, 640x360, 6 s, 30 fps, 400 pebbles, warm", "warm.mp4")
        yield film("donut, warm start to first frame", "first.png", "--duration", "0.03")
        yield film("donut preview, warm", "preview.mp4", "--preview")
    script = "import time; t = time.perf_counter(); import fieldsim; print(time.perf_counter() - t)"
    times = [float(subprocess.check_output([sys.executable, "-c", script])) for _ in range(5)]
    yield {"name": "import fieldsim, best of 5", "value": min(times), "unit": "s"}
    times = [_run([*COMMAND, "--version"], os.environ) for _ in range(5)]
    yield {"name": "fieldsim --version, best of 5", "value": min(times), "unit": "s"}


def _run(command, environment):
    start = time.perf_counter()
    subprocess.run([str(part) for part in command], env=environment, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - start
