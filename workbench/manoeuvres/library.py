"""The library of manoeuvres.  A new one is a function of limits and share, and a line in LIBRARY.

Source: diagnosis.md 1.8.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from workbench.manoeuvres.limits import Drive, Limits
from workbench.manoeuvres.play import (
    LEAD_S,
    Manoeuvre,
    Play,
    commanded,
    followed,
    levels,
    odd_multisine,
    opened,
    random,
    zigzag,
)

REST_S = 0.5  # before a ramp, which begins where the command rests
OFF_S = 0.05  # before anything is switched on: of a shift under way nobody knows since when
BEYOND = 0.1  # of what was recorded: how far a reference goes beyond a stop

# Positions, through a position loop.


def position_steps(limits: Limits, share: float, dwell_s: float) -> Play:
    """Random places, each move as fast as the axes were recorded."""
    time_s = limits.time_s
    places = random().uniform(0.0, 1.0, int(time_s[-1] / dwell_s) + 1)
    return followed(limits, levels(time_s, places, dwell_s, _move_s(limits)), share)


def position_triangle(limits: Limits, share: float, period_s: float) -> Play:
    """There and back at one speed, in a longer time where the axes were recorded slower."""
    slowest = max(period_s, 2.0 * _move_s(limits))
    phase = np.maximum(limits.time_s - LEAD_S, 0.0) / slowest
    play = followed(limits, zigzag(phase), share)
    words = f"a triangle as fast as was recorded, {slowest:.2g} s there and back"
    return replace(play, words=words) if slowest > period_s else play


def position_multisine(limits: Limits, share: float) -> Play:
    """A small odd multisine about the middle."""
    return followed(limits, 0.5 + 0.2 * odd_multisine(limits.time_s, 0.3, 8), share)


def three_holds(limits: Limits, share: float) -> Play:
    """Rest at three places in turn."""
    places, dwell_s = np.array([0.15, 0.5, 0.85]), limits.time_s[-1] / 3.0
    return followed(limits, levels(limits.time_s, places, dwell_s, 2.0 * _move_s(limits)), share)


def shut_and_wait(limits: Limits, share: float) -> Play:
    """Go to a place, then give the resting command and wait; twice.

    While it waits there is no reference: a loop that still acted would hide what drifts.
    """
    time_s = limits.time_s
    half_s = time_s[-1] / 2.0
    place = levels(time_s, np.array([0.3, 0.7]), half_s, _move_s(limits))
    play = followed(limits, place, share)
    waits = time_s % half_s > LEAD_S + 2.0 * _move_s(limits)
    return replace(
        play,
        commands=np.where(waits, opened(limits, 0.0 * time_s), play.commands),
        reference=np.where(waits, np.nan, play.reference),
    )


def _move_s(limits: Limits) -> float:
    """Time of a half-cosine move over all that was recorded at no more than its speed."""
    spans = [(a.high - a.low) / max(a.speed, 1e-9) for a in limits.axes]
    return max(0.5 * np.pi * max(spans), 0.05)


def slowly_to_both_ends(limits: Limits, share: float) -> Play:
    """Against one stop, then against the other: there the loop fills one chamber, vents the other.

    The reference goes a little beyond the stops; ``share`` makes it slower.
    """
    time_s = limits.time_s
    third_s = time_s[-1] / 3.0
    move_s = min(0.4 / share, 0.95) * third_s
    places = []
    for axis in limits.axes:
        span = axis.high - axis.low
        ends = [np.clip(end, axis.low, axis.high) if np.isinf(end) else end for end in axis.stops]
        low, high = ((end - axis.low) / span for end in ends)
        beyond = BEYOND * np.isfinite(axis.stops[1] - axis.stops[0])
        turns = np.array([0.5, high + beyond, low - beyond, 0.5])
        places.append(levels(time_s + 0.8 * third_s, turns, third_s, move_s))
    return followed(limits, np.array(places), 1.0)


# Commands, where nothing runs into a stop, or is meant to.


def end_to_end(limits: Limits, share: float, size: float) -> Play:
    """From one end to the other and wait there: a chamber is filled, the other one vented."""
    return commanded(limits, share * size * np.where(limits.time_s % 5.0 < 2.5, 1.0, -1.0))


def command_ramp(limits: Limits, share: float, size: float) -> Play:
    """Rest, then a slow triangle of the command through its centre and back, twice."""
    time_s = limits.time_s
    phase = 2.0 * np.maximum(time_s - REST_S, 0.0) / (time_s[-1] - REST_S)
    return commanded(limits, share * size * (2.0 * zigzag(0.25 + phase) - 1.0))


def command_steps(limits: Limits, share: float, dwell_s: float) -> Play:
    """Random commands."""
    steps = random().uniform(-1.0, 1.0, int(limits.time_s[-1] / dwell_s) + 1)
    return commanded(limits, share * steps[(limits.time_s / dwell_s).astype(int)])


def command_multisine(limits: Limits, share: float, size: float) -> Play:
    """An odd multisine about the resting command."""
    return commanded(limits, share * size * odd_multisine(limits.time_s, 0.3, 8))


def fill_and_hold(limits: Limits, share: float) -> Play:
    """Fill for a tenth of the time and shut, vent as long and shut: a second each of ten."""
    tenths = 10.0 * limits.time_s / (limits.sample_time_s * limits.samples)
    fills, vents = (tenths > 0.5) & (tenths < 1.5), (tenths > 6.0) & (tenths < 7.0)
    return commanded(limits, share * (1.0 * fills - 1.0 * vents))


def fill_in_parts(limits: Limits, share: float) -> Play:
    """Short pulses up and then down, with a rest behind each: holds at several pressures."""
    time_s = limits.time_s
    pulses = time_s % 1.0 < 0.1
    return commanded(limits, share * pulses * np.where(time_s < time_s[-1] / 2.0, 1.0, -1.0))


# Switched commands.


def switched_steps(limits: Limits, share: float, dwell_s: float) -> Play:
    """Random patterns of on and off; ``share`` makes them slower."""
    numbers = random().integers(0, 2, (len(limits.commands), 1 + int(limits.time_s[-1] / dwell_s)))
    return _switched(limits, numbers[:, (share * limits.time_s / dwell_s).astype(int)])


def one_by_one(limits: Limits, share: float) -> Play:
    """All off, then each on alone, then all on, all off: fill, dwell and vent of every volume."""
    n_u = len(limits.commands)
    patterns = np.vstack([np.zeros(n_u), np.eye(n_u), np.ones(n_u), np.zeros(n_u)]).T
    place = (limits.time_s / (limits.time_s[-1] * (1 + 1e-9)) * patterns.shape[1]).astype(int)
    return _switched(limits, patterns[:, place])


def pulses(limits: Limits, share: float) -> Play:
    """Pulses from 5 to 100 ms in turn: volumes filled in parts, with a rest behind each."""
    second, n_u = limits.time_s.astype(int), len(limits.commands)
    widths_s = share * np.geomspace(0.005, 0.1, 10)
    on = (limits.time_s % 1.0) < widths_s[second % 10]
    rows = [on & (second % n_u == k) for k in range(n_u)]
    return _switched(limits, np.array(rows, dtype=float))


def _switched(limits: Limits, patterns: np.ndarray) -> Play:
    """Patterns of 0 and 1, (n_u, n), as the levels of each command, after a moment all off."""
    later = min(round(OFF_S / limits.sample_time_s), limits.samples)
    off = np.zeros((len(patterns), later))
    patterns = np.hstack([off, patterns])[:, : limits.samples]
    rows = [
        np.where(row > 0.5, max(s.levels or (s.upper,)), min(s.levels or (s.lower,)))
        for s, row in zip(limits.commands, patterns, strict=True)
    ]
    return Play(np.array(rows), np.zeros((0, limits.samples)))


P, V, S = Drive.POSITION, Drive.PRESSURE, Drive.SWITCHED
LIBRARY = (
    Manoeuvre("fast steps between random places", P, partial(position_steps, dwell_s=1.0)),
    Manoeuvre("fast steps with long rests", P, partial(position_steps, dwell_s=2.5)),
    Manoeuvre("a slow triangle, 9 s there and back", P, partial(position_triangle, period_s=9.0)),
    Manoeuvre("a triangle, 3 s there and back", P, partial(position_triangle, period_s=3.0)),
    Manoeuvre("a fast triangle, 1 s there and back", P, partial(position_triangle, period_s=1.0)),
    Manoeuvre("a small odd multisine about the middle", P, position_multisine),
    Manoeuvre("holds at three places", P, three_holds),
    Manoeuvre("stop, shut the valve and wait, at two places", P, shut_and_wait),
    Manoeuvre("slowly against both ends, with rests there", P, slowly_to_both_ends, ends=True),
    Manoeuvre("to both ends, with rests there", P, partial(end_to_end, size=0.5), ends=True),
    Manoeuvre(
        "a slow ramp of the command from end to end", P, partial(command_ramp, size=0.2), ends=True
    ),
    Manoeuvre("random steps of the command", V, partial(command_steps, dwell_s=0.5)),
    Manoeuvre("random steps of the command, with rests", V, partial(command_steps, dwell_s=2.0)),
    Manoeuvre("a slow ramp of the command through its centre", V, partial(command_ramp, size=1.0)),
    Manoeuvre("a slow ramp of small commands", V, partial(command_ramp, size=0.2)),
    Manoeuvre("a small odd multisine of the command", V, partial(command_multisine, size=0.3)),
    Manoeuvre("fill, shut and wait, vent, shut and wait", V, fill_and_hold),
    Manoeuvre("full fill and dwell, full exhaust and dwell", V, partial(end_to_end, size=1.0)),
    Manoeuvre("fill in parts and vent in parts, with rests", V, fill_in_parts),
    Manoeuvre("random switching", S, partial(switched_steps, dwell_s=0.4)),
    Manoeuvre("random switching, with rests", S, partial(switched_steps, dwell_s=1.2)),
    Manoeuvre("one valve after the other, with rests", S, one_by_one),
    Manoeuvre("single pulses of growing length", S, pulses),
)
