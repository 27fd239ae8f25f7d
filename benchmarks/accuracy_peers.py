"""Where other programs lose their digits: next to a ring, on its axis, and beyond a needle's end.

galpy's RingPotential and SoftenedNeedleBarPotential and gala's LongMuraliBarPotential, where installed; all errors are
relative, against quadrature in 34 digits.
"""

import warnings

import numpy as np

import fieldsim as fs

RING = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
# Points in the half plane y = 0, x > 0: so that galpy's cylindrical coordinates are exact.
RING_PLACES = {
    "1e-8 outside a ring's wire": (1 + 1e-8, 0.0, 0.0),
    "1e-8 above a ring's wire": (1.0, 0.0, 1e-8),
    "on a ring's axis": (0.0, 0.0, 0.3),
    "1e-9 off a ring's axis": (1e-9, 0.0, 0.3),
}
NEEDLE = fs.Segment((-1, 0, 0), (1, 0, 0))
BEYOND = (4.0, 1e-7, 0.0)


def rows():
    """Errors of the pull next to a ring, and of the pull towards the axis beyond a needle's end."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        for place, point in RING_PLACES.items():
            truth = _truth(RING, point)
            ours = _error(fs.gravity(RING, 1.0).gradient(point), truth)
            yield from _beside(f"pull {place}", ours, {"galpy": lambda p=point, t=truth: _error(_galpy_ring(p), t)})
        truth = _truth(NEEDLE, BEYOND)[1:2]
        ours = _error(fs.gravity(NEEDLE, 1.0).gradient(BEYOND)[1:2], truth)
        peers = {"galpy": _galpy_needle, "gala": _gala_needle}
        name = "pull towards the axis beyond a needle's end, 1e-7 off it"
        yield from _beside(name, ours, {peer: lambda f=f: _error(f(), truth) for peer, f in peers.items()})


def _beside(name, ours, peers):
    """One row for each peer that is installed, or one without."""
    row = {"name": name, "value": ours, "unit": "relative error"}
    found = []
    for peer, error in peers.items():
        try:
            value = error()
        except ImportError:
            continue
        found.append(
            row | ({"peer": peer, "peer_value": value} if np.isfinite(value) else {"peer": f"{peer}: {value}"})
        )
    return found or [row]


def _truth(primitive, point):
    """The gradient (3,) of unit mass as mpf."""
    import jet_oracle
    import mpmath as mp

    with mp.workdps(jet_oracle.DIGITS):
        length = 2 * mp.pi if primitive is RING else mp.mpf(2)
        return [g / length for g in jet_oracle.jet(fs.Newtonian(), primitive, point)[1:4]]


def _error(pull, truth):
    """Norm of the error against the norm of the truth."""
    import mpmath as mp

    with mp.workdps(30):
        size = mp.norm(mp.matrix(truth))
        return float(mp.norm(mp.matrix([mp.mpf(float(p)) - t for p, t in zip(pull, truth, strict=True)])) / size)


def _galpy_ring(point):
    from galpy.potential import RingPotential

    ring = RingPotential(amp=1.0, a=1.0)
    r, z = np.array([point[0]]), np.array([point[2]])
    return [ring.Rforce(r, z, use_physical=False)[0], 0.0, ring.zforce(r, z, use_physical=False)[0]]


def _galpy_needle():
    from galpy.potential import SoftenedNeedleBarPotential

    needle = SoftenedNeedleBarPotential(amp=1.0, a=1.0, b=0.0, c=0.0, pa=0.0)
    x, y, z = (np.float64(v) for v in BEYOND)
    r, phi = np.hypot(x, y), np.arctan2(y, x)
    radial = needle.Rforce(r, z, phi=phi, use_physical=False)
    across = needle.phitorque(r, z, phi=phi, use_physical=False) / r
    return [radial * np.sin(phi) + across * np.cos(phi)]


def _gala_needle():
    from gala.potential import LongMuraliBarPotential

    return [-LongMuraliBarPotential(m=1.0, a=1.0, b=0.0, c=0.0).gradient(np.array(BEYOND)).ravel()[1]]
