"""S002-1: flow parameters per path and command from charging and discharging curves of a tank.

The valve is opened at one command from closed, and the pressure of the tank is logged until it
rests.  For each command area, critical ratio b, cracking ratio a and subsonic index m of

    mdot = A C_d C_chk p_u / sqrt(T_u) psi(p_d / p_u; b, a, m)

are fitted to the curve with the rig's own plant at full command, whose path of that side then has
the area A(u); the plant's leak, heat flow and volume act beside it.  A dead time stands for valve
and sensor.  b, a and m lean on the rig's values within the range of table values, since a
curve that rests early says little of them.

The rig's own parameters, far fewer, are then fitted to all curves at once.  Find the dead zone
first: the leak of the closed spool, which the rig must know, comes from there and acts on every
curve.

Source: paper 002 4.1, Eqs. 1 to 3, Figs. 7 to 10, 17 (arguments and branches by errata E002-1 to
E002-4, which the flow law of the plant has); physics.md 5, row S002-1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.effects import DeadZone, FivePortValve
from workbench.errors import InputError, Message
from workbench.fitting.noise import measured_noise
from workbench.fitting.starts import guessed_states
from workbench.identification.least_squares import Solution, Unknown, solve
from workbench.identification.result import (
    Curve,
    Estimate,
    Identified,
    Procedure,
    complete,
    estimated,
    unfit,
)
from workbench.identification.runs import outputs_under
from workbench.parts import Body
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig

STEADY_V = 0.02  # a command that stays within is constant
LEAST_LEAD = 5  # samples with the valve still closed
LEAST_SAMPLES = 30
LEAN = {"b": 0.15, "a": 0.02, "m": 0.15}  # how far b, a and m of a curve lie from the rig's
RESTS = 0.02  # of the way: from where on a curve is logged for as long again
LONGEST_DEAD_TIME_S = 0.02
TYPICAL_ERROR_PA = 4e3  # 0.04 bar, what the paper reports


@dataclass(frozen=True, kw_only=True)
class TankCurve(Curve):
    """One curve: pressure over time from the opening on.

    ``area_m2`` is the effective area C_d A(u); all are estimates with their deviations.
    """

    command_v: float
    charging: bool
    area_m2: Estimate
    critical_ratio: Estimate
    cracking_ratio: Estimate
    subsonic_index: Estimate


@dataclass(frozen=True, kw_only=True)
class FlowFit(Identified):
    """Flow parameters per path and command, and the errors that the rig's few parameters leave.

    ``rig_errors_pa`` is the MAE of each curve with the improved rig, in the order of ``curves``.
    """

    curves: tuple[TankCurve, ...]
    rig_errors_pa: tuple[float, ...]


@dataclass(frozen=True)
class _Piece:
    """One curve as recorded, from the opening on, and where its pressure began."""

    recording: Recording
    command_v: float
    charging: bool
    start: np.ndarray


@dataclass(frozen=True)
class _Names:
    """Full names of the parameters of valve and dead zone."""

    valve: str
    zone: str

    def shape(self, charging: bool) -> list[str]:
        """Area, b, a and m of a path."""
        side = "supply" if charging else "exhaust"
        keys = (f"{side}_fraction", f"{side}_critical_ratio", "cracking_ratio", "subsonic_index")
        return [f"{self.valve}.{key}" for key in keys]

    @property
    def common(self) -> list[str]:
        """The rig's own parameters that all curves share."""
        zone = [f"{self.zone}.{key}" for key in ("centre_v", "half_width_v")]
        valve = [f"{self.valve}.area_exponent", *self.shape(True), *self.shape(False)[:2]]
        return [*zone, *valve]


