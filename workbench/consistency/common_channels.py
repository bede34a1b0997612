"""Recordings of one call that carry different channels are taken with those that all have.

Windows of all recordings share one simulation, so they share its outputs and its measured inputs.
What only some have is left out with a word, whichever of them comes first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from workbench.consistency.findings import Finding, Weight
from workbench.errors import InputError, Message, listed
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.units import public_name


def in_common(
    plant: Plant, recordings: Sequence[Recording]
) -> tuple[tuple[Recording, ...], list[Finding]]:
    """The recordings without the outputs and optional inputs that another lacks, and what is so.

    Raises
    ------
    InputError
        If no output is in all of them.
    """
    outputs = (*plant.measured, *plant.optional_outputs)
    optional = (*outputs, *(signal.name for signal in plant.optional_inputs))
    partly = [name for name in optional if _some(name, recordings) and not _all(name, recordings)]
    if not any(_all(name, recordings) for name in outputs):
        have = "; ".join(f"{r.name} has {listed(_carried(outputs, r))}" for r in recordings)
        raise InputError(Message(f"no output is in all recordings: {have}"))
    findings = [_left_out(name, recordings) for name in partly]
    return tuple(_without(partly, each) for each in recordings), findings


def _some(name: str, recordings: Sequence[Recording]) -> bool:
    return any(name in each.channels for each in recordings)


def _all(name: str, recordings: Sequence[Recording]) -> bool:
    return all(name in each.channels for each in recordings)


def _carried(names: Sequence[str], recording: Recording) -> list[str]:
    return [public_name(name) for name in names if name in recording.channels]


def _left_out(name: str, recordings: Sequence[Recording]) -> Finding:
    has = next(each for each in recordings if name in each.channels)
    lacks = [each.name for each in recordings if name not in each.channels]
    what = f"is left out, since {listed(lacks)} {'lack' if len(lacks) > 1 else 'lacks'} it"
    remedy = "what all recordings carry is used"
    return Finding(Weight.NOTICE, has.source or has.name, public_name(name), what, remedy)


def _without(names: Sequence[str], recording: Recording) -> Recording:
    if not any(name in recording.channels for name in names):
        return recording
    kept = {name: values for name, values in recording.channels.items() if name not in names}
    return replace(recording, channels=kept)
