"""python -m studies.command_line: the same as ``workbench``."""

from studies.command_line import main

main()
