"""What the answers of study ``hidden-effects`` say: claims, counted group by group, and figures.

All answers together must reach each bar.  A sample of them, as the quick grid asks, refutes a bar
where so few right ones would come up in one of twenty such samples at most; a bar of all is refuted
by one that is wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import chain
from math import ceil
from statistics import median

from scipy.stats import binom

from studies.figures.confusion import confusion_figure
from studies.hidden_benches import BENCHES, SERVO_DRIVE
from studies.hidden_rows import Kind, Row, confusion, counts, plain, table
from studies.study import Claim, Extent, Outcome
from workbench.diagnosis.result import Verdict

STRONG = 0.60  # of the misfit, removed by an effect whose size is to be right
ALONE = 0.90  # of the misfit, removed by an effect beside which hardly anything acts
CLOSE = 0.10  # of a hidden size
KNOWN_TO = 2.0  # standard deviations that a size may be off
CHANCE = 0.05  # of a sample that speaks against a bar that is reached
MAPPED = (Kind.EFFECT, Kind.LAW, Kind.NOTHING)  # in the confusion matrix


def outcome(rows: Sequence[Row], extent: Extent = Extent.FULL) -> Outcome:
    """Tables, claims and figures of all answers, or of the sample of the quick grid."""
    enough = _all_of_it if extent is Extent.FULL else _of_a_sample
    mapped = [row for row in rows if row.kind in MAPPED]
    figures = {
        f"confusion_{plant}": confusion_figure(
            plant.replace("_", " "),
            [(r.hidden, r.first, r.right) for r in mapped if r.plant == plant],
        )
        for plant in dict.fromkeys(row.plant for row in mapped)
    }
    claims = tuple(chain(_of_effects(rows, enough), _of_others(rows, enough)))
    text = "\n\n".join((table(rows), confusion(mapped), counts(rows)))
    return Outcome(text, claims, figures, {"rows": [plain(row) for row in rows]})


def _all_of_it(count: int, share: float) -> int:
    """How many of so many must hold for a share."""
    return ceil(share * count - 1e-9)


def _of_a_sample(count: int, share: float) -> int:
    """The fewest of a sample that do not refute a share."""
    return int(binom.ppf(CHANCE, count, share))


Enough = Callable[[int, float], int]


def _of_effects(rows: Sequence[Row], enough: Enough) -> Iterator[Claim]:
    """The bar for single effects."""
    visible = [r for r in rows if r.visible]
    effects = [r for r in rows if r.kind is Kind.EFFECT]
    named = [r for r in effects if r.verdict in (Verdict.FOUND.value, Verdict.TIE.value)]
    told = [r for r in visible if not r.crowd]
    asked = (
        ("visible effects first", [r.place == 1 for r in visible], 0.90),
        ("visible effects first or tied", [r.tied for r in visible], 0.97),
        (
            "visible effects in the top three, unless more than three are said to do the same",
            [0 < r.place <= 3 for r in told],
            1.0,
        ),
        ("all effects first", [r.place == 1 for r in effects], 0.75),
        (
            "what found and tie name is there, hidden or as a small difference",
            [_is_there(r) for r in named],
            0.97,
        ),
    )
    for what, holds, least in asked:
        yield from _share(what, holds, least, enough)
    yield from _sizes([r for r in effects if r.own_drop > STRONG and r.place == 1])


def _sizes(strong: Sequence[Row]) -> Iterator[Claim]:
    """The bar for the sizes of effects that lead and remove most of the misfit."""
    if strong:
        errors = [abs(r.found / r.size - 1.0) for r in strong]
        alone = [e for e, r in zip(errors, strong, strict=True) if r.own_drop > ALONE]
        told = sum(abs(r.found - r.size) <= KNOWN_TO * r.deviation for r in strong)
        counted = f"{_close(errors)} within {CLOSE:.0%}, {told} within two deviations"
        where = f"; where one removes over {ALONE:.0%}, {_close(alone)}" if alone else ""
        found = f"{median(errors):.1%} ({counted}{where})"
        what = f"median error of the size of strong effects, at most {CLOSE:.0%}"
        yield Claim(what, found, median(errors) <= CLOSE)


def _close(errors: Sequence[float]) -> str:
    return f"{sum(error <= CLOSE for error in errors)} of {len(errors)}"


def _of_others(rows: Sequence[Row], enough: Enough) -> Iterator[Claim]:
    """The bar for all else; a group that was not run claims nothing."""
    of = {kind: [r for r in rows if r.kind is kind] for kind in Kind}
    accepted = [k < r.accepted for r in of[Kind.PAIR] for k in (0, 1)]
    asked = (
        ("no false name where nothing is hidden", _right(of[Kind.NOTHING]), 1.0),
        ("effects of pairs found", accepted, 0.85),
        ("pairs without a wrong effect", [r.wrong == 0 for r in of[Kind.PAIR]], 1.0),
        ("recordings called too weak", _right(of[Kind.WEAK]), 5 / 6),
    )
    for what, holds, least in asked:
        yield from _share(what, holds, least, enough)
    yield from _widths(of[Kind.EFFECT], of[Kind.WIDTH], enough)
    yield from _laws(of[Kind.LAW], enough)


def _widths(effects: Sequence[Row], wide: Sequence[Row], enough: Enough) -> Iterator[Claim]:
    """The bar for other priors; where the names differ, each may stand in the tie of the other."""
    asked = {(r.plant, r.hidden, r.seed): r for r in effects}
    found = [(asked.get((r.plant, r.hidden, r.seed)), r) for r in wide]
    both = [(one, other) for one, other in found if one]
    same = [one.first == other.first for one, other in both]
    seen = [holds for holds, (one, _) in zip(same, both, strict=True) if one.visible]
    offered = sum(a.offers(b.first) and b.offers(a.first) for a, b in both)
    visible, tied = f"{sum(seen)} of {len(seen)}", f"each in the other's printed tie in {offered}"
    what = "the same first name with priors three times as wide"
    for claim in _share(what, same, 0.90, enough):
        yield replace(claim, found=f"{claim.found}; of visible ones {visible}; {tied}")


def _laws(rows: Sequence[Row], enough: Enough) -> Iterator[Claim]:
    """The bar for laws is for the six of the servo drive; the one of each other plant is told."""
    six = [r for r in rows if r.plant == SERVO_DRIVE.plant]
    others = [r for r in rows if r.plant != SERVO_DRIVE.plant]
    asked: tuple[tuple[str, Callable[[Row], bool], float], ...] = (
        ("laws called outside the catalogue", lambda row: row.right, 5 / 6),
        ("laws in the right balance", lambda row: row.balance_right, 1.0),
    )
    for what, holds, least in asked:
        elsewhere = sum(map(holds, others))
        told = f"; on other plants {elsewhere} of {len(others)}" if others else ""
        for claim in _share(what, [*map(holds, six)], least, enough):
            yield replace(claim, found=claim.found + told)


def _is_there(row: Row) -> bool:
    """Whether what is named, or tied with it, really is there: hidden, or a small difference."""
    return row.tied or BENCHES[row.plant].always_has(row.first)


def _right(rows: Sequence[Row]) -> list[bool]:
    return [row.right for row in rows]


def _share(what: str, holds: Sequence[bool], least: float, enough: Enough) -> Iterator[Claim]:
    if holds:
        share = sum(holds) / len(holds)
        found = f"{sum(holds)} of {len(holds)} ({share:.0%})"
        yield Claim(f"{what}, at least {least:.0%}", found, sum(holds) >= enough(len(holds), least))
