"""What a paper prints beside what comes out here, row by row of physics.md section 5."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

from studies.study import Claim, Outcome
from studies.text import columns

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Finding:
    """One result of one row.

    Attributes
    ----------
    row
        As in physics.md section 5: ``S000-1``.
    what
        The quantity.
    printed
        What the paper prints, with its unit; a dash where it shows only a figure.
    ours
        What comes out here.
    why
        One sentence on the difference, or on what of it is chosen; may be empty.
    """

    row: str
    what: str
    printed: str
    ours: str
    why: str = ""


def findings_text(found: Iterable[Finding]) -> str:
    """A table, then the sentences."""
    found = list(found)
    rows = [(f.row, f.what, f.printed, f.ours) for f in found]
    table = columns(("row", "what", "paper", "here"), rows)
    said = dict.fromkeys(f"{f.row}, {f.what}: {f.why}" for f in found if f.why)
    return "\n\n".join(filter(None, (table, "\n".join(said))))


def outcome(
    found: Iterable[Finding],
    claims: Iterable[Claim],
    figures: Mapping[str, Figure],
    tables: Iterable[str] = (),
) -> Outcome:
    """What a study of rows gives: tables, findings, claims, figures."""
    found = list(found)
    return Outcome(
        text="\n\n".join((*tables, findings_text(found))),
        claims=tuple(replace(each, holds=bool(each.holds)) for each in claims),
        figures=figures,
        numbers={"findings": [asdict(each) for each in found]},
    )
