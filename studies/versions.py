"""Which code made a result: a hash of ours, and the versions of what it stands on."""

from __future__ import annotations

import platform
from collections.abc import Iterable
from functools import cache
from hashlib import sha256
from importlib.metadata import version
from itertools import product
from pathlib import Path

ROOT = Path(__file__).parents[1]
BELOW = ("workbench", "linearize", "controllers", "estimators")
WRITTEN_IN = ("py", "c", "h")  # what is compiled decides numbers as well
STANDS_ON = (
    "numpy", "scipy", "casadi", "control", "cvxpy", "daqp", "filterpy", "osqp", "matplotlib",
)  # fmt: skip


@cache
def code_of_loops() -> str:
    """A hash of the code that closes a loop; figures, page and reports are left out."""
    return _hash([*ROOT.glob("studies/*.py"), *_code_in((*BELOW, "studies/truth"))])


def work_folder(folder: Path) -> Path:
    """Where a study keeps its finished pieces: those of other code lie beside and are not read."""
    return folder / "work" / code_of_loops()[:16]


@cache
def code() -> str:
    """A hash of all that decides a study, its figures and its text."""
    return _hash([*_code_in((*BELOW, "studies")), *ROOT.glob("studies/**/*.json")])


def versions() -> dict[str, str]:
    """A hash of our code, and versions of Python and of the libraries that numbers come from."""
    libraries = {name: version(name) for name in STANDS_ON}
    return {"code": code()[:16], "python": platform.python_version()} | libraries


def _code_in(packages: Iterable[str]) -> list[Path]:
    every = product(packages, WRITTEN_IN)
    return [file for package, end in every for file in ROOT.glob(f"{package}/**/*.{end}")]


def _hash(files: Iterable[Path]) -> str:
    found = sha256()
    for file in sorted(files):
        found.update(file.relative_to(ROOT).as_posix().encode() + b"\0" + file.read_bytes())
    return found.hexdigest()
