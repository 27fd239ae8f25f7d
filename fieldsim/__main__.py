"""`python -m fieldsim` is the command `fieldsim`."""

from fieldsim.cli.program import main

main()
