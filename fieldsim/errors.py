"""Every exception and warning that fieldsim raises on purpose, in one tree.

Messages name the object, the value and the remedy.
"""


class FieldsimError(Exception):
    """Root of fieldsim's exceptions."""


class InputError(FieldsimError, ValueError):
    """A value that a user gave cannot be used. located: whether the message names the user's line."""

    located = False


class OperandError(InputError, TypeError):
    """Two things that an operator such as + cannot take together."""


class PortableError(FieldsimError, TypeError):
    """A portable function uses something that a compilation target lacks."""


class DeviceError(FieldsimError, RuntimeError):
    """The device asked for is not there."""


class ScenarioError(FieldsimError, RuntimeError):
    """A scenario script cannot be loaded or its `build` failed."""


class FilmError(FieldsimError, RuntimeError):
    """A film, picture or recording could not be written; what had its name before is as it was."""


class FieldsimWarning(UserWarning):
    """Something legal that is probably not what was meant."""
