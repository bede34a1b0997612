"""What study ``hidden-effects`` asked and what was answered, in plain numbers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from enum import Enum
from math import isfinite, nan
from typing import Any

from studies.text import columns

VISIBLE = 0.30  # of the misfit, removed by the refit with the hidden effect itself


class Kind(Enum):
    """What a recording hides, or how it is asked.

    EFFECT   one effect of the catalogue
    NOTHING  only the small differences that are always there
    LAW      a law that no catalogue has
    PAIR     two effects of the catalogue, to be added one after the other
    WEAK     one effect, in a recording that does not show it
    WIDTH    one effect, answered with priors three times as wide
    """

    EFFECT = "effect"
    NOTHING = "nothing"
    LAW = "law"
    PAIR = "pair"
    WEAK = "weak"
    WIDTH = "width"


@dataclass(frozen=True)
class Row:
    """One answer.

    Attributes
    ----------
    hidden, size
        What was hidden, in SI; of a pair both names, and no size.
    first, found, deviation
        What the ranking puts first, its size, and the standard deviation that is told of that; of
        a pair all that was accepted.
    place
        Rank of the hidden effect from 1, 0 where there is none.
    tied
        Whether the hidden effect leads or stands in the printed tie.
    right
        Whether the answer passes: first or tied, nothing named where nothing is hidden, a law
        called outside the catalogue, a weak recording called that, both of a pair and no other.
    own_drop
        Share of the misfit that the refit with the hidden effect removes, NaN without.
    balance, balance_right
        Where something is missing, and whether a hidden law acts there.
    crowd
        How many more do the same as what leads than a tie prints.
    beside
        What the printed tie holds beside an accepted ``first``.
    accepted, wrong
        Of a pair: how many of the two were accepted, and how many that are not there.
    """

    kind: Kind
    plant: str
    hidden: str
    seed: int
    size: float
    first: str
    found: float
    verdict: str
    place: int
    tied: bool
    right: bool
    deviation: float = nan
    own_drop: float = nan
    balance: str = ""
    balance_right: bool = False
    accepted: int = 0
    wrong: int = 0
    crowd: int = 0
    beside: tuple[str, ...] = ()
    seconds: float = nan

    @property
    def visible(self) -> bool:
        """True where the hidden effect can be seen."""
        return self.kind is Kind.EFFECT and self.own_drop > VISIBLE

    def offers(self, name: str) -> bool:
        """True where a reader of the answer has a name before him: first, or in the printed tie."""
        return name == self.first or name in self.beside


def plain(row: Row) -> dict[str, Any]:
    """A row for JSON, which knows no NaN."""
    numbers = {**asdict(row), "kind": row.kind.value}
    return {k: None if isinstance(v, float) and not isfinite(v) else v for k, v in numbers.items()}


def row_again(kept: Mapping[str, Any]) -> Row:
    """The row of what :func:`plain` gave, whatever else was kept with it, also by older code."""
    known = {name: kept[name] for name in Row.__dataclass_fields__ if name in kept}
    numbers = {k: nan if v is None else v for k, v in known.items()}
    beside = tuple(known.get("beside", ()))
    return replace(Row(**numbers), kind=Kind(numbers["kind"]), beside=beside)


def table(rows: Sequence[Row]) -> str:
    """One line for each answer."""
    head = ("asked", "plant", "hidden", "seed", "size", "first in ranking", "found", "+-",
            "verdict", "rank", "own drop", "balance", "right", "s")  # fmt: skip
    return columns(
        head,
        [
            (
                row.kind.value,
                row.plant,
                row.hidden,
                str(row.seed),
                _number(row.size, ".3g"),
                row.first or "-",
                _number(row.found, ".3g"),
                _number(row.deviation, ".2g"),
                row.verdict,
                str(row.place or "-"),
                _number(row.own_drop, ".0%"),
                row.balance or "-",
                "yes" if row.right else "NO",
                _number(row.seconds, ".0f"),
            )
            for row in rows
        ],
    )


def confusion(rows: Sequence[Row]) -> str:
    """The confusion matrix without its empty cells: what led the ranking, and how often."""
    led: dict[tuple[str, str], Counter[str]] = {}
    for row in rows:
        led.setdefault((row.plant, row.hidden), Counter())[row.first or "-"] += 1
    return columns(
        ("plant", "hidden", "first in the ranking, and how often"),
        [
            (plant, hidden, ", ".join(f"{name} {count}" for name, count in firsts.most_common()))
            for (plant, hidden), firsts in led.items()
        ],
    )


def counts(rows: Sequence[Row]) -> str:
    """How many of each plant and kind are right."""
    return columns(
        ("plant", "asked", "hidden", "recordings", "right"),
        [
            (plant, kind.value, str(len({r.hidden for r in group})), str(len(group)),
             str(sum(r.right for r in group)))
            for plant, kind, group in _groups(rows)
        ],
    )  # fmt: skip


def _groups(rows: Sequence[Row]) -> Iterator[tuple[str, Kind, list[Row]]]:
    for plant in dict.fromkeys(row.plant for row in rows):
        for kind in Kind:
            group = [row for row in rows if row.plant == plant and row.kind is kind]
            if group:
                yield plant, kind, group


def _number(value: float, form: str) -> str:
    return f"{value:{form}}" if isfinite(value) else "-"
