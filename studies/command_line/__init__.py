"""The command ``workbench``: it parses, calls and prints, and holds no logic of its own.

Whatever takes time to import is imported inside the commands, so that ``--help`` is quick.
"""

from studies.command_line import (
    catalogue,
    control,
    estimation,
    identify,
    missing,
    plant,
    show,
    study,
)
from studies.command_line.application import app

ORDER = [
    "demo",
    "plants",
    "effects",
    "studies",
    "simulate",
    "compare",
    "diagnose",
    "add",
    "improve",
    "fit",
    "identify",
    "modes",
    "design",
    "check",
    "estimate",
    "study",
    "report",
]
app.registered_commands.sort(key=lambda command: ORDER.index(command.callback.__name__))

__all__ = [
    "app",
    "catalogue",
    "control",
    "estimation",
    "identify",
    "main",
    "missing",
    "plant",
    "show",
    "study",
]


def main() -> None:
    """Entry point of the command ``workbench``."""
    app()


if __name__ == "__main__":
    main()
