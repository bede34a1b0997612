"""What the answers of study ``hidden-effects`` say: claims, counted group by group, and figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

from studies.figures.confusion import confusion_figure
from studies.hidden_benches import BENCHES
from studies.hidden_rows import Kind, Row, counts, plain, table
from studies.study import Claim, Outcome
from workbench.diagnosis.result import Verdict

STRONG = 0.60  # of the misfit, removed by an effect whose size is to be right
CLOSE = 0.10  # of a hidden size
MAPPED = (Kind.EFFECT, Kind.LAW, Kind.NOTHING)  # in the confusion matrix


def outcome(rows: Sequence[Row]) -> Outcome:
    """Table, claims and figures of some answers."""
    mapped = [row for row in rows if row.kind in MAPPED]
    figures = {
        f"confusion_{plant}": confusion_figure(
            plant.replace("_", " "),
            [(r.hidden, r.first, r.right) for r in mapped if r.plant == plant],
        )
        for plant in dict.fromkeys(row.plant for row in mapped)
    }
    claims = tuple(chain(_of_effects(rows), _of_others(rows)))
    text = "\n\n".join((table(rows), counts(rows)))
    return Outcome(text, claims, figures, {"rows": [plain(row) for row in rows]})


def _of_effects(rows: Sequence[Row]) -> Iterator[Claim]:
    """The bar for single effects."""
    visible = [r for r in rows if r.visible]
    effects = [r for r in rows if r.kind is Kind.EFFECT]
    named = [r for r in effects if r.verdict in (Verdict.FOUND.value, Verdict.TIE.value)]
    yield from _share("visible effects first", [r.place == 1 for r in visible], 0.90)
    yield from _share("visible effects first or tied", [r.tied for r in visible], 0.97)
    in_front = [0 < r.place <= 3 for r in visible]
    yield from _share("visible effects in the top three", in_front, 1.0)
    yield from _share("all effects first", [r.place == 1 for r in effects], 0.75)
    yield from _share("right of those with found or tie", [_is_there(r) for r in named], 0.97)
    strong = [r for r in effects if r.own_drop > STRONG and r.place == 1]
    close = [abs(r.found / r.size - 1.0) <= CLOSE for r in strong]
    yield from _share(f"size of strong effects within {CLOSE:.0%}", close, 0.90)


def _of_others(rows: Sequence[Row]) -> Iterator[Claim]:
    """The bar for all else; a group that was not run claims nothing."""
    of = {kind: [r for r in rows if r.kind is kind] for kind in Kind}
    yield from _share("no false name where nothing is hidden", _right(of[Kind.NOTHING]), 1.0)
    accepted = [k < r.accepted for r in of[Kind.PAIR] for k in (0, 1)]
    yield from _share("effects of pairs found", accepted, 0.85)
    yield from _share("pairs without a wrong effect", [r.wrong == 0 for r in of[Kind.PAIR]], 1.0)
    yield from _share("laws called outside the catalogue", _right(of[Kind.LAW]), 5 / 6)
    balances = [r.balance_right for r in of[Kind.LAW]]
    yield from _share("laws in the right balance", balances, 1.0)
    yield from _share("recordings called too weak", _right(of[Kind.WEAK]), 5 / 6)
    first = {(r.plant, r.hidden, r.seed): r.first for r in of[Kind.EFFECT]}
    wide = [((r.plant, r.hidden, r.seed), r.first) for r in of[Kind.WIDTH]]
    same = [first[case] == name for case, name in wide if case in first]
    yield from _share("the same first name with priors three times as wide", same, 0.90)


def _is_there(row: Row) -> bool:
    """Whether what is named, or tied with it, really is there: hidden, or a small difference."""
    return row.tied or row.first.partition("@")[0] in BENCHES[row.plant].always_there


def _right(rows: Sequence[Row]) -> list[bool]:
    return [row.right for row in rows]


def _share(what: str, holds: Sequence[bool], least: float) -> Iterator[Claim]:
    if holds:
        share = sum(holds) / len(holds)
        found = f"{sum(holds)} of {len(holds)} ({share:.0%})"
        yield Claim(f"{what}, at least {least:.0%}", found, share >= least)
