"""Motion in rings and rotating segments against what is known of them in closed form.

The ring: its pull in its plane is a complete elliptic integral (mpmath's, in the parameter m), on its axis algebraic.
The segment: relative equilibria of a straight segment in uniform rotation, Riaguas, Elipe & Lara 1999.
"""

import math

import mpmath
import numpy as np
import pytest

import fieldsim as fs

RING = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
BAR = fs.Segment((-1, 0, 0), (1, 0, 0))  # half length 1, mass 1, G = 1


def potential(r):
    """F of a ring of mass and radius 1 in its plane, at the distance r from its centre."""
    return 2 / mpmath.pi * mpmath.ellipk(4 * r / (1 + r) ** 2) / (1 + r)


def slopes(r):
    """Its first and second derivatives."""
    return mpmath.diff(potential, r), mpmath.diff(potential, r, 2)


def run(primitive, positions, velocities, motion=None):
    world = fs.World()
    world.add_body(fs.Body(primitive, gravity=fs.Newtonian(), **({"motion": motion} if motion else {})))
    world.add_particles(positions, velocities)
    return fs.Simulation(world, fs.Radau(), threads=1)


# The ring


def test_the_rings_centre_holds_along_the_axis_and_not_across():
    field = fs.gravity(RING, 1.0)
    np.testing.assert_allclose(field.gradient((0, 0, 0)), 0.0, atol=1e-15)
    # F = 1 / sqrt(1 + z^2) on the axis, and its Laplacian is 0.
    np.testing.assert_allclose(field.hessian((0, 0, 0)), np.diag([0.5, 0.5, -1.0]), atol=1e-15)
    small = 1e-6
    simulation = run(RING, [(small, 0, 0), (0, 0, small)], np.zeros((2, 3)))
    for time in (1.0, 3.0, 6.0):
        simulation.advance(time)
        x = simulation.positions[0]
        # The next terms of F are smaller by the square of the place: 1e-12, grown to 5e-9 where it flees.
        assert x[0, 0] == pytest.approx(small * math.cosh(time / math.sqrt(2)), rel=2e-8)
        assert x[1, 2] == pytest.approx(small * math.cos(time), abs=small * 1e-11)


@pytest.mark.parametrize("height", [0.1, 1.0, 10.0])
def test_swings_through_the_ring_have_their_period(height):
    """Of fall from rest at a height: 4 integral dz / sqrt(2 (U(height) - U(z)))."""

    def slowness(angle):  # z = height sin(angle); 1 / sqrt(1 + z^2) - 1 / sqrt(1 + height^2) without cancellation
        z = height * mpmath.sin(angle)
        low, high = mpmath.sqrt(1 + z**2), mpmath.sqrt(1 + mpmath.mpf(height) ** 2)
        return mpmath.sqrt(low * high * (low + high) / 2)

    period = float(4 * mpmath.quad(slowness, [0, mpmath.pi / 4, mpmath.pi / 2]))
    simulation = run(RING, [(0, 0, height)], [(0, 0, 0)])
    for part, place in ((0.25, 0.0), (0.5, -height), (1.0, height)):
        simulation.advance(part * period)
        # Some 30 steps, each rounding a place of size `height`.
        np.testing.assert_allclose(simulation.positions[0], [(0, 0, place)], rtol=0, atol=2e-14 * height + 1e-15)


def test_circles_in_the_rings_plane_close():
    """At the angular frequency sqrt(-F' / r), where they are stable."""
    for r in (1.8, 2.0, 3.5):
        omega = mpmath.sqrt(-slopes(r)[0] / r)
        simulation = run(RING, [(r, 0, 0)], [(0, float(omega * r), 0)])
        for turn in (0.25, 1.0, 3.0):
            simulation.advance(float(2 * mpmath.pi * turn / omega))
            angle = 2 * math.pi * turn
            place = (r * math.cos(angle), r * math.sin(angle), 0.0)
            np.testing.assert_allclose(simulation.positions[0], [place], rtol=0, atol=1e-12)


def test_orbits_near_circles_swing_with_the_epicyclic_frequencies():
    """Radially with sqrt(-F'' - 3 F' / r), where that is real, and across the plane with sqrt(F'' + F' / r)."""
    field = fs.gravity(RING, 1.0)
    small = 1e-5
    for r in (2.0, 3.5):
        first, second = slopes(r)
        radial, across = mpmath.sqrt(-second - 3 * first / r), mpmath.sqrt(second + first / r)
        bend = [float(second), float(first / r), -(float(across) ** 2)]
        np.testing.assert_allclose(np.diag(field.hessian((r, 0, 0))), bend, rtol=1e-13)
        speed = float(mpmath.sqrt(-first * r))
        # Pushed along the radius the angular momentum stays that of the circle.
        for omega, push in ((float(radial), (small, speed, 0)), (float(across), (0, speed, small))):
            simulation = run(RING, [(r, 0, 0)], [push])
            for time in np.array([0.25, 0.5, 1.0]) * 2 * math.pi / omega:
                simulation.advance(time)
                x = simulation.positions[0][0]
                seen = np.hypot(x[0], x[1]) - r if push[0] else x[2]
                # The next order is (small / omega)^2.
                assert seen == pytest.approx(small / omega * math.sin(omega * time), abs=10 * (small / omega) ** 2)


