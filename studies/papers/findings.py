"""What a paper prints beside what comes out here, row by row of physics.md section 5."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass

from studies.text import columns


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


def findings_numbers(found: Iterable[Finding]) -> list[Mapping[str, str]]:
    """The same for JSON."""
    return [asdict(each) for each in found]
