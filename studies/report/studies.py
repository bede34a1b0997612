"""The report of a folder of studies: what each asks, claims and finds, and what made it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from studies.catalogue_text import parameters_text
from studies.report.page import SECTIONS, Section, render_folder, write_report
from studies.study import NUMBERS, TEXT
from studies.text import columns
from workbench.errors import InputError, Message


def report_studies(folder: Path, command: str) -> Path:
    """One page of all studies that a folder holds; gives its path.

    Raises
    ------
    InputError
        If one of them is none of ours.
    """
    found = {path.parent.name: _read(path) for path in sorted(folder.glob(f"*/{NUMBERS}"))}
    rows = [(name, _held(d), d["extent"], d["question"]) for name, d in found.items()]
    summary = columns(("study", "claims that hold", "extent", "question"), rows)
    plants = dict.fromkeys(name for d in found.values() for name in d["plants"])
    sections = [
        Section("In short", (), summary),
        *(_section(folder, name, document) for name, document in found.items()),
        *(Section(f"Parameters of {name}", (), parameters_text(name)) for name in plants),
    ]
    return write_report(folder, "Studies of the workbench", command, sections)


def render(folder: Path) -> Path:
    """The page of a folder, of studies or of whatever else :func:`render_folder` knows."""
    if not (folder / SECTIONS).is_file() and any(folder.glob(f"*/{NUMBERS}")):
        return report_studies(folder, "")
    return render_folder(folder)


def _read(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        if document["schema"] != "workbench.study/1":
            raise ValueError
        return {"plants": [], "rows": [], "seeds": "", "versions": {}, "tables": []} | document
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(Message("is no study of ours", file=str(path))) from error


def _held(document: Mapping[str, Any]) -> str:
    holds = [claim["holds"] for claim in document["claims"]]
    return f"{sum(holds)} of {len(holds)}"


def _section(folder: Path, name: str, document: Mapping[str, Any]) -> Section:
    """Question and source, text with claims, figures, and what made it."""
    question, _, text = (folder / name / TEXT).read_text(encoding="utf-8").partition("\n\n")
    versions = ", ".join(f"{key} {value}" for key, value in document["versions"].items())
    files = ", ".join(f"{name}/tables/{each}.csv and .tex" for each in document["tables"])
    told = (
        question.partition(": ")[2],
        f"Source: {document['source']}.",
        f"Rows: {', '.join(document['rows'])}." if document["rows"] else "",
        f"Extent: {document['extent']}.  Seeds: {document['seeds'] or 'none drawn'}.",
        f"Tables: {files}." if files else "",
        f"Made with {versions}.",
    )
    figures = tuple(f"{name}/figures/{each}" for each in document.get("figures", ()))
    title = f"{name}: {_held(document)} claims hold"
    return Section(title, tuple(filter(None, told)), text.rstrip("\n"), figures)
