"""Running studies: which ones, what is written of each, and many of them at once."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from studies.figures.style import save_all
from studies.plain import plain_all
from studies.registry import STUDIES
from studies.study import NUMBERS, TEXT, Extent, Outcome, Study
from studies.tables import noted_tables, write_tables
from studies.text import columns
from studies.versions import code, versions
from studies.workers import Workers, working_with
from workbench.errors import InputError, Message, listed, nearest
from workbench.whole_file import whole_file

ALL = "all"
DEBUG = "WORKBENCH_DEBUG"
ENDED, BROKE = (0, 1), 3  # exit codes of a study that came to its claims, and of one that did not

Say = Callable[[str], None]


def chosen(name: str) -> list[Study]:
    """The named study, or all.

    Raises
    ------
    InputError
        For a name that no study has, with the nearest.
    """
    if name == ALL:
        return list(STUDIES.values())
    if name not in STUDIES:
        known = (*STUDIES, ALL)
        raise InputError(Message("is no study", name, listed(known), nearest(name, known)))
    return [STUDIES[name]]


def run_study(
    study: Study, folder: Path, extent: Extent, command: str, say: Say, show: Say
) -> list[str]:
    """Run a study, write its text, numbers, tables and figures; gives the claims that fail."""
    with noted_tables() as noted:
        found = study.run(folder, extent, say)
        claims = columns(
            ("claim", "found", "holds"),
            [(c.claim, c.found, "yes" if c.holds else "NO") for c in found.claims],
        )
    text = f"{study.name}: {study.question}\n\n{found.text}\n\n{claims}\n"
    tables = write_tables(text, noted, folder / "tables")
    save_all(found.figures, folder / "figures", command)
    with whole_file(folder / TEXT) as unfinished:
        unfinished.write_text(text, encoding="utf-8")
    document = _document(study, found, extent, tables)
    with whole_file(folder / NUMBERS) as unfinished:  # the last: a study that has it is finished
        content = json.dumps(document, indent=1, allow_nan=False)
        unfinished.write_text(content + "\n", encoding="utf-8")
    show(text.rstrip("\n"))
    return _failed(study.name, document)


def _document(study: Study, found: Outcome, extent: Extent, tables: list[str]) -> dict[str, Any]:
    return {
        "schema": "workbench.study/1",
        "study": study.name,
        "question": study.question,
        "source": study.source,
        "rows": list(study.rows),
        "extent": extent.value,
        "plants": list(study.plants),
        "seeds": study.seeds,
        "versions": versions(),
        "claims": [asdict(claim) for claim in found.claims],
        "tables": tables,
        "figures": list(found.figures),
        "numbers": plain_all(found.numbers),
    }


@dataclass(frozen=True)
class Part:
    """One study of several that run at once."""

    name: str
    folder: Path
    extent: Extent
    quiet: bool = False


def run_all(
    studies: Sequence[Study],
    folder: Path,
    extent: Extent,
    count: int,
    say: Say,
    show: Say,
    quiet: bool = False,
) -> list[str]:
    """Run studies, each in a process and a folder of its own; gives what fails, in words.

    ``count`` run at a time, the longest first, as the registry lists them.  What the same code has
    finished is not run again.  A study that breaks off stops no other.
    """
    parts = [Part(study.name, folder / study.name, extent, quiet) for study in studies]
    left = [part for part in parts if not _finished(part)]
    there = len(parts) - len(left)
    say(f"{there} of {len(parts)} studies are there")
    broke: dict[str, str] = {}
    for name, reason in _each_done(left, count):
        there += 1
        broke |= {name: reason} if reason else {}
        say(f"{name} {'broke off' if reason else 'is done'}: {there} of {len(parts)} studies")
    failed = []
    for part in parts:
        if part.name in broke:
            failed.append(f"{part.name} broke off: {broke[part.name]}")
            continue
        show((part.folder / TEXT).read_text(encoding="utf-8"))
        failed += _failed(part.name, json.loads((part.folder / NUMBERS).read_text("utf-8")))
    return failed


def _each_done(parts: Sequence[Part], count: int) -> Iterator[tuple[str, str]]:
    """(name, why it broke off) of every study, as they end."""
    with ThreadPoolExecutor(count) as threads:
        doing = {threads.submit(done_apart, part): part.name for part in parts}
        try:
            for each in as_completed(doing):
                yield doing[each], each.result()
        except BaseException:
            threads.shutdown(wait=False, cancel_futures=True)
            raise


def done_apart(part: Part) -> str:
    """Run one study in a process of its own; why it broke off, if it did.

    Not in a process of joblib: some studies start processes themselves.
    """
    options = [*(["--full"] if part.extent is Extent.FULL else []), *(["-q"] * part.quiet)]
    command = [sys.executable, "-m", "studies.running", part.name, str(part.folder), *options]
    around = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    ended = subprocess.run(command, env=around, stdout=subprocess.PIPE, text=True, check=False)
    if ended.returncode in ENDED:
        return ""
    return ended.stdout.strip() or f"exit code {ended.returncode}"


def main(arguments: Sequence[str] | None = None) -> int:
    """One study of several, its draws in this process: ``python -m studies.running NAME DIR``."""
    parser = argparse.ArgumentParser(prog="python -m studies.running", description=__doc__)
    parser.add_argument("name", choices=STUDIES)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("-q", "--quiet", action="store_true")
    asked = parser.parse_args(arguments)

    def say(message: str) -> None:
        if not asked.quiet:
            print(f"{asked.name}: {message}", file=sys.stderr, flush=True)

    extent = Extent.FULL if asked.full else Extent.QUICK
    command = f"workbench study {asked.name}" + " --full" * asked.full
    try:
        with working_with(Workers(1)):
            study = STUDIES[asked.name]
            return int(
                bool(run_study(study, asked.folder, extent, command, say, lambda text: None))
            )
    except Exception as error:
        if os.environ.get(DEBUG):
            raise
        print(f"{type(error).__name__} {error}".strip().splitlines()[0])
        return BROKE


def _finished(part: Part) -> bool:
    """Whether this very code has run the study to this extent."""
    try:
        found = json.loads((part.folder / NUMBERS).read_text(encoding="utf-8"))
        return found["extent"] == part.extent.value and found["versions"]["code"] == code()[:16]
    except (OSError, ValueError, KeyError):
        return False


def _failed(name: str, document: Mapping[str, Any]) -> list[str]:
    """The claims of a study that do not hold, with its name and what was found."""
    return [
        f"{name}: {each['claim']} ({each['found']})"
        for each in document["claims"]
        if not each["holds"]
    ]


if __name__ == "__main__":
    sys.exit(main())
