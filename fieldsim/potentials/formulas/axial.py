"""The Hessian of a field that is symmetric about an axis, as of a segment or a circle, from its local derivatives."""

from fieldsim.portable import portable, real


@portable
def axial_hessian(
    across: real,
    lift: real,
    mixed: real,
    bend: real,
    ux: real,
    uy: real,
    uz: real,
    wx: real,
    wy: real,
    wz: real,
    rho: real,
):
    """(Fxx, Fyy, Fzz, Fxy, Fxz, Fyz): `across` in all directions, and what it has more.

    lift: along the unit axis u; bend: along the offset w from the axis, of length rho (nothing on the axis); mixed:
    along both.
    """
    if rho > real(0.0):
        wx /= rho
        wy /= rho
        wz /= rho
    return (
        across + lift * ux * ux + real(2.0) * mixed * ux * wx + bend * wx * wx,
        across + lift * uy * uy + real(2.0) * mixed * uy * wy + bend * wy * wy,
        across + lift * uz * uz + real(2.0) * mixed * uz * wz + bend * wz * wz,
        lift * ux * uy + mixed * (ux * wy + uy * wx) + bend * wx * wy,
        lift * ux * uz + mixed * (ux * wz + uz * wx) + bend * wx * wz,
        lift * uy * uz + mixed * (uy * wz + uz * wy) + bend * wy * wz,
    )
