"""`python -m fieldsim` is the command `fieldsim`."""

from fieldsim.cli import main

main()
