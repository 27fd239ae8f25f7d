"""Portable functions compiled to lanes: C++ over vectors, several points at a time."""

from fieldsim.portable.lanes.source import Lanes, lanes_of

__all__ = ["Lanes", "lanes_of"]
