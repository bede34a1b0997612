"""S002-1: flow parameters per path and command from charging and discharging curves of a tank.

The valve is opened at one command from closed, and the pressure of the tank is logged until it
rests.  For each command area, critical ratio b, cracking ratio a and subsonic index m of

    mdot = A C_d C_chk p_u / sqrt(T_u) psi(p_d / p_u; b, a, m)

are fitted to the curve with the rig's own plant at full command, whose path of that side then has
the area A(u); the plant's leak, heat flow and volume act beside it.  A dead time stands for valve
and sensor.  b, a and m lean on the rig's values within the range of table values, since a
curve that rests early says little of them.

The rig's own parameters, far fewer, are then fitted to all curves at once.  The dead zone comes
first, and a rig that does not know it is refused: its limits say how far a path is open, and the
leak of the closed spool, found with them, acts on every curve.

Source: paper 002 4.1, Eqs. 1 to 3, Figs. 7 to 10, 17 (arguments and branches by errata E002-1 to
E002-4, which the flow law of the plant has); physics.md 5, row S002-1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import isfinite

import numpy as np

from workbench.fitting.noise import measured_noise
from workbench.identification.estimate import Estimate, estimated
from workbench.identification.least_squares import Solution, Unknown, solve
from workbench.identification.result import Procedure, complete, known_before
from workbench.identification.runs import outputs_under
from workbench.identification.settled import settled
from workbench.identification.standing import end_reached
from workbench.identification.tank import tank_on_valve
from workbench.identification.tank_flow import FlowFit, TankCurve, ValveNames
from workbench.identification.tank_pieces import LEAST_OPEN, Piece, open_commands, tank_pieces
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig

LEAN = {"b": 0.15, "a": 0.02, "m": 0.15}  # how far b, a and m of a curve lie from the rig's
LONGEST_DEAD_TIME_S = 0.02
SCALES = {
    **dict.fromkeys(("area_exponent", "supply_fraction", "exhaust_fraction"), 0.1),
    **dict.fromkeys(("supply_critical_ratio", "exhaust_critical_ratio"), 0.1),
    "cracking_ratio": 0.01,
    "subsonic_index": 0.05,
}
TYPICAL_ERROR_PA = 4e3  # 0.04 bar, what the paper reports


def tank_curves(
    rig: Rig, recordings: Sequence[Recording], progress: Callable[[str], None] = lambda said: None
) -> FlowFit:
    """Flow parameters of every curve, and those of the rig.

    Each piece of a recording is one curve.  ``progress`` hears of every curve.

    Raises
    ------
    InputError
        If the plant is no tank behind a valve, its dead zone is not known, or a piece is no curve:
        valve closed, then one constant command.
    """
    complete(recordings)
    tank = tank_on_valve(rig, recordings[0])
    plant, names = tank.plant, ValveNames(tank.valve, tank.zone)
    why = "the flow of a path is right only behind the right dead zone"
    known_before(rig, names.before, "dead-zone", why)
    pieces = tank_pieces(tank, recordings)
    noise = measured_noise(recordings, plant.measured)[plant.measured[0]]
    curves = []
    for k, piece in enumerate(pieces, start=1):
        progress(f"curve {k} of {len(pieces)}, {piece.command_v:.2f} V")
        curves.append(_curve(plant, names, piece, noise))
    progress("all curves at once")
    shared = [name for name in _shown(names, pieces) if name not in rig.fixed]
    shared, common, doubts = settled(rig, shared, lambda names: _common(plant, names, pieces))
    ends = np.cumsum([len(piece.recording) for piece in pieces])[:-1]
    return FlowFit(
        rig=rig,
        estimates=(_mean_error(curves),),
        parameters=estimated(shared, common.values[:-1], common.deviations[:-1]),
        carried=tuple(
            Estimate(name, rig.plant.values[name], rig.deviations.get(name, 0.0))
            for name in names.before
        ),
        names=names,
        doubts=doubts,
        curves=tuple(curves),
        rig_errors_pa=tuple(
            float(np.mean(np.abs(left))) for left in np.split(common.residuals, ends)
        ),
    )


def _shown(names: ValveNames, pieces: list[Piece]) -> list[str]:
    """The rig's parameters that the curves say something of: a path needs some of its own."""
    missing = [side for side in (True, False) if open_commands(pieces, side) < LEAST_OPEN]
    silent = {name for side in missing for name in names.shape(side)[:2]}
    return [name for name in names.common if name not in silent]


def _mean_error(curves: list[TankCurve]) -> Estimate:
    errors = [curve.mean_absolute_error for curve in curves]
    return Estimate("mean_error_pa", float(np.mean(errors)), float(np.std(errors)))


def _delayed(values: np.ndarray, time_s: np.ndarray, dead_time_s: float) -> np.ndarray:
    return np.interp(time_s - dead_time_s, time_s, values)


def _curve(plant: Plant, names: ValveNames, piece: Piece, noise: float) -> TankCurve:
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
    shapes = zip(keys[1:], shape[1:], found.values[1:4], strict=True)
    return TankCurve(
        label=f"{'charging' if piece.charging else 'discharging'} {piece.command_v:.2f} V",
        along=time_s,
        measured=measured,
        fitted=measured - found.residuals,
        noise=noise,
        command_v=piece.command_v,
        charging=piece.charging,
        at_bound=tuple(k for k, name, x in shapes if isfinite(end_reached(known[name], x))),
        **dict(zip(keys, told, strict=True)),
    )


def _common(plant: Plant, names: Sequence[str], pieces: list[Piece]) -> Solution:
    """The rig's own parameters, fitted to all curves at once with one dead time.

    The dead zone stays: one law of area for all commands would bend its limits to fit better.
    """
    known, own, channel = plant.parameters, plant.values, plant.measured[0]
    unknowns = [
        Unknown(own[name], SCALES[name.rpartition(".")[2]], known[name].lower, known[name].upper)
        for name in names
    ]
    unknowns.append(Unknown(3e-3, 3e-3, 0.0, LONGEST_DEAD_TIME_S))
    runs = [outputs_under(plant, piece.recording, names) for piece in pieces]

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
    "rests, one recording each; a curve every 0.2 V from 0 to 10 V, charging from ambient above "
    "the dead zone and discharging from full below it",
    channels="valve.command and reservoir.pressure at 500 Hz or more; supply.pressure where the "
    "supply is not constant",
    first="dead-zone",
    example="flow tank2.toml curve_*.csv -o drive2.toml --into drive.toml --figures figures",
    source="paper 002 4.1, Figs. 7 to 10 (S002-1)",
    printed={"mean_error_pa": TYPICAL_ERROR_PA},
    run=tank_curves,
)
