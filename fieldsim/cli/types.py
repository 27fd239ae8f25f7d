"""Types of the command line's options."""

import re

import click

from fieldsim.errors import InputError


class Size(click.ParamType):
    """(width, height), written 640x360."""

    name = "size"

    def convert(self, value, param, ctx):
        """The value of what was written."""
        from fieldsim import validate

        if isinstance(value, tuple):
            return value
        found = re.fullmatch(r"(-?\d+)x(-?\d+)", value.strip().lower())
        if not found:
            self.fail(f"{value!r} is no size; write it like 640x360", param, ctx)
        try:
            return validate.size("frame", (int(found[1]), int(found[2])))
        except InputError:
            self.fail(f"size is {value}; give a width and a height from 1 to 16384", param, ctx)


class IntegratorType(click.ParamType):
    """An integrator, written auto, radau, leapfrog:1e-3, ..."""

    name = "integrator"

    def convert(self, value, param, ctx):
        """The value of what was written."""
        from fieldsim.dynamics.auto import integrator_named

        if not isinstance(value, str):
            return value
        try:
            return integrator_named(value)
        except InputError as error:
            self.fail(str(error), param, ctx)


class FilePath(click.ParamType):
    """The path of a file."""

    name = "text"

    def convert(self, value, param, ctx):
        """The value of what was written."""
        from fieldsim import validate

        try:
            validate.path("the command", "path", value)
        except InputError:
            self.fail(f"{value!r} is no path of a file", param, ctx)
        return value


class Device(click.ParamType):
    """Where to compute."""

    name = "device"

    def convert(self, value, param, ctx):
        """The value of what was written."""
        if not re.fullmatch(r"cpu|cuda(:\d+)?", value):
            self.fail(f"{value!r} is no device; give cpu, cuda or cuda:1", param, ctx)
        return value


class Positive(click.ParamType):
    """A number above 0."""

    name = "number"

    def convert(self, value, param, ctx):
        """The value of what was written."""
        try:
            number = float(value)
        except ValueError:
            self.fail(f"{value!r} is no number", param, ctx)
        if not 0.0 < number < float("inf"):
            self.fail(f"{value} is not a positive number", param, ctx)
        return number
