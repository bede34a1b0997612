"""An improvement as text and as a document: the falling error, and the second thoughts."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING

from studies.documents import Document, diagnosis_document, errors, moved_document
from studies.plain import plain
from studies.text import columns, number, removed, spread
from studies.text_of_law import law_document, law_text
from studies.text_of_results import errors_over, moved_text, windows_text
from workbench.candidate import TOGETHER
from workbench.diagnosis.improvement import Change
from workbench.diagnosis.judge import HELD_OUT_REASON
from workbench.diagnosis.result import told
from workbench.units import public_name

if TYPE_CHECKING:
    from workbench.diagnosis.improvement import Improvement, Stage
    from workbench.diagnosis.passes import Removal, Swap
    from workbench.diagnosis.result import Diagnosis
    from workbench.fitting.errors import Errors

BROUGHT_IN = (Change.ADDED, Change.SHIFTED)
CAME, REFITTED, END = (Change.START.value, "refitted", "in the end")
UNCHANGED = "nothing is added: the rig file is as it came; `workbench fit` refits its parameters"
STOPPED = "stopped by the user: what was finished stays"
USED_UP = "no round was left, and the last one added something: improve the rig file once more"
LEFT_OUT = (
    "passes every criterion on top of what is kept, so no law is taken; it is not added: improve "
    "the rig file once more"
)
OTHERWISE = "the verdict also weighs by what the model cannot follow, no window counting too much"
LOWERED = "a row is as low as the next diagnosis fits the same model, where both errors fall"
FREE_RUNS = (
    "free runs over whole recordings (no judge where positions integrate: the right effect can "
    "make them worse until the next one is there):"
)


def improvement_text(found: Improvement, unit_of: Mapping[str, str]) -> str:
    """The falling error, what was added and thought over, errors and parameters."""
    head = ("with", "", "chi2 per sample, training", "validation")
    rows = [
        (stage.label, _change(stage), number(stage.train), number(stage.validation))
        for stage in found.budget
    ]
    parts = [columns(head, rows), *_lowered(found), ""]
    for k, diagnosis in enumerate(found.diagnoses, start=1):
        last = found.law and diagnosis is found.diagnoses[-1]
        instead = "" if last else _taken_instead(diagnosis)
        parts += [f"diagnosis {k}: {diagnosis.sentence}{instead}"]
        parts += [f"  it warned then: {warning}" for warning in found.warned_then(diagnosis)]
        parts += [each.sentence for each in found.ahead if each.after == k]
    parts += [f"warning: {warning}" for warning in found.warnings]
    parts += thoughts_text(found)
    if found.law:
        parts += ["", "nothing of the catalogue earns its place any more; taken at the end:"]
        parts += [law_text(found.law)]
    if found.parameters:
        parts += ["", errors_over(window_states(found), unit_of)]
        parts += [windows_text(found.fit, found.validation_fit)]
        if found.free_before:
            free = errors_over(free_states(found), unit_of)
            parts += ["", FREE_RUNS, free]
        parts += ["", moved_text(found.parameters)]
    parts += ["", *told] if (told := endings(found)) else []
    return "\n".join(parts)


def endings(found: Improvement) -> list[str]:
    """What is to be known of the rig file that it ends with, a sentence each."""
    told = [STOPPED] if found.stopped else []
    told += [USED_UP] if found.used_up else []
    told += [f"{found.left_out} {LEFT_OUT}"] if found.left_out else []
    told += otherwise_weighed(found)
    told += [] if found.kept else [UNCHANGED]
    for row in found.tolerated:
        size = spread(row.after, row.deviation, row.name)
        told += [f"the rig file also takes {public_name(row.name)} = {size}, which every fit may"]
    return told


def otherwise_weighed(found: Improvement) -> list[str]:
    """Where a bar of the budget rises with a step that the verdict calls no worse, or the reverse.

    Bars are weighed by sensor noise alone, verdicts also by errors that are typical of the model.
    """
    claims, told = _claims(found), []
    for before, after in pairwise(found.budget):
        claim = claims.get(_claimed(after))
        if claim is None:
            continue
        bars = (
            ("training", before.train, after.train),
            ("validation", before.validation, after.validation),
        )
        against = [
            f"{label} {'rises' if now > was else 'falls'} from {number(was)} to {number(now)}"
            for (label, was, now), less in zip(bars, claim, strict=True)
            if (now - was) * less > 0.0 and number(now) != number(was)
        ]
        if against:
            moved = " and ".join(against)
            told.append(f"{after.label}: weighed by sensor noise alone, {moved}; {OTHERWISE}")
    return told


def _claims(found: Improvement) -> dict[str, tuple[float, float]]:
    """The share of the misfit that a verdict says goes away in both sets, by a bar's label."""
    added = {f"+ {e.candidate.name}": (e.drop_train, e.drop_validation) for e in found.steps}
    swapped = {
        f"{each.rival.name} for {each.candidate.name}": (
            each.rival_train - each.share_train,
            each.rival_validation - each.share_validation,
        )
        for each in found.swaps
        if each.replaced
    }
    dropped = {
        f"- {each.candidate.name}": (-each.share_train, _held_out_without(each))
        for each in found.removals
        if each.dropped
    }
    return added | swapped | dropped


