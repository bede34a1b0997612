"""CasADi functions as machine code where a C compiler is found, as they are where none is.

Compile last: a compiled function has no derivatives and cannot be compiled into another one, so
build everything from :meth:`workbench.model.Model.step` first, then compile the result.
``map``, ``mapaccum`` and threads work on compiled functions as on any other, at full speed.

The libraries are kept in the user's cache folder under the hash of their C code, the compiler and
the flags.  ``CC`` names another compiler, ``WORKBENCH_NO_COMPILER=1`` forbids its use.  Where the
machine has none, that of the package ``ziglang`` serves (Clang with its own headers); ``make``
installs it there.
"""

from __future__ import annotations

import ctypes
import hashlib
import logging
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TypeVar

import casadi as ca

log = logging.getLogger("workbench")

T = TypeVar("T")

# No contraction to fused multiply-add: results stay equal to the last bit on every processor.
# CasADi 3.8 copies empty inputs through an integer 0, which new compilers refuse by default.
FLAGS = ("-fPIC", "-shared", "-ffp-contract=off", "-w", "-Wno-int-conversion")
LONG_CODE = 300_000  # characters; beyond, -O2 takes twice the time to compile and runs no faster
COMPILERS = ("cc", "gcc", "clang")
PACKAGED = (sys.executable, "-m", "ziglang", "cc")
TIMEOUT_S = 120.0

_refused: set[tuple[tuple[str, ...], str]] = set()  # compilers, and what they do not compile


def compiled(function: ca.Function) -> ca.Function:
    """The same function as machine code, equal to the last bit; itself where that cannot be had."""
    compiler = _compiler(os.environ.get("CC", ""), os.environ.get("WORKBENCH_NO_COMPILER", ""))
    if not compiler:
        return function
    try:
        return _loaded(function, compiler)
    except (OSError, RuntimeError, subprocess.SubprocessError) as error:
        _say_not_compiled(function.name(), error)
        return function


@cache
def _compiler(wanted: str, forbidden: str) -> tuple[str, ...]:
    """The command of the C compiler; empty, and said once, where there is none."""
    if forbidden not in ("", "0"):
        log.info("WORKBENCH_NO_COMPILER is set: functions run in CasADi's virtual machine")
        return ()
    packaged = (PACKAGED,) if find_spec("ziglang") else ()
    for command in (tuple(shlex.split(wanted)), *((name,) for name in COMPILERS), *packaged):
        if command and _version(command):
            return command
    log.info("no C compiler works here: functions run in CasADi's virtual machine, which is slower")
    return ()


def loaded(
    name: str, code: str, native: tuple[tuple[str, ...], ...], flags: tuple[str, ...]
) -> ctypes.CDLL | None:
    """A library of C written elsewhere, for the machine that this runs on.

    ``native`` are ways to say so, of which the first is taken that the compiler knows.  None where
    there is no compiler, or none that compiles it; the latter is said once, and not tried again.
    The library stays open as long as the process lives.
    """
    compiler = _compiler(os.environ.get("CC", ""), os.environ.get("WORKBENCH_NO_COMPILER", ""))
    if not compiler or (compiler, name) in _refused:
        return None
    try:
        machine, told = _machine(compiler, native)
        command = (*compiler, "-O2", *FLAGS, *machine, *flags)
        return _opened(lambda: _made(name, code, command, told), ctypes.CDLL)
    except (OSError, subprocess.SubprocessError) as error:
        _refused.add((compiler, name))
        _say_not_compiled(name, error)
        return None


def _opened(made: Callable[[], Path], opened: Callable[[str], T]) -> T:
    """What is in a library, which is compiled once more if it is damaged."""
    path = made()
    try:
        return opened(str(path))
    except (OSError, RuntimeError):
        path.unlink(missing_ok=True)
        return opened(str(made()))


def _say_not_compiled(name: str, error: Exception) -> None:
    reason = getattr(error, "stderr", None) or str(error)
    log.warning("%s is not compiled: %s", name, reason.strip()[:300])


def _loaded(function: ca.Function, compiler: tuple[str, ...]) -> ca.Function:
    """The function from its library."""
    name = function.name()
    return _opened(lambda: _library(function, compiler), lambda path: ca.external(name, path))


def _library(function: ca.Function, compiler: tuple[str, ...]) -> Path:
    """Path of the shared library of a function, made unless it is there already."""
    generator = ca.CodeGenerator(function.name())
    generator.add(function)
    code = generator.dump()
    command = (*compiler, "-O1" if len(code) > LONG_CODE else "-O2", *FLAGS)
    return _made(function.name(), code, command, _version(compiler))


def _made(name: str, code: str, command: tuple[str, ...], by: str) -> Path:
    """Path of the library of this code, which is kept under all that it is made of and ``by``."""
    made_by = (by, *command, platform.machine())
    key = hashlib.sha256("\n".join((*made_by, code)).encode()).hexdigest()[:32]
    path = _folder() / f"{name}_{key}.so"
    if not path.exists():
        _compile(code, path, command)
    return path


def _compile(code: str, library: Path, command: tuple[str, ...]) -> None:
    """Compile aside and move into place, so that other processes never see half a library."""
    strict = ("-Wl,-z,defs",) if sys.platform == "linux" else ()  # fail here, not at the first call
    with tempfile.TemporaryDirectory(dir=library.parent) as aside:
        source, made = Path(aside, "source.c"), Path(aside, library.name)
        source.write_text(code, encoding="utf-8")
        arguments = [*command, *strict, str(source), "-o", str(made), "-lm"]
        _run(arguments).check_returncode()
        os.replace(made, library)


@cache
def _version(compiler: tuple[str, ...]) -> str:
    """What the compiler says it is; empty where it does not run.

    A Mac without its developer tools has a ``cc`` that only says how to get them.
    """
    if not shutil.which(compiler[0]):
        return ""
    command = [*compiler, "--version"]
    try:
        answer = _run(command)
    except (OSError, subprocess.SubprocessError):
        return ""
    return "" if answer.returncode else answer.stdout + answer.stderr


@cache
def _machine(
    compiler: tuple[str, ...], native: tuple[tuple[str, ...], ...]
) -> tuple[tuple[str, ...], str]:
    """Flags that a compiler knows, and what it takes the machine for under them: all it defines.

    Raises
    ------
    OSError
        If it knows none of them.
    """
    for flags in native:
        answer = _run([*compiler, *flags, "-dM", "-E", "-x", "c", os.devnull])
        if not answer.returncode:
            return flags, _version(compiler) + answer.stdout
    raise OSError(f"{compiler[0]} does not say what machine it compiles for")


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    """Run a compiler; that of the package keeps what it makes once beside our folder."""
    beside = _folder().with_name(f"{_folder().name}-zig")
    kept = {"ZIG_GLOBAL_CACHE_DIR": str(beside), **os.environ}
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, env=kept)


@cache
def _folder() -> Path:
    """The user's cache folder; one that lasts as long as the process where that is read-only."""
    try:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        folder = Path(base, "workbench", "compiled")
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except (OSError, RuntimeError):  # no home at all is a RuntimeError
        return Path(_kept(tempfile.TemporaryDirectory(prefix="workbench-")).name)


@cache
def _kept(folder: tempfile.TemporaryDirectory[str]) -> tempfile.TemporaryDirectory[str]:
    """Held by the cache, so that the folder is removed only when the process ends."""
    return folder
