"""`python -m runtime.cli` is the command `shoal`."""

from runtime.cli import main

main()
