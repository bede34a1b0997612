"""How recordings are cut into windows."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from workbench.effect import Effect
from workbench.effects.timing import sent_at_s
from workbench.fitting.starts import guessed_states
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.simulation import inputs

FURTHEST_BACK = 3.0  # samples before its start to which a window is extrapolated


def window_firsts(recording: Recording, length: int) -> tuple[int, ...]:
    ends = (*recording.starts[1:], len(recording))
    return tuple(
        first
        for start, end in zip(recording.starts, ends, strict=True)
        for first in range(start, end - length + 1, length)
    )


def evenly(total: int, most: int) -> np.ndarray:
    """So many of the numbers below ``total``, evenly chosen."""
    return np.linspace(0, total - 1, most).round().astype(int)


def thinned(firsts: tuple[tuple[int, ...], ...], most: int) -> tuple[tuple[int, ...], ...]:
    """At most so many windows, evenly over all recordings."""
    total = sum(len(own) for own in firsts)
    if total <= most:
        return firsts
    kept = set(evenly(total, most).tolist())
    places = iter(range(total))
    return tuple(tuple(k for k in own if next(places) in kept) for own in firsts)


def cut_rows(rows: np.ndarray, firsts: tuple[int, ...], length: int) -> np.ndarray:
    """Rows (n, samples) cut into (n, n_windows, L)."""
    return (
        np.stack([rows[:, k : k + length] for k in firsts], axis=1)
        if firsts
        else np.zeros((rows.shape[0], 0, length))
    )


def variances(cut: np.ndarray) -> np.ndarray:
    """Variance of what was recorded in each window, 0 without any, (n_y, n_windows)."""
    seen = np.isfinite(cut)
    count = np.maximum(seen.sum(axis=2), 1)
    mean = np.where(seen, cut, 0.0).sum(axis=2) / count
    return (np.where(seen, cut - mean[:, :, None], 0.0) ** 2).sum(axis=2) / count


def in_time(effect: Effect) -> bool:
    """True for a cause that acts on the sampled commands: delay, pause."""
    return type(effect).resample is not Effect.resample


def causes_in_time(plant: Plant) -> tuple[Effect, ...]:
    """Those that are there, with their values."""
    return tuple(each for each in plant.effects if in_time(each) and not each.absent)


def cut_inputs(
    plant: Plant,
    recordings: tuple[Recording, ...],
    firsts: tuple[tuple[int, ...], ...],
    length: int,
) -> tuple[np.ndarray, np.ndarray]:
    pairs = [inputs(plant, recording) for recording in recordings]
    cut = (
        np.concatenate(
            [cut_rows(pair[k], own, length) for pair, own in zip(pairs, firsts, strict=True)],
            axis=1,
        )
        for k in (0, 1)
    )
    u, d = (rows.reshape(rows.shape[0], rows.shape[1] * length) for rows in cut)
    return u, d


def begun_s(recordings: Sequence[Recording], firsts: tuple[tuple[int, ...], ...]) -> np.ndarray:
    """Time of each window's first sample from the start of its piece, shape (n_windows,)."""
    return np.concatenate([_begun_s(*each) for each in zip(recordings, firsts, strict=True)])


def _begun_s(recording: Recording, firsts: tuple[int, ...]) -> np.ndarray:
    starts, own = np.array(recording.starts), np.array(firsts, dtype=int)
    return recording.sample_time_s * (own - starts[np.searchsorted(starts, own, "right") - 1])


def received_windows(
    plant: Plant, outputs: np.ndarray, begun_s: np.ndarray, sample_time_s: float
) -> np.ndarray:
    """Outputs (n_y, n_windows, L) as the computer gets them through the causes in time.

    ``begun_s``, shape (n_windows,), is when windows begin.  What was sent shortly before a window
    is extrapolated from its first two samples.
    """
    length = outputs.shape[2]
    begin_s = begun_s[:, None]
    time_s = begin_s + sample_time_s * np.arange(length)
    found = outputs.copy()
    for row, name in enumerate(plant.measured):
        sent_s = sent_at_s(plant.members, name, time_s)
        if sent_s is time_s:
            continue
        place = np.maximum((sent_s - begin_s) / sample_time_s, -FURTHEST_BACK)
        older = np.clip(np.floor(place + 1e-9), 0, length - 2).astype(int)
        before, after = (np.take_along_axis(outputs[row], older + k, axis=1) for k in (0, 1))
        found[row] = before + (place - older) * (after - before)
    return found


def window_starts(
    plant: Plant,
    recordings: tuple[Recording, ...],
    firsts: tuple[tuple[int, ...], ...],
    noise: np.ndarray,
    known: Collection[str] = (),
) -> tuple[np.ndarray, np.ndarray]:
    """Start states and their standard deviations, shapes (n_x, n_windows).

    The guess of a state that is recorded is no better than the noise ``noise``, shape (n_y,).
    States that are ``known`` already are guessed roughly: the caller has better.
    """
    columns = [
        guessed_states(plant, recording, known)[:, :, list(own)]
        for recording, own in zip(recordings, firsts, strict=True)
    ]
    guess, deviation = np.concatenate(columns, axis=2)
    states = list(plant.state_list)
    for name, sigma in zip(plant.measured, noise, strict=True):
        if name in states:
            row = states.index(name)
            deviation[row] = np.hypot(deviation[row], sigma)
    return guess, deviation
