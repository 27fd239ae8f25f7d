"""REBOUND as a peer: single particles in fieldsim's fields, their forces as a small compiled C callback."""

import ctypes
import functools
import importlib.util
import pathlib
import shutil
import subprocess
import tempfile

SOURCE = r"""
#include <math.h>
struct particle { double x, y, z, vx, vy, vz, ax, ay, az; };
static char *first;
static long count, stride;
static double soft2;
/* The particles, how many, the bytes from one to the next, and the needle's softening. */
void follow(void *q, long n, long bytes, double softening) {
    first = q, count = n, stride = bytes, soft2 = softening * softening;
}

/* A needle from (-1, 0, 0) to (1, 0, 0) of mass 1. */
void needle(void *sim) {
    for (long i = 0; i < count; i++) {
        struct particle *p = (struct particle *)(first + i * stride);
        double h2 = p->y * p->y + p->z * p->z + soft2, lo = p->x - 1, hi = p->x + 1;
        double r1 = sqrt(lo * lo + h2), r2 = sqrt(hi * hi + h2);
        double across = (hi / r2 - lo / r1) / h2;
        p->ax += 0.5 * (1 / r2 - 1 / r1);
        p->ay -= 0.5 * across * p->y;
        p->az -= 0.5 * across * p->z;
    }
}

/* A ring of radius 1 and mass 1 about the z axis; K and E by the arithmetic-geometric mean. */
void donut(void *sim) {
    for (long i = 0; i < count; i++) {
        struct particle *p = (struct particle *)(first + i * stride);
        double rho2 = p->x * p->x + p->y * p->y, rho = sqrt(rho2), z2 = p->z * p->z;
        double far = (rho + 1) * (rho + 1) + z2, near = (rho - 1) * (rho - 1) + z2;
        double a = 1, b = sqrt(near / far), sum = (1 - near / far) / 2, power = 1;
        for (int k = 0; k < 6; k++) {
            double c = (a - b) / 2, g = sqrt(a * b);
            a = (a + b) / 2, b = g, sum += power * c * c, power *= 2;
        }
        double K = M_PI / (2 * a), E = K * (1 - sum), root = sqrt(far);
        double along = (E * (1 - rho2 + z2) / near - K) / (M_PI * rho2 * root);
        p->ax += along * p->x;
        p->ay += along * p->y;
        p->az -= 2 / M_PI * E / (root * near) * p->z;
    }
}
"""


@functools.cache
def library():
    """The compiled forces, or None where REBOUND or a C compiler is missing."""
    compiler = shutil.which("cc")
    if compiler is None or importlib.util.find_spec("rebound") is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        source, target = pathlib.Path(folder, "forces.c"), pathlib.Path(folder, "forces.so")
        source.write_text(SOURCE, encoding="utf-8")
        subprocess.run([compiler, "-O3", "-shared", "-fPIC", "-o", target, source, "-lm"], check=True)
        found = ctypes.CDLL(str(target))
        found.follow.argtypes = [ctypes.c_void_p, ctypes.c_long, ctypes.c_long, ctypes.c_double]
        return found


def orbit(force: str, position, velocity, integrator: str = "ias15", dt: float = 1e-2):
    """A REBOUND simulation of one particle under a force of the library."""
    import rebound

    simulation = rebound.Simulation()
    simulation.integrator = integrator
    simulation.dt = dt
    if force == "star":
        simulation.add(m=1.0)
        simulation.N_active = 1
    else:
        simulation.gravity = "none"
    simulation.add(**dict(zip(("x", "y", "z", "vx", "vy", "vz"), (*position, *velocity), strict=True)))
    if force != "star":
        _follow(simulation, force, 0.1)
    return simulation


def swarm(force: str, positions, velocities, dt: float):
    """A REBOUND simulation of particles that do not pull each other, by leapfrog, under a force without softening."""
    import rebound

    simulation = rebound.Simulation()
    simulation.integrator, simulation.gravity, simulation.dt = "leapfrog", "none", dt
    for x, v in zip(positions, velocities, strict=True):
        simulation.add(**dict(zip(("x", "y", "z", "vx", "vy", "vz"), (*x, *v), strict=True)))
    _follow(simulation, force, 0.0)
    return simulation


def cluster(positions, velocities, mass: float, softening: float, dt: float):
    """A REBOUND simulation of particles of one mass that pull each other, by leapfrog and a direct sum."""
    import rebound

    simulation = rebound.Simulation()
    simulation.integrator, simulation.gravity, simulation.dt = "leapfrog", "basic", dt
    simulation.softening = softening
    for x, v in zip(positions, velocities, strict=True):
        simulation.add(m=mass, **dict(zip(("x", "y", "z", "vx", "vy", "vz"), (*x, *v), strict=True)))
    return simulation


def _follow(simulation, force, softening):
    """Let a force of the library act on all particles of a simulation."""
    import rebound
    from rebound.simulation import AFF

    # Assigned past the property, which would call the function by way of Python.
    simulation._additional_forces = ctypes.cast(getattr(library(), force), AFF)
    first = ctypes.addressof(simulation.particles[0])
    library().follow(first, simulation.N, ctypes.sizeof(rebound.Particle), softening)


def state(simulation):
    """Position and velocity of the particle, relative to the star if there is one."""
    particles = simulation.particles
    x, v = list(particles[-1].xyz), list(particles[-1].vxyz)
    if simulation.N > 1:
        x = [a - b for a, b in zip(x, particles[0].xyz, strict=True)]
        v = [a - b for a, b in zip(v, particles[0].vxyz, strict=True)]
    return x, v
