"""`python -m mrdamper`: the command where its script is not on the path."""

from mrdamper.cli import main

main()