def test_circles_close_to_the_ring_are_unstable():
    """The radial frequency vanishes at one radius; inside it a push grows as the imaginary frequency says."""
    square = lambda r: -slopes(r)[1] - 3 * slopes(r)[0] / r  # noqa: E731
    edge = float(mpmath.findroot(square, 1.6))
    assert square(edge + 0.01) > 0 > square(edge - 0.01)
    r, small = edge - 0.2, 1e-9
    rate, speed = float(mpmath.sqrt(-square(r))), float(mpmath.sqrt(-slopes(r)[0] * r))
    simulation = run(RING, [(r, 0, 0)], [(small, speed, 0)])
    simulation.advance(4.0)
    grown = np.linalg.norm(simulation.positions[0][0]) - r
    assert grown == pytest.approx(small / rate * math.sinh(4.0 * rate), rel=1e-4)


# The rotating segment


def collinear(omega):
    """Distance x from the centre on the segment's line: 1 / (x^2 - 1) = omega^2 x."""
    return mpmath.findroot(lambda x: omega**2 * x * (x**2 - 1) - 1, 1 + 1 / mpmath.mpf(omega))


def isosceles(omega):
    """Distance y from the centre across the segment: 1 / (y sqrt(y^2 + 1)) = omega^2 y."""
    return mpmath.findroot(lambda y: omega**2 * y**2 * mpmath.sqrt(y**2 + 1) - 1, mpmath.mpf(omega) ** (-2 / 3))


@pytest.mark.parametrize("omega", [0.1, 0.5, 2.0])
def test_relative_equilibria_of_a_rotating_segment(omega):
    x, y = float(collinear(omega)), float(isosceles(omega))
    places = np.array([(x, 0, 0), (-x, 0, 0), (0, y, 0), (0, -y, 0)])
    # They solve the equations: what pulls is what turning takes.
    pull = fs.gravity(BAR, 1.0).gradient(places)
    np.testing.assert_allclose(pull, -(omega**2) * places, rtol=0, atol=2e-14 * omega**2 * max(x, 1 / omega))
    spin = fs.Spin(rate=omega)
    simulation = run(BAR, places, omega * np.cross((0, 0, 1), places), spin)
    rate = growth(omega, places[:1])
    # As long as errors of rounding at the unstable ones, which come in at 1e-15, grow less than a hundredfold.
    for share in (0.5, 1.0):
        time = share * math.log(100.0) / rate
        simulation.advance(time)
        turned = spin(time).apply(places)
        np.testing.assert_allclose(simulation.positions[0], turned, rtol=0, atol=1e-12)
    # At rest in the turning frame: the Jacobi integral is that of the effective potential.
    effective = -fs.gravity(BAR, 1.0).value(places) - 0.5 * omega**2 * np.sum(places**2, axis=1)
    np.testing.assert_allclose(fs.jacobi(simulation.snapshot(), spin), effective, rtol=1e-13)


def growth(omega, places):
    """Largest growth rate of small displacements in the turning frame, from the analytic Hessian."""
    rates = []
    for place in places:
        bend = fs.gravity(BAR, 1.0).hessian(place) + omega**2 * np.diag([1.0, 1.0, 0.0])
        coriolis = 2.0 * omega * np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
        system = np.block([[np.zeros((3, 3)), np.eye(3)], [bend, coriolis]])
        rates.append(np.linalg.eigvals(system).real.max())
    return max(rates)


def test_which_equilibria_of_the_segment_are_stable():
    """Collinear ones never are; isosceles ones are where the segment turns slowly, seen from them nearly a point."""
    for omega in (0.1, 0.5, 2.0):
        x, y = float(collinear(omega)), float(isosceles(omega))
        rate = growth(omega, [(x, 0, 0)])
        assert rate > 0.1 * omega
        # A displacement along the unstable direction, left to itself, grows at that rate.
        spin = fs.Spin(rate=omega)
        places = np.array([(x * (1 + 1e-9), 0, 0)])
        simulation = run(BAR, places, omega * np.cross((0, 0, 1), places), spin)
        ends = []
        for time in (5.0 / rate, 7.0 / rate):
            simulation.advance(time)
            ends.append(np.linalg.norm(simulation.positions[0] - spin(time).apply((x, 0, 0))))
        assert math.log(ends[1] / ends[0]) == pytest.approx(2.0, rel=0.02)
        assert (growth(omega, [(0, y, 0)]) < 1e-6 * omega) == (omega == 0.1)