def _held_out_without(each: Removal) -> float:
    """What goes away held out without an effect; more than nothing where it helps none there."""
    return 1.0 if HELD_OUT_REASON in each.reasons else -each.share_validation


def _claimed(stage: Stage) -> str:
    """Under which label a bar's verdict stands: halves of a pair share theirs; none of a law.

    The terms of a law tell what all of them together remove.
    """
    if stage.change in BROUGHT_IN:
        return f"+ {stage.label.removeprefix('+ ').split(TOGETHER)[0]}"
    return "" if stage.change is Change.LAW else stage.label


def _lowered(found: Improvement) -> list[str]:
    """Whose fit a row of the budget may be."""
    return [LOWERED] if any(stage.change in BROUGHT_IN for stage in found.budget) else []


def _taken_instead(found: Diagnosis) -> str:
    """What came in although a law explains more: an effect of the catalogue is asked first."""
    best = next(iter(found.ranking), None)
    if found.law is None or best is None or not best.accepted:
        return ""
    return f"; {best.candidate.name} passes every criterion, and a physical effect comes first"


def window_states(found: Improvement) -> dict[str, Errors]:
    """Errors over windows by what the rig was then."""
    return {CAME: found.came, REFITTED: found.before, END: found.after}


def free_states(found: Improvement) -> dict[str, Errors]:
    """Errors of free runs by what the rig was then."""
    return {CAME: found.free_before, END: found.free_after}


def _change(stage: Stage) -> str:
    """What a step did, where its label does not say it."""
    return "" if stage.label == stage.change.value else stage.change.value


def thoughts_text(found: Improvement) -> list[str]:
    """The backward and the swap pass as tables; nothing where there was nothing to think over."""
    parts = []
    if found.removals:
        head = ("backward pass", "removes of training", "of validation", "")
        rows = [
            (
                each.candidate.name,
                removed(each.share_train),
                removed(each.share_validation),
                _stays(each),
            )
            for each in found.removals
        ]
        parts += ["", columns(head, rows)]
    if found.swaps:
        head = ("swap pass", "removes of training", "of validation", "")
        rows = [row for each in found.swaps for row in _rivals(each)]
        parts += ["", columns(head, rows)]
    return parts


def _stays(each: Removal) -> str:
    if each.dropped:
        return f"dropped: {'; '.join(each.reasons)}"
    return f"stays: {'; '.join(each.reasons)}" if each.reasons else "stays"


def _rivals(each: Swap) -> list[tuple[str, str, str, str]]:
    verdict = "takes its place" if each.replaced else "not clearly better"
    verdict = "both errors would grow" if each.leaves_more else verdict
    shares = ((each.share_train, each.share_validation), (each.rival_train, each.rival_validation))
    (a, b), (c, d) = ((removed(x), removed(y)) for x, y in shares)
    return [
        (each.candidate.name, a, b, ""),
        (f"  or {each.rival.name}", c, d, verdict),
    ]


def improvement_document(found: Improvement, unit_of: Mapping[str, str]) -> Document:
    """An improvement: what is kept, the budget, both passes, errors and parameters in SI."""
    return {
        "schema": "workbench.improvement/1",
        "rig": found.rig.name,
        "kept": list(found.kept),
        "budget": [
            {
                "with": stage.label,
                "change": stage.change.value,
                "train": plain(stage.train),
                "validation": plain(stage.validation),
            }
            for stage in found.budget
        ],
        "diagnoses": [each.sentence for each in found.diagnoses],
        "last_diagnosis": (
            diagnosis_document(found.diagnoses[-1], unit_of) if found.diagnoses else None
        ),
        "ahead": [each.sentence for each in found.ahead],
        "warnings": list(found.warnings),
        "endings": endings(found),
        "removals": [
            {
                "effect": each.candidate.name,
                "share_train": plain(told(each.share_train)),
                "share_validation": plain(told(each.share_validation)),
                "reasons": list(each.reasons),
                "dropped": each.dropped,
            }
            for each in found.removals
        ],
        "swaps": [
            {
                "effect": each.candidate.name,
                "rival": each.rival.name,
                "share_train": plain(told(each.share_train)),
                "share_validation": plain(told(each.share_validation)),
                "rival_share_train": plain(told(each.rival_train)),
                "rival_share_validation": plain(told(each.rival_validation)),
                "replaced": each.replaced,
                "leaves_more": each.leaves_more,
            }
            for each in found.swaps
        ],
        "law": law_document(found.law) if found.law else None,
        "as_it_came": errors(found.came, unit_of),
        "before": errors(found.before, unit_of),
        "after": errors(found.after, unit_of),
        "free_run": {
            "as_it_came": errors(found.free_before, unit_of),
            "after": errors(found.free_after, unit_of),
        },
        "parameters": [moved_document(row) for row in found.parameters],
        "stopped": found.stopped,
    }
