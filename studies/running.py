"""Running studies: which ones, and what is written of each."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from studies.figures.style import save_all
from studies.registry import STUDIES
from studies.study import Extent, Study
from studies.text import columns
from workbench.errors import InputError, Message, listed, nearest, whole_file

ALL = "all"


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
    study: Study,
    folder: Path,
    extent: Extent,
    command: str,
    say: Callable[[str], None],
    show: Callable[[str], None],
) -> bool:
    """Run a study and write its text, numbers and figures; True where every claim holds."""
    found = study.run(folder, extent, say)
    claims = columns(
        ("claim", "found", "holds"),
        [(c.claim, c.found, "yes" if c.holds else "NO") for c in found.claims],
    )
    text = f"{study.name}: {study.question}\n\n{found.text}\n\n{claims}\n"
    folder.mkdir(parents=True, exist_ok=True)
    with whole_file(folder / "study.txt") as unfinished:
        unfinished.write_text(text, encoding="utf-8")
    document = {
        "schema": "workbench.study/1",
        "study": study.name,
        "question": study.question,
        "source": study.source,
        "extent": extent.value,
        "claims": [asdict(claim) for claim in found.claims],
        "numbers": dict(found.numbers),
    }
    with whole_file(folder / "study.json") as unfinished:
        unfinished.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    save_all(found.figures, folder / "figures", command)
    show(text.rstrip("\n"))
    return all(claim.holds for claim in found.claims)
