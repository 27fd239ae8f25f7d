"""Colours by name, by hexadecimal digits or by numbers, as linear RGB."""

import difflib

import numpy as np
from PIL import ImageColor

from fieldsim import validate
from fieldsim.errors import InputError

# Names beyond CSS's, as sRGB.
_NAMES = {
    "terracotta": "#c8643c",
    "clay": "#b5735a",
    "sand": "#d9c08c",
    "basalt": "#4a4c52",
    "ice": "#cfe8f2",
    "moss": "#7a9a4a",
    "copper": "#b87333",
    "amber": "#ffb52e",
    "ink": "#14161f",
    "bone": "#e8dcc4",
}


def color_rgb(owner: str, color, *, field: str = "color", others=()) -> tuple[float, float, float]:
    """Linear RGB in 0..1 of a colour: a name ("terracotta", any CSS name), "#rrggbb", or three sRGB numbers in 0..1.

    field: what it is given as; others: names that are no colours but would do as well, for the hint at an unknown name.
    """
    remedy = ", ".join(["give a CSS name, '#rrggbb' or (r, g, b) in 0..1", *map(repr, others)])
    if isinstance(color, str):
        srgb = np.array(_named(owner, field, color, others, remedy)) / 255.0
    else:
        srgb = validate.numbers(owner, field, color, shape=(3,), remedy=remedy)
        if (srgb < 0).any() or (srgb > 1).any():
            raise InputError(f"{owner}: {field} is {tuple(srgb.tolist())}; give red, green, blue in 0..1")
    return tuple(linear_of(srgb).tolist())


def linear_of(srgb: np.ndarray) -> np.ndarray:
    """Linear values of sRGB ones."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def _named(owner, field, name, others, remedy):
    try:
        *srgb, alpha = (*ImageColor.getrgb(_NAMES.get(name.lower(), name)), 255)[:4]
    except (ValueError, TypeError):
        known = [*others, *_NAMES, *ImageColor.colormap]
        near = difflib.get_close_matches(name.lower(), known, n=1)
        hint = f"did you mean {near[0]!r}?" if near else remedy
        raise InputError(f"{owner}: {field} is {validate.shown(name)}, an unknown color; {hint}") from None
    if alpha != 255:
        raise InputError(
            f"{owner}: {field} is {validate.shown(name)}, whose alpha means nothing here; leave it out: '#rrggbb'"
        )
    return srgb