def tank_curves(
    rig: Rig, recordings: Sequence[Recording], progress: Callable[[str], None] = lambda said: None
) -> FlowFit:
    """Flow parameters of every curve, and those of the rig.

    Each piece of a recording is one curve.  ``progress`` hears of every curve.

    Raises
    ------
    InputError
        If the plant is no tank behind a valve, or a piece is no curve: valve closed, then one
        constant command.
    """
    complete(recordings)
    plant = _tank(rig, recordings[0])
    pieces = [_piece(plant, piece) for each in recordings for piece in each.pieces]
    names = _names(plant)
    noise = measured_noise(recordings, plant.measured)[plant.measured[0]]
    curves = []
    for k, piece in enumerate(pieces, start=1):
        progress(f"curve {k} of {len(pieces)}, {piece.command_v:.2f} V")
        curves.append(_curve(plant, names, piece, noise))
    progress("all curves at once")
    common = _common(rig, plant, names, pieces)
    ends = np.cumsum([len(piece.recording) for piece in pieces])[:-1]
    return FlowFit(
        rig=rig,
        estimates=(_mean_error(curves),),
        parameters=estimated(names.common, common.values[:-1], common.deviations[:-1]),
        curves=tuple(curves),
        rig_errors_pa=tuple(
            float(np.mean(np.abs(left))) for left in np.split(common.residuals, ends)
        ),
    )


def _mean_error(curves: list[TankCurve]) -> Estimate:
    errors = [curve.mean_absolute_error for curve in curves]
    return Estimate("mean_error_pa", float(np.mean(errors)), float(np.std(errors)))


def _tank(rig: Rig, recording: Recording) -> Plant:
    """The plant, if it is a tank behind a valve with a dead zone."""
    zones = [e.name for e in rig.plant.effects if isinstance(e, DeadZone)]
    valves = [e for e in rig.plant.effects if isinstance(e, FivePortValve)]
    if not (zones and valves) or any(isinstance(part, Body) for part in rig.plant.parts):
        what = "is no tank behind a valve with a dead zone"
        raise InputError(Message(what, rig.plant.name, "a rig of servo_reservoir"))
    return rig.fit_for(recording).lean(keep=zones)


def _names(plant: Plant) -> _Names:
    valve, zone = (
        next(e.name for e in plant.effects if isinstance(e, kind))
        for kind in (FivePortValve, DeadZone)
    )
    return _Names(valve, zone)


def _piece(plant: Plant, recording: Recording) -> _Piece:
    """A curve from its opening on, cut where the pressure has rested as long as it moved."""
    command, pressure = recording[plant.commands[0].name], recording[plant.measured[0]]
    jumps = np.flatnonzero(np.abs(command - command[0]) > STEADY_V)
    expected = f"the valve closed for {LEAST_LEAD} samples, then one constant command"
    opened = int(jumps[0]) if len(jumps) else 0
    closed_all_along = not len(jumps) and abs(command[0] - plant.commands[0].nominal) < 1.0
    if opened < LEAST_LEAD and not closed_all_along:
        raise unfit(
            recording, "is no tank curve: it does not begin with the valve closed", expected
        )
    rest = recording.part(opened, len(recording))
    sent = rest[plant.commands[0].name]
    if np.ptp(sent) > STEADY_V:
        what = f"is no tank curve: the command changes again, by {np.ptp(sent):.3g} V"
        raise unfit(recording, what, expected)
    if len(rest) < LEAST_SAMPLES:
        raise unfit(recording, f"is no tank curve: {len(rest)} samples", f"{LEAST_SAMPLES} or more")
    command_v = float(np.median(sent))
    lead = recording.part(0, max(opened, LEAST_LEAD))
    start = guessed_states(plant, lead)[0, :, 0]
    states = list(plant.state_list)
    begun = start[states.index(plant.measured[0])]
    start_pa = float(np.mean(lead[plant.measured[0]]))
    scaled = start * np.where(["mass" in name for name in states], start_pa / begun, 1.0)
    scaled[states.index(plant.measured[0])] = start_pa
    moved = np.abs(pressure[opened:] - pressure[-1]) > RESTS * abs(pressure[-1] - start_pa)
    length = max(2 * int(np.flatnonzero(moved)[-1] + 1) if moved.any() else 0, LEAST_SAMPLES)
    centre_v = plant.values[f"{_names(plant).zone}.centre_v"]
    return _Piece(rest.part(0, min(length, len(rest))), command_v, command_v >= centre_v, scaled)


