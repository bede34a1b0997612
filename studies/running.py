"""Running studies: which ones, what is written of each, and many of them at once."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from studies.figures.style import save_all
from studies.kept import Row
from studies.registry import STUDIES
from studies.study import NUMBERS, TEXT, Extent, Outcome, Study
from studies.tables import noted_tables, write_tables
from studies.text import columns
from studies.versions import code, versions
from studies.workers import Workers, working_with
from workbench.errors import InputError, Message, listed, nearest, whole_file

ALL = "all"
DEBUG = "WORKBENCH_DEBUG"

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
        unfinished.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
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
        "numbers": dict(found.numbers),
    }


@dataclass(frozen=True)
class Part:
    """One study of several that run at once."""

    name: str
    folder: Path
    extent: Extent
    command: str
    quiet: bool


def run_all(
    studies: Sequence[Study],
    folder: Path,
    extent: Extent,
    command: str,
    workers: Workers,
    say: Say,
    show: Say,
    quiet: bool = False,
) -> list[str]:
    """Run studies, each in a folder of its name; gives what fails, in words.

    As many at a time as there are workers, the longest first, as the registry lists them.  What
    the same code has finished is not run again.  A study that breaks off stops no other.
    """
    parts = {s.name: Part(s.name, folder / s.name, extent, command, quiet) for s in studies}
    there = {name for name, part in parts.items() if _finished(part)}
    left = {name: part for name, part in parts.items() if name not in there}
    say(f"{len(there)} of {len(parts)} studies are there")
    broke: dict[str, str] = {}
    for done, (name, row) in enumerate(workers.results(_worked, left), start=len(there) + 1):
        broke |= {name: row["broke"]} if row["broke"] else {}
        say(f"{name} {'broke off' if row['broke'] else 'is there'}: {done} of {len(parts)} studies")
    failed = []
    for name, part in parts.items():
        if name in broke:
            failed.append(f"{name} broke off: {broke[name]}")
            continue
        show((part.folder / TEXT).read_text(encoding="utf-8"))
        failed += _failed(name, json.loads((part.folder / NUMBERS).read_text(encoding="utf-8")))
    return failed


def _worked(part: Part) -> Row:
    """Run one study here, its draws in this process, its progress on stderr."""

    def say(message: str) -> None:
        if not part.quiet:
            print(f"{part.name}: {message}", file=sys.stderr, flush=True)

    try:
        with working_with(Workers(1)):
            study = STUDIES[part.name]
            run_study(study, part.folder, part.extent, part.command, say, lambda text: None)
    except Exception as error:
        if os.environ.get(DEBUG):
            raise
        return {"broke": f"{type(error).__name__} {error}".strip().splitlines()[0]}
    return {"broke": ""}


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
