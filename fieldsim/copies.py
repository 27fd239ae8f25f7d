"""Copies and pickles: values take them; what is tied to its process refuses them in words."""

from fieldsim.errors import InputError


class Uncopied:
    """Base of what is tied to its process: buffers, files, a run under way."""

    _remedy = "make another one"

    def __reduce_ex__(self, protocol):
        name = type(self).__name__
        raise InputError(f"{name}: it is tied to this process and can be neither copied nor pickled; {self._remedy}")


def shallow(thing):
    """Another object of the same class with the same attributes, for a method's own use."""
    twin = object.__new__(type(thing))
    twin.__dict__.update(thing.__dict__)
    return twin
