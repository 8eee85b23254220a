"""`python -m greensward.cli`, where the `greensward` command is not on the path."""

from greensward.cli import main

main()
