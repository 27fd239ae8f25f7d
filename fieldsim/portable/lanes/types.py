"""Types of values in lanes: what a number is, and whether it is the same in all lanes."""

import dataclasses

from fieldsim.portable.marks import Indices, Table, real


@dataclasses.dataclass(frozen=True)
class Type:
    """kind: real, int, bool, table or indices; varying: whether lanes hold different values."""

    kind: str
    varying: bool = False

    @property
    def cpp(self) -> str:
        """Its name in C++."""
        return _CPP[self.kind, self.varying]

    def joined(self, varying: bool) -> "Type":
        """The type, varying where it is already or `varying` says so."""
        return Type(self.kind, self.varying or varying)


_CPP = {
    ("real", True): "Real",
    ("real", False): "scalar",
    ("int", True): "Int",
    ("int", False): "int",
    ("bool", True): "Mask",
    ("bool", False): "bool",
    ("table", True): "Tables",
    ("table", False): "Table",
    ("indices", False): "Indices",
}
REAL, INT, BOOL = Type("real"), Type("int"), Type("bool")
KINDS = {real: "real", int: "int", bool: "bool", Table: "table", Indices: "indices"}


@dataclasses.dataclass(frozen=True)
class Value:
    """An expression in C++, its type, and how tightly its operator binds."""

    text: str
    type: Type
    binds: int = 100

    def within(self, binds: int) -> str:
        """The text as an operand of an operator that binds so tightly."""
        return self.text if self.binds >= binds else f"({self.text})"

    def to(self, varying: bool) -> str:
        """The text, spread over all lanes where that is wanted."""
        if not varying or self.type.varying:
            return self.text
        wide = Type(self.type.kind, True)
        return f"spread({self.text})" if self.type.kind == "bool" else f"{wide.cpp}({self.text})"
