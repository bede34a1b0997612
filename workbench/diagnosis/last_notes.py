"""Notes in the rig file after the second thoughts on what was added.

A note is of the round in which an effect came in: its shares are those of the model of then, and of
a pair they are those of both.  In the end the backward pass has asked each against all else, what
came in together may stand alone, and the swap pass may have told apart what the round did not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import isfinite

from workbench.diagnosis.addition import Addition, alike_text, falls, noted
from workbench.diagnosis.passes import Kept, Removal, Swap


def with_last_notes(
    kept: Kept, began: Sequence[Addition], removals: Sequence[Removal], swaps: Sequence[Swap] = ()
) -> Kept:
    """What is kept, each with what it removes when asked again, and with no partner that is gone.

    ``began`` is all that came in, in its rounds; ``swaps`` are rivals tried in its place.
    """
    asked = {each.candidate.name: each for each in removals if not each.dropped}
    steps = []
    for step in kept.steps:
        partner = next((s for s in began if s is not step and s.fit is step.fit), None)
        alone = partner is not None and partner.candidate.name not in kept.names
        note = _last_note(step, alone, asked.get(step.candidate.name))
        apart = {*kept.names, *_told_apart(step, swaps)}
        alike = [name for name in step.alike if not alone and name not in apart]
        steps.append(noted(step, f"{note}{alike_text(alike)}"))
    return replace(kept, steps=tuple(steps))


def _told_apart(step: Addition, swaps: Sequence[Swap]) -> Iterator[str]:
    """Rivals that leave clearly more in its place, by fits of their own and not of its round."""
    for each in swaps:
        anew = each.share_train != step.drop_train
        if each.candidate.name == step.candidate.name and anew and each.clearly_worse:
            yield each.rival.name


def _last_note(step: Addition, alone: bool, asked: Removal | None) -> str:
    """The note of one but for what is alike.

    What another needs was not taken out, and has no share of its own; neither has what stays
    though the held-out recording refuses it.
    """
    name, note = step.candidate.name, step.rig.notes[-1].removesuffix(alike_text(step.alike))
    then = falls(step.drop_train, step.drop_validation, step.evidence)
    now = ""
    if asked is not None and isfinite(asked.share_train):
        now = falls(asked.share_train, asked.share_validation, step.evidence)
    if alone:
        return f"{name}: {now}" if now else f"{name}: with another, which went again, {then}"
    if now in ("", then):
        return note
    return f"{note}; on top of all else in the backward pass {now.removeprefix('weighted misfit ')}"
