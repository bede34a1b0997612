"""A recording against the rig it is said to be from, before anything is concluded from it.

Sensors first (pure noise, stuck, an uneven clock), then the rig's own plant: where it contradicts
the recording, it is asked whether it would explain the recording read in another way, channels
exchanged, in other units, or counted the other way.  A misreading must bring what is unexplained
down by a factor, in the geometric mean over the outputs that move, to be named.  That it also does
so where an effect is missing is what ``python -m studies.adversarial`` shows: nothing is said of
recordings with hidden effects, and the same ones spoiled are told for what they are.

The plant is taken as it comes, with its prior values; what it merely cannot explain is no finding
here, for an effect may be missing.  A diagnosis asks again once it has its best fit.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from workbench.consistency.common_channels import in_common
from workbench.consistency.explained import Probe, moving, probe, unexplained
from workbench.consistency.findings import Finding, Weight
from workbench.consistency.misreadings import Misreading, misreadings
from workbench.consistency.noise import untold_noise
from workbench.consistency.sensors import beyond_stops, missing, noisy, stuck, uneven_clock
from workbench.errors import InputError
from workbench.fitting.problem import staged
from workbench.fitting.window_length import moves as has_motion
from workbench.plant import Plant
from workbench.reading.table import RecordingWarning
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.units import public_name

WELL_EXPLAINED = 0.4  # of every output: no reason to ask further
SUSPECT_GAIN = 1.6  # what is unexplained as read, over the same read in another way
CERTAIN_GAIN = 2.0
CONCERNED = 3  # outputs that a misreading concerns: more do not water it down, fewer weigh less
FIRST_LOOK = 4  # windows, for all misreadings
FEWEST_WINDOWS = 3  # of a plant that moves: some misreading fits any one or two strokes better
FOLLOWED = 3  # misreadings that are looked at in all windows
EXPLAINS = 1.3  # unexplained at the most, read in another way: noise fits some way best, but none
AS_GOOD = 1.25  # another misreading that leaves no more than so many times the least is named too
STILL_MISSED = 0.9  # of every output that a misreading concerns: then it explains nothing
LEAST = 0.05  # unexplained shares below it count as this
REFUSING = "diagnose, add, improve and fit refuse this recording"

Set = tuple[Recording, ...]


def trusted(rig: Rig, *sets: Sequence[Recording]) -> tuple[tuple[Set, ...], tuple[Finding, ...]]:
    """The sets of recordings without the samples of stuck sensors, and what is doubtful in them.

    All keep the outputs and optional inputs that every one of them carries.  The first set is the
    one that a fit is made of, and takes its noise from.

    Raises
    ------
    InputError
        With everything that forbids any conclusion, or if no output is in all of them.
    """
    once = {id(each): each for group in sets for each in group}
    found = {key: _examined(rig, each) for key, each in once.items()}
    findings = [finding for _, own in found.values() for finding in own]
    findings += untold_noise(rig, [found[id(each)][0] for group in sets[:1] for each in group])
    refused = [finding.message for finding in findings if finding.weight is Weight.REFUSED]
    if refused:
        raise InputError(*refused)
    alike, left_out = in_common(rig.plant, [kept for kept, _ in found.values()])
    kept = dict(zip(found, alike, strict=True))
    return tuple(tuple(kept[id(each)] for each in group) for group in sets), (*findings, *left_out)


def checked(rig: Rig, *sets: Sequence[Recording]) -> tuple[Set, ...]:
    """The same, with a :class:`RecordingWarning` for everything that is doubtful."""
    found, findings = trusted(rig, *sets)
    for finding in findings:
        warnings.warn(str(finding), RecordingWarning, stacklevel=3)
    return found


def examined(rig: Rig, recording: Recording) -> tuple[Finding, ...]:
    """What does not fit in a recording of this rig; nothing is refused."""
    return tuple(_examined(rig, recording)[1])


def warned(rig: Rig, recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """The same beside the recording without the samples of stuck sensors, as fits have it.

    With a :class:`RecordingWarning` for each finding: numbers without it would be believed.
    """
    kept, findings = _examined(rig, recording)
    for finding in findings:
        refused = f"; {REFUSING}" if finding.weight is Weight.REFUSED else ""
        warnings.warn(f"{finding}{refused}", RecordingWarning, stacklevel=3)
    return kept, tuple(findings)


def _examined(rig: Rig, recording: Recording) -> tuple[Recording, list[Finding]]:
    """The recording without what is stuck, and the findings."""
    whole = rig.fit_for(recording)
    added = rig.added_to(whole)
    plant = staged(whole, *(candidate.member for candidate in added))
    silent = missing(plant, recording)
    recording, findings = stuck(plant, recording)
    findings += silent
    where = probe(plant, recording)
    if where is None:
        return recording, findings
    before = unexplained(plant, [recording], where)[0]
    noise = noisy(plant, recording, before)
    if noise:
        return recording, [*findings, *noise]
    moves = moving(plant, recording, where)
    if moves.any() and before[moves].max() > WELL_EXPLAINED:
        misread = _misread(plant, recording, where, before, moves)
        findings += misread or beyond_stops(plant, recording)
    return recording, [*findings, *uneven_clock(plant, recording)]


def _misread(
    plant: Plant, recording: Recording, where: Probe, before: np.ndarray, moves: np.ndarray
) -> list[Finding]:
    """The misreading that explains the recording best, if it does so by far."""
    few = len(where.firsts) < FEWEST_WINDOWS and has_motion(plant)
    ways = [] if few else misreadings(plant, recording)
    if not ways:
        return []
    some = replace(where, firsts=where.firsts[:: max(len(where.firsts) // FIRST_LOOK, 1)])
    rough = _mean(unexplained(plant, [way.undone(recording) for way in ways], some)[:, moves])
    ways = [ways[k] for k in np.argsort(rough, kind="stable")[:FOLLOWED]]
    after = unexplained(plant, [way.undone(recording) for way in ways], where)[:, moves]
    means = np.where(
        [_explains(plant, w, a, moves) for w, a in zip(ways, after, strict=True)],
        _mean(after),
        np.inf,
    )
    best = int(np.argmin(means))
    gain = _gain(before[moves], after[best])
    if gain < SUSPECT_GAIN or means[best] > EXPLAINS:
        return []
    weight = Weight.REFUSED if gain > CERTAIN_GAIN else Weight.DOUBT
    names = [public_name(name) for name, m in zip(plant.measured, moves, strict=True) if m]
    pairs = zip(names, before[moves], after[best], strict=True)
    shares = "; ".join(f"{name} {old:.2f}, {new:.2f}" for name, old, new in pairs)
    others = [
        way
        for way, mean in zip(ways, means, strict=True)
        if way is not ways[best] and mean < AS_GOOD * means[best]
    ]
    return [_finding(weight, recording, ways[best], others, shares)]


def _explains(plant: Plant, way: Misreading, after: np.ndarray, moves: np.ndarray) -> bool:
    """Whether the plant says anything of one of the outputs concerned, read that way.

    A signal read a thousand times larger is missed by no more than itself, whatever it is of.
    """
    moving_names = (name for name, m in zip(plant.measured, moves, strict=True) if m)
    own = np.array([name in way.channels for name in moving_names])
    return bool((after[own] if own.any() else after).min() < STILL_MISSED)


def _finding(
    weight: Weight, recording: Recording, way: Misreading, others: list[Misreading], shares: str
) -> Finding:
    said = [way.what, *(f"or {_in_words(each.channels)} {each.what}" for each in others)]
    what = f"{', '.join(said)}; error over motion as read, and read otherwise: {shares}"
    where = recording.source or recording.name
    return Finding(weight, where, _in_words(way.channels), what, way.remedy)


def _in_words(channels: Sequence[str]) -> str:
    """Public names of channels in a sentence."""
    return " and ".join(map(public_name, channels))


def _mean(shares: np.ndarray) -> np.ndarray:
    """Geometric mean of what is unexplained over the outputs, the last axis.

    Of many outputs a misreading concerns a few: their root is that of so many.
    """
    logarithms = np.log(np.maximum(shares, LEAST))
    return np.exp(logarithms.sum(axis=-1) / min(shares.shape[-1], CONCERNED))


def _gain(before: np.ndarray, after: np.ndarray) -> float:
    """How many times less is unexplained, as the geometric mean over three outputs.

    Where fewer move there is less evidence, and what one output gains must speak for three: a
    missing friction makes the force of a bench look ten times too large by as much as a factor of
    two, a wrong unit by far more.
    """
    gained = np.log(np.maximum(before, LEAST) / np.maximum(after, LEAST))
    return float(np.exp(gained.sum() / CONCERNED))
