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


def color_rgb(owner: str, color, others=()) -> tuple[float, float, float]:
    """Linear RGB in 0..1 of a colour: a name ("terracotta", any CSS name), "#rrggbb", or three sRGB numbers in 0..1.

    others: names that are no colours but would do as well, for the hint at a name that is unknown.
    """
    if isinstance(color, str):
        srgb = np.array(_named(owner, color, others)) / 255.0
    else:
        srgb = np.asarray(validate.vector(owner, "color", color))
        if (srgb < 0).any() or (srgb > 1).any():
            raise InputError(f"{owner}: color is {tuple(srgb.tolist())}; give red, green, blue in 0..1")
    return tuple(linear_of(srgb).tolist())


def linear_of(srgb: np.ndarray) -> np.ndarray:
    """Linear values of sRGB ones."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def _named(owner, name, others):
    try:
        return ImageColor.getrgb(_NAMES.get(name.lower(), name))[:3]
    except ValueError:
        known = [*others, *_NAMES, *ImageColor.colormap]
        near = difflib.get_close_matches(name.lower(), known, n=1)
        textures = "".join(f", {other!r}" for other in others)
        hint = f"; did you mean {near[0]!r}?" if near else f"; give a CSS name, '#rrggbb' or (r, g, b){textures}"
        raise InputError(f"{owner}: unknown color {name!r}{hint}") from None
