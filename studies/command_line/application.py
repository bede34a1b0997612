"""What all commands share: the application, their options, and how they answer."""

from __future__ import annotations

import logging
import os
import shlex
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand, TyperOption

if TYPE_CHECKING:
    from studies.workers import Workers

DONE, NO, WRONG_INPUT, SOLVER_FAILED, STOPPED, UNREAD = 0, 1, 2, 3, 130, 141
LIBRARIES = "site-packages"  # where they are installed, and this program may be
PACKAGES = ("workbench", "linearize", "controllers", "estimators", "studies")
DEBUG = "WORKBENCH_DEBUG"  # set to anything, what is unforeseen is shown in full

app = typer.Typer(
    name="workbench",
    help="Pneumatic actuators: compare, find the missing effect, design and check control.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


class Spread(TyperCommand):
    """A command whose options take several values in a row: ``--validate a.csv b.csv``.

    Only behind an argument, so that options that stand first do not swallow the arguments; flags
    that stand first have none to swallow.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        options = [p for p in self.params if isinstance(p, TyperOption)]
        several = {name for p in options if p.multiple for name in p.opts}
        flags = {name for p in options if p.is_flag for name in (*p.opts, *p.secondary_opts)}
        return super().parse_args(ctx, spread(args, several, flags))


def spread(args: list[str], several: set[str], flags: Collection[str] = ()) -> list[str]:
    """Repeat an option before each of its further values."""
    found: list[str] = []
    behind = not next((arg for arg in args if arg not in flags), "-").startswith("-")
    current = ""
    for arg in args:
        if arg.startswith("-"):
            name = arg.partition("=")[0]  # --validate=a.csv
            current = name if name in several and behind else ""
            found.append(arg)
        elif current and found[-1] != current:
            found += [current, arg]
        else:
            found.append(arg)
    return found


RigFile = Annotated[Path, typer.Argument(metavar="RIG", help="Rig file (TOML).")]
Recordings = Annotated[list[Path], typer.Argument(metavar="REC...", help="Recordings.")]
Train = Annotated[list[Path], typer.Argument(metavar="TRAIN...", help="Recordings to fit.")]
Validate = Annotated[
    list[Path] | None,
    typer.Option("--validate", metavar="REC...", help="Held-out recordings, another manoeuvre."),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")]
Figures = Annotated[
    Path | None, typer.Option("--figures", metavar="DIR", help="Write figures into this folder.")
]
Json = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write as JSON too.")]
ProcessCount = Annotated[
    int | None, typer.Option("--workers", metavar="K", min=1, help="Processes; all cores.")
]
Scheduler = Annotated[
    str, typer.Option("--scheduler", metavar="tcp://HOST:PORT", help="Of a Dask cluster.")
]
Output = Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="File to write.")]


@contextmanager
def answering(quiet: bool = False) -> Iterator[Callable[[str], None]]:
    """Progress on stderr while a command works; what goes wrong as a message and an exit code."""
    from workbench.errors import InputError

    begun = time.monotonic()

    def say(message: str) -> None:
        if not quiet:
            typer.echo(f"[{time.monotonic() - begun:5.1f} s] {message}", err=True)

    try:
        with _told(say):
            yield say
    except InputError as error:
        _stop(str(error), WRONG_INPUT)
    except (ArithmeticError, _linear_algebra_error()) as error:
        _stop(str(error), SOLVER_FAILED)
    except BrokenPipeError:
        _unread()
    except OSError as error:
        _stop(f"{error.filename or ''}: {error.strerror or error}".lstrip(": "), WRONG_INPUT)
    except KeyboardInterrupt:
        _stop("stopped; no file is half-written", STOPPED)
    except (typer.Exit, typer.Abort):
        raise
    except Exception as error:
        if isinstance(error, ValueError) and _meant(error):
            _stop(str(error.args[0]) if error.args else repr(error), WRONG_INPUT)
        if os.environ.get(DEBUG):
            raise
        _stop(_unforeseen(error), SOLVER_FAILED)


@contextmanager
def _told(say: Callable[[str], None]) -> Iterator[None]:
    """Warnings and what the library logs go to stderr; information only where progress goes."""
    before, log, teller = warnings.showwarning, logging.getLogger("workbench"), _Teller(say)
    level = log.level
    warnings.showwarning = _warned
    log.addHandler(teller)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        warnings.showwarning = before
        log.removeHandler(teller)
        log.setLevel(level)


class _Teller(logging.Handler):
    def __init__(self, say: Callable[[str], None]) -> None:
        super().__init__()
        self.say = say

    def emit(self, record: logging.LogRecord) -> None:
        tell = _warned if record.levelno >= logging.WARNING else self.say
        tell(record.getMessage())


def _meant(error: ValueError) -> bool:
    """Whether a line of ours raised it, for whoever asked; an operation or a library means no one.

    Shapes that do not fit are a ValueError of numpy's too.
    """
    *_, last = traceback.extract_tb(error.__traceback__)
    parts = Path(last.filename).parts
    home = parts.index(LIBRARIES) + 1 if LIBRARIES in parts else 0
    ours = not home or parts[home] in PACKAGES
    return ours and (last.line or "raise").startswith("raise")


def _unforeseen(error: Exception) -> str:
    """One line for what nobody foresaw, with the way to its details."""
    said = f"{type(error).__name__} {error}".strip().split("\n")[0]
    return f"inside the program: {said}; {DEBUG}=1 shows where"


def workers_of(processes: int | None, scheduler: str) -> Workers:
    """Where pieces of work are done.

    Raises
    ------
    InputError
        If both are named.
    """
    from studies.workers import Workers
    from workbench.errors import InputError, Message

    if processes and scheduler:
        raise InputError(Message("a cluster has its own workers", "--workers", "no --scheduler"))
    return Workers(processes or 0, scheduler)


def example(command: str) -> str:
    """The example at the end of a command's help, kept on its own line."""
    return f"\b\nExample:\n  {command}"


def _linear_algebra_error() -> type[Exception]:
    """Numpy's error, only where numpy is loaded: nothing else can raise it."""
    numpy = sys.modules.get("numpy")
    return numpy.linalg.LinAlgError if numpy else ArithmeticError


def _unread() -> None:
    """End as a shell expects it where the reader has enough, as behind ``| head``: without a word.

    What is still to be flushed goes nowhere, or Python would complain of it in the end.
    """
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    raise typer.Exit(UNREAD)


def _stop(message: str, code: int) -> None:
    typer.echo(f"workbench: {message}", err=True)
    raise typer.Exit(code)


def _warned(message: Warning | str, *_: object, **__: object) -> None:
    typer.echo(f"warning: {message}", err=True)


def command_text() -> str:
    """The command as it was typed, for what is written beside a figure."""
    return shlex.join(["workbench", *sys.argv[1:]])
