"""The ranking of a diagnosis as text: what each candidate removes, and what speaks against it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite

from studies.text import columns, number, percent, removed, shown, spread
from workbench.diagnosis.judge import (
    HELD_OUT_REASON,
    LEAST_HELD_OUT,
    LEAST_SHARE,
    LEAST_TRAINING,
    SHARE_REASON,
    share_removed,
)
from workbench.diagnosis.result import Diagnosis, Ranked
from workbench.effect import Kind
from workbench.units import public_name

SHOWN_RANKS = 12
DROPS = "drop: share of the weighted misfit beyond noise that goes away, on either set"
TIES = (
    "tie: led by what leaves least of both sets where parameters stay near their priors, "
    "or clearly least of the validation"
)


def ranking_text(found: Diagnosis) -> str:
    """The best of the ranking as a table.

    Drops are of the misfit beyond noise.  The index is the modification index, in chi2; compensable
    is what the fitted parameters can imitate.
    """
    rows = [
        (
            str(place),
            row.candidate.name,
            removed(row.drop_train),
            removed(row.drop_validation),
            number(row.modification_index, 3),
            percent(row.compensable),
            sizes_text(row),
            row.decided_by.value,
            _remark(row, found),
        )
        for place, row in enumerate(found.ranking[:SHOWN_RANKS], start=1)
    ]
    head = ("", "effect", "drop train", "validation", "mod. index", "compensable", "size", "by", "")
    rest = len(found.ranking) - SHOWN_RANKS
    more = f"\n... and {rest} more, in the JSON" if rest > 0 else ""
    return f"{columns(head, rows)}{more}\n{DROPS}{_order_of_ties(found.ranking)}"


def _order_of_ties(ranking: Sequence[Ranked]) -> str:
    """What the order of a tie rests on, where effects that pass were compared."""
    alike = ranking[0].alike if ranking else ()
    passing = (row for row in ranking if row.accepted and row.kind is Kind.EFFECT)
    return f"\n{TIES}" if any(row.candidate.name in alike for row in passing) else ""


def sizes_text(row: Ranked) -> str:
    """Strength and forms with their standard deviations, forms by name; what a rig had instead."""
    strength = next(iter(row.size), "")
    sizes = []
    for name, size in row.size.items():
        form = "" if name == strength else f"{public_name(name).rpartition('.')[2]} "
        sizes.append(form + spread(size.value, size.deviation, name, 3))
    rig = f", rig {shown(row.rig_value, strength, 3)}" if isfinite(row.rig_value) else ""
    return ", ".join(sizes) + rig if sizes else "-"


def _remark(row: Ranked, found: Diagnosis) -> str:
    """What speaks for or against a candidate; passing alone makes it no second cause."""
    leader = found.ranking[0]
    if not row.accepted:
        return "; ".join((*reasons(row), *([_blind_text(row)] if row.blind else [])))
    if row is not leader and row.candidate.name not in leader.alike:
        return f"would pass, but {leader.candidate.name} explains more"
    if found.law:
        return "would pass, but the law explains clearly more"
    if found.too_short:
        return "passes, but too little was fitted to name it"
    if found.contradicted:
        return "passes, but recording and rig contradict each other"
    return f"accepted, tied with {', '.join(row.tied_with)}" if row.tied_with else "accepted"


def reasons(row: Ranked) -> Iterator[str]:
    """Why a candidate is not accepted; what shares beside it seem to contradict says its number."""
    share = share_removed(row)
    for reason in row.reasons:
        if reason == SHARE_REASON and share < LEAST_SHARE and isfinite(row.drop_validation):
            yield f"{reason} ({percent(share, 1)} as the mean of both sets)"
        elif reason == SHARE_REASON and share >= LEAST_SHARE:
            yield f"{reason} (less than {percent(LEAST_TRAINING)} in training)"
        elif reason == HELD_OUT_REASON and row.drop_validation > LEAST_HELD_OUT:
            yield f"{reason} (plain squared error x {number(row.plain_validation, 4)})"
        else:
            yield reason


def _blind_text(row: Ranked) -> str:
    """From which size this recording would show a candidate that it hardly shows."""
    if not isfinite(row.visible_from):
        return "this recording cannot show it"
    return f"seen here from {number(row.visible_from, 2)} times its typical size"


def imitated_text(leader: Ranked) -> list[str]:
    """What each of a tie would explain of the first of it."""
    return [
        f"if {leader.candidate.name} is the truth, {name} would explain {percent(share)} of it"
        for name, share in leader.imitated_by.items()
        if name in leader.tied_with
    ]
