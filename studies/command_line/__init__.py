"""The command ``workbench``: it parses, calls and prints, and holds no logic of its own.

Whatever takes time to import is imported inside the commands, so that ``--help`` is quick.
"""

import os
import signal
from typing import Any

from studies.command_line import (
    catalogue,
    closed_loop,
    control,
    estimation,
    identify,
    missing,
    page,
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
    "app",
]


def _place(command: Any) -> int:
    """Where a command stands in the list of ``--help``."""
    return ORDER.index(command.name or command.callback.__name__)


app.registered_commands.sort(key=_place)

__all__ = [
    "app",
    "catalogue",
    "closed_loop",
    "control",
    "estimation",
    "identify",
    "main",
    "missing",
    "page",
    "plant",
    "show",
    "study",
]


def main() -> None:
    """Entry point of the command ``workbench``.

    Matrices here are small: a second thread of BLAS gains nothing on them, and beside the threads
    that simulate it waits for a core, for which products took hundreds of times as long.  Said
    before NumPy is imported, which reads it then; who has set another number keeps it.

    What ends a command politely, as ``timeout`` and job queues do, ends it as Ctrl-C does.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    app()


if __name__ == "__main__":
    main()
