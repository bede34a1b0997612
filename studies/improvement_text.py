"""An improvement as text and as a document: the falling error, and the second thoughts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from studies.documents import Document, diagnosis_document, errors, moved_document
from studies.plain import plain
from studies.text import columns, number, removed, spread
from studies.text_of_law import law_document, law_text
from studies.text_of_results import errors_over, moved_text, windows_text
from workbench.diagnosis.improvement import Change
from workbench.diagnosis.result import told
from workbench.units import public_name

if TYPE_CHECKING:
    from workbench.diagnosis.improvement import Improvement, Stage
    from workbench.diagnosis.passes import Removal, Swap
    from workbench.diagnosis.result import Diagnosis
    from workbench.fitting.errors import Errors

CAME, REFITTED, END = (Change.START.value, "refitted", "in the end")
UNCHANGED = "nothing is added: the rig file is as it came; `workbench fit` refits its parameters"
STOPPED = "stopped by the user: what was finished stays"
USED_UP = "no round was left, and the last one added something: improve the rig file once more"
LEFT_OUT = (
    "passes every criterion on top of what is kept, so no law is taken; it is not added: improve "
    "the rig file once more"
)
LOWERED = "each row as low as the next diagnosis fits the same model"
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
        parts += [f"diagnosis {k}: {diagnosis.sentence}{_taken_instead(diagnosis)}"]
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
    told += [] if found.kept else [UNCHANGED]
    for row in found.tolerated:
        size = spread(row.after, row.deviation, row.name)
        told += [f"the rig file also takes {public_name(row.name)} = {size}, which every fit may"]
    return told


def _lowered(found: Improvement) -> list[str]:
    """Whose fit a row of the budget may be."""
    return [LOWERED] if any(stage.change is Change.ADDED for stage in found.budget) else []


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