def _delayed(values: np.ndarray, time_s: np.ndarray, dead_time_s: float) -> np.ndarray:
    return np.interp(time_s - dead_time_s, time_s, values)


def _curve(plant: Plant, names: _Names, piece: _Piece, noise: float) -> TankCurve:
    """Area, b, a and m of one curve, the plant at full command of its side."""
    shape, recording = names.shape(piece.charging), piece.recording
    signal, channel = plant.commands[0], plant.measured[0]
    full_v = signal.upper if piece.charging else signal.lower
    opened = {**recording.channels, signal.name: np.full(len(recording), full_v)}
    at_full = Recording(recording.name, recording.sample_time_s, opened)
    run = outputs_under(plant, at_full, shape)
    measured, time_s = recording[channel], recording.time_s
    known, own = plant.parameters, plant.values
    share = abs(piece.command_v - signal.nominal) / abs(full_v - signal.nominal)
    unknowns = [Unknown(own[shape[0]] * min(1.6 * share, 1.0) + 1e-4, 0.2, 0.0)]
    unknowns += [
        Unknown(own[name], lean, known[name].lower, known[name].upper, lean)
        for name, lean in zip(shape[1:], LEAN.values(), strict=True)
    ]
    unknowns.append(Unknown(3e-3, 3e-3, 0.0, LONGEST_DEAD_TIME_S))
    found = solve(
        lambda x: measured - _delayed(run(x[:4], piece.start)[0], time_s, x[4]), unknowns, noise
    )
    full_m2 = own[f"{names.valve}.flow_area_m2"] * own[f"{names.valve}.discharge_coefficient"]
    size = np.array([full_m2, 1.0, 1.0, 1.0])
    keys = ("area_m2", "critical_ratio", "cracking_ratio", "subsonic_index")
    told = estimated(keys, size * found.values[:4], size * found.deviations[:4])
    return TankCurve(
        label=f"{'charging' if piece.charging else 'discharging'} {piece.command_v:.2f} V",
        along=time_s,
        measured=measured,
        fitted=measured - found.residuals,
        command_v=piece.command_v,
        charging=piece.charging,
        **dict(zip(keys, told, strict=True)),
    )


def _common(rig: Rig, plant: Plant, names: _Names, pieces: list[_Piece]) -> Solution:
    """The rig's own parameters, fitted to all curves at once with one dead time.

    The dead zone keeps what is known of it: curves every 0.2 V say less than a slow sweep.
    """
    known, own, channel = plant.parameters, plant.values, plant.measured[0]
    scales = (0.05, 0.05, 0.1, 0.1, 0.1, 0.01, 0.05, 0.1, 0.1)
    leans = [rig.standard_deviation(name) for name in names.common[:2]]
    leans += [np.inf] * (len(scales) - len(leans))
    unknowns = [
        Unknown(own[name], scale, known[name].lower, known[name].upper, lean or np.inf)
        for name, scale, lean in zip(names.common, scales, leans, strict=True)
    ]
    unknowns.append(Unknown(3e-3, 3e-3, 0.0, LONGEST_DEAD_TIME_S))
    runs = [outputs_under(plant, piece.recording, names.common) for piece in pieces]

    def residuals(x: np.ndarray) -> np.ndarray:
        rows = []
        for piece, run in zip(pieces, runs, strict=True):
            simulated = run(x[:-1], piece.start)[0]
            time_s = piece.recording.time_s
            rows.append(piece.recording[channel] - _delayed(simulated, time_s, x[-1]))
        return np.concatenate(rows)

    return solve(residuals, unknowns, TYPICAL_ERROR_PA)


PROCEDURE = Procedure(
    name="flow",
    gives="area, critical ratio, cracking ratio and subsonic index per path and command",
    manoeuvre="valve on a tank: closed for 0.1 s, then one constant command until the pressure "
    "rests; a curve every 0.2 V, charging from ambient and discharging from full",
    source="paper 002 4.1, Figs. 7 to 10 (S002-1)",
    run=tank_curves,
)
