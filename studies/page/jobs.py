"""Long work in a process of its own: progress while it runs, a cancel that works.

The server never computes: it stays quick for every other tab.  A job leads its own group of
processes, so that a cancel also ends what it started; what it writes is written whole or not.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import time
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing import forkserver
from multiprocessing.connection import Connection
from typing import Any
from weakref import WeakSet

from workbench.errors import InputError

PREPARED = [
    "workbench.diagnosis.improve",
    "workbench.comparison",
    "workbench.fitting.fit",
    "workbench.reading",
    "studies.page.tasks",
]
STOPPED, LOST = "cancelled; nothing was changed", "ended without an answer"
PATIENCE_S = 2.0  # for a cancelled job to end before it is killed

Say = Callable[[str], None]


@dataclass(frozen=True)
class Told:
    """What a job has said so far: progress, warnings, and its end, where it has one.

    result      what it found
    refused     why there is none: wrong input, a solver that failed, a cancel
    """

    progress: tuple[str, ...] = ()
    warned: tuple[str, ...] = ()
    ended: bool = False
    result: Any = field(default=None, repr=False)
    refused: str = ""


_UNDER_WAY: WeakSet[Job] = WeakSet()


def end_all() -> None:
    """Cancel whatever runs: the server ends."""
    for job in list(_UNDER_WAY):
        job.cancel()


class Job:
    """A function of the module ``tasks`` at work; its last argument is a function for progress."""

    def __init__(self, task: Callable[..., Any], *arguments: Any) -> None:
        self._receiver, sender = prepared().Pipe(duplex=False)
        self._process = prepared().Process(
            target=_work, args=(sender, task, arguments), daemon=True
        )
        self._process.start()
        sender.close()
        self._begun = time.monotonic()
        self.told = Told()
        _UNDER_WAY.add(self)

    @property
    def elapsed_s(self) -> float:
        """Seconds since it began."""
        return time.monotonic() - self._begun

    def look(self) -> Told:
        """What it has said until now; never waits."""
        told = self.told
        try:
            while not told.ended and self._receiver.poll():
                told = _with(told, *self._receiver.recv())
        except (EOFError, OSError):
            told = _with(told, "refused", LOST)
        if told.ended and not self.told.ended:
            self._process.join(PATIENCE_S)
        self.told = told
        return told

    def cancel(self) -> None:
        """End the job and all that it started."""
        if not self.told.ended:
            self.told = _with(self.told, "refused", STOPPED)
        for how in (signal.SIGTERM, signal.SIGKILL):
            if self._process.is_alive():
                _end_group(self._process.pid, how)
                self._process.join(PATIENCE_S)
        self._receiver.close()


def begin() -> None:
    """Start the server of processes, which takes a while to import what jobs need."""
    prepared()
    forkserver.ensure_running()


def prepared() -> Any:
    """Where jobs come from: a server of processes that has imported what they need, once."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PREPARED)
    return context


def _with(told: Told, kind: str, what: Any) -> Told:
    """What was said with one message more."""
    if kind == "progress":
        return Told((*told.progress, what), told.warned)
    if kind == "warned":
        return Told(told.progress, (*told.warned, what))
    if kind == "result":
        return Told(told.progress, told.warned, True, what)
    return Told(told.progress, told.warned, True, None, what)


def _end_group(group: int, how: int) -> None:
    """End a group of processes, or the process where it does not lead a group yet."""
    try:
        if os.getpgid(group) == group:
            os.killpg(group, how)
        else:
            os.kill(group, how)
    except ProcessLookupError:
        pass


class _Teller(logging.Handler):
    """What the library logs: warnings as such, the rest as progress."""

    def __init__(self, sender: Connection) -> None:
        super().__init__()
        self.sender = sender

    def emit(self, record: logging.LogRecord) -> None:
        kind = "warned" if record.levelno >= logging.WARNING else "progress"
        self.sender.send((kind, record.getMessage()))


def _work(sender: Connection, task: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    """Run a task and send what it says and finds."""
    os.setpgid(0, 0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which cancels
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    warnings.showwarning = lambda message, *_, **__: sender.send(("warned", str(message)))
    log = logging.getLogger("workbench")
    log.addHandler(_Teller(sender))
    log.setLevel(logging.INFO)
    try:
        answer = "result", task(*arguments, lambda message: sender.send(("progress", message)))
    except InputError as error:
        answer = "refused", str(error)
    except (ArithmeticError, ValueError, OSError) as error:
        answer = "refused", str(error.args[0] if len(error.args) == 1 else error)
    except Exception as error:
        traceback.print_exc()
        answer = "refused", f"inside the program: {type(error).__name__} {error}"
    sender.send(answer)
    sender.close()
