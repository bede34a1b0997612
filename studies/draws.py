"""Many pieces of one study: worked on by the chosen workers and kept in its folder, one by one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from studies.kept import Kept, Row
from studies.versions import work_folder
from studies.workers import Piece, chosen_workers

OFTEN = 20  # times that a study tells how far it is


def kept_rows(
    folder: Path,
    work: Callable[[Piece], Row],
    pieces: Mapping[str, Piece],
    say: Callable[[str], None],
    what: str = "loops",
) -> list[Row]:
    """A row for every piece, in their order; what the same code has kept is not done again."""
    every = max(len(pieces) // OFTEN, 1)

    def tell(done: int, of: int) -> None:
        if done % every == 0 or done == of:
            say(f"{done} of {of} {what}")

    kept = Kept(work_folder(folder) / "rows.jsonl")
    return chosen_workers().keep(kept, work, pieces, tell)
