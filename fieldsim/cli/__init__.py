"""The command line: `fieldsim COMMAND`."""

from fieldsim.cli.program import main

__all__ = ["main"]
