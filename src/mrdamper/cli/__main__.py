"""`python -m mrdamper.cli`."""

from mrdamper.cli import main

main()
