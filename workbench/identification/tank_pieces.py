"""A tank curve as recorded: the valve closed, then one constant command until the tank rests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError, Message
from workbench.fitting.starts import guessed_states
from workbench.identification.result import unfit
from workbench.identification.tank import TankOnValve, rests_at, steady_supply
from workbench.recording import Recording

STEADY_V = 0.02  # a command that stays within is constant
LEAST_LEAD = 5  # samples with the valve still closed
LEAD_S = 0.1  # before the opening: so far back a straight line is taken through the pressure
ROUNDED = 1e-9  # of a pressure, over a lead: less drift is rounding, where there is no noise
DRIFTS = 0.05  # chance at which noise alone would slope as much: below, it is a drift
LEAST_SAMPLES = 30
CLEARLY_V = 0.2  # that far outside the dead zone a path is open
LEAST_RISE = 0.1  # of supply minus ambient, with an open path
RESTING = 0.002  # of the same, within the last fifth: the tank has come to rest
RESTS = 0.02  # of the way: from where on a curve is logged for as long again
LEAST_OPEN = 3  # commands with one path open: its size, its shape and the curve of its area
APART_V = 0.1  # commands closer than that tell the same


@dataclass(frozen=True)
class Piece:
    """One curve as recorded, from the opening on, and where its states began."""

    recording: Recording
    command_v: float
    charging: bool
    is_open: bool
    start: np.ndarray


def tank_pieces(tank: TankOnValve, recordings: Sequence[Recording]) -> list[Piece]:
    """Every piece of every recording as a curve.

    Raises
    ------
    InputError
        If a piece is no curve, or neither path is open in enough of them.
    """
    found = [_piece(tank, piece) for each in recordings for piece in each.pieces]
    counts = [len(open_sides(found, side)) for side in (True, False)]
    if max(open_commands(found, side) for side in (True, False)) < LEAST_OPEN:
        what = f"{counts[0]} charging and {counts[1]} discharging curves give no flow parameters"
        source = ", ".join(dict.fromkeys(each.source or each.name for each in recordings))
        expected = f"{LEAST_OPEN} or more on one side at different commands, "
        expected += f"{CLEARLY_V:g} V or more off the dead zone"
        raise InputError(Message(what, expected=expected, file=source))
    return found


def open_sides(pieces: Sequence[Piece], charging: bool) -> list[Piece]:
    """The curves of one side whose path is open."""
    return [each for each in pieces if each.charging == charging and each.is_open]


def open_commands(pieces: Sequence[Piece], charging: bool) -> int:
    """At how many different commands the path of one side is open."""
    sent_v = sorted(each.command_v for each in open_sides(pieces, charging))
    return sum(not k or v - sent_v[k - 1] > APART_V for k, v in enumerate(sent_v))


def _piece(tank: TankOnValve, recording: Recording) -> Piece:
    """A curve from its opening on, cut where the pressure has rested as long as it moved."""
    plant = tank.plant
    steady_supply(recording)
    opened, command_v = _opening(tank, recording)
    rest = recording.part(opened, len(recording))
    own = plant.values
    centre_v, half_v = own[f"{tank.zone}.centre_v"], own[f"{tank.zone}.half_width_v"]
    charging = command_v >= centre_v
    is_open = abs(command_v - centre_v) > half_v + CLEARLY_V
    lead = recording.part(0, max(opened, LEAST_LEAD))
    before_pa = lead[plant.measured[0]]
    never_pa = float(np.mean(before_pa))  # where it stays closed the curve begins with the lead
    start_pa = _at_the_opening(before_pa, lead.sample_time_s) if opened else never_pa
    if is_open:
        _check_open(tank, rest, start_pa, charging)
    pressure = rest[plant.measured[0]]
    moved = np.abs(pressure - pressure[-1]) > RESTS * abs(pressure[-1] - start_pa)
    length = max(2 * int(np.flatnonzero(moved)[-1] + 1) if moved.any() else 0, LEAST_SAMPLES)
    cut = rest.part(0, min(length, len(rest)))
    return Piece(cut, command_v, charging, is_open, _start(tank, lead, start_pa))


def _opening(tank: TankOnValve, recording: Recording) -> tuple[int, float]:
    """The sample at which the valve is opened, and the command from there on."""
    signal, own = tank.plant.commands[0], tank.plant.values
    command = recording[signal.name]
    centre_v, half_v = own[f"{tank.zone}.centre_v"], own[f"{tank.zone}.half_width_v"]
    jumps = np.flatnonzero(np.abs(command - command[0]) > STEADY_V)
    opened = int(jumps[0]) if len(jumps) else 0
    expected = f"the valve closed for {LEAST_LEAD} samples, then one constant command"
    closed = abs(float(command[0]) - centre_v) < half_v + CLEARLY_V
    if not closed or (len(jumps) and opened < LEAST_LEAD):
        what = f"is no tank curve: it does not begin with the valve closed, at {command[0]:.3g} V"
        raise unfit(recording, what, expected)
    sent = command[opened:]
    if np.ptp(sent) > STEADY_V:
        what = f"is no tank curve: the command changes again, by {np.ptp(sent):.3g} V"
        raise unfit(recording, what, expected)
    if len(sent) < LEAST_SAMPLES:
        raise unfit(recording, f"is no tank curve: {len(sent)} samples", f"{LEAST_SAMPLES} or more")
    return opened, float(np.median(sent))


def _at_the_opening(lead_pa: np.ndarray, sample_time_s: float) -> float:
    """The pressure one sample after a lead, (n,): its mean, or on its line where it drifts.

    A closed valve leaks: within a tenth of a second a small tank is several noise deviations off
    the mean of the lead, and what a curve begins with too low its path has to make up for.
    """
    from scipy.special import stdtrit  # Student's quantile; loaded where it is asked

    near = lead_pa[-max(round(LEAD_S / sample_time_s), LEAST_LEAD) :]
    before = np.arange(len(near)) - len(near)
    (slope, end_pa), covariance = np.polyfit(before, near, 1, cov=True)
    clear = stdtrit(len(near) - 2, 1.0 - DRIFTS / 2.0)
    rounded = ROUNDED * np.abs(near).max() / len(near)
    drifts = abs(slope) > max(clear * np.sqrt(covariance[0, 0]), rounded)
    return float(end_pa if drifts else near.mean())


def _check_open(tank: TankOnValve, rest: Recording, start_pa: float, charging: bool) -> None:
    """An open path charges or empties the tank, and the tank rests where the rig says."""
    pressure, span_pa = rest[tank.plant.measured[0]], tank.span_pa(rest)
    n = max(len(pressure) // 10, 1)
    before_pa, end_pa = float(pressure[-2 * n : -n].mean()), float(pressure[-n:].mean())
    gone_pa = (end_pa - start_pa) if charging else (start_pa - end_pa)
    if gone_pa < LEAST_RISE * span_pa:
        word, start = ("charged", "ambient") if charging else ("emptied", "full")
        what = (
            f"the tank is never {word}: it goes from {start_pa / 1e5:.3g} to {end_pa / 1e5:.3g} bar"
        )
        raise unfit(rest, what, f"it to begin {start} and the valve to open at this command")
    if abs(end_pa - before_pa) < RESTING * span_pa:
        rests_at(tank, rest, end_pa, charging)


def _start(tank: TankOnValve, lead: Recording, start_pa: float) -> np.ndarray:
    """The states at the opening: what the lead shows, at the pressure that it ends with."""
    plant = tank.plant
    guess, states = guessed_states(plant, lead)[0, :, 0], list(plant.state_list)
    at = states.index(plant.measured[0])
    scaled = guess * np.where(["mass" in name for name in states], start_pa / guess[at], 1.0)
    scaled[at] = start_pa
    return scaled
