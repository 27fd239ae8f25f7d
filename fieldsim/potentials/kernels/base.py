"""What every convolution kernel h(r) shares: frozen values, lengths in scene units."""

import dataclasses

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitives.base import LEAST, MOST


@dataclasses.dataclass(frozen=True)
class Kernel:
    """A radial function h(r); `width` is the one parameter that formulas take."""

    def __post_init__(self):
        for field in dataclasses.fields(self):
            limit = {"at_least": 0.0} if field.name == "softening" else {"above": 0.0}
            value = validate.number(type(self).__name__, field.name, getattr(self, field.name), **limit)
            # A softening that small is none.
            if value > MOST or (value < LEAST and field.name != "softening"):
                raise InputError(
                    f"{type(self).__name__}: {field.name} is {value:g}, whose powers no number holds; give one from "
                    f"{LEAST:g} to {MOST:g}, in another unit"
                )
            object.__setattr__(self, field.name, value)

    @property
    def width(self) -> float:
        """The kernel's parameter, as packed into element rows."""
        (field,) = dataclasses.fields(self)
        return getattr(self, field.name)
