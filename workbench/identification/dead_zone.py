"""S002-2: limits of the dead zone from the static pressure map under a slow sweep of the command.

On a closed tank the pressure stands while the spool covers both ports, but for the leak, rises as
soon as the command passes the upper limit zmd, and falls as soon as it passes the lower one, zms:

    centre = (zms + zmd) / 2,   half-width = (zmd - zms) / 2

Both are fitted to the whole recording with the rig's own plant, beside what else shapes its edges:
the sizes of both paths, which are not kept, and the leak of the closed spool; what the rig fixes
of these stays.  The slopes of
paper 002's dead-zone block have no counterpart: full command is full opening for every width.

Source: paper 002 Fig. 11, Table 3 (4.53 V, 5.37 V); physics.md 2.4 and 5, row S002-2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.fitting.noise import measured_noise
from workbench.fitting.starts import guessed_states
from workbench.identification.estimate import estimated
from workbench.identification.least_squares import Solution, Unknown, solve
from workbench.identification.result import Curve, Identified, Procedure, complete, unfit
from workbench.identification.runs import outputs_under
from workbench.identification.tank import TankOnValve, rests_at, steady_supply, tank_on_valve
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig

REACHED = 0.8  # of supply minus ambient: the sweep must fill and empty the tank that far
FASTEST_V_S = 2.0
EDGE_V = 0.02  # a change of a limit that shows


@dataclass(frozen=True, kw_only=True)
class DeadZoneLimits(Identified):
    """The limits, and the map: ``curves`` hold the pressure over the command."""

    lower_v: float
    upper_v: float


def dead_zone(rig: Rig, recordings: Sequence[Recording]) -> DeadZoneLimits:
    """Limits of the dead zone, and the leak of the closed spool.

    Raises
    ------
    InputError
        If the plant is no tank behind a valve, or a recording no slow sweep through both limits.
    """
    complete(recordings)
    tank = tank_on_valve(rig, recordings[0])
    plant = tank.plant
    for each in recordings:
        _check_sweep(tank, each)
    noise = measured_noise(recordings, plant.measured)[plant.measured[0]]
    pieces = [piece for each in recordings for piece in each.pieces]
    limits = [f"{tank.zone}.centre_v", f"{tank.zone}.half_width_v"]
    edges = [f"{tank.valve}.{k}" for k in ("leak_area_m2", "supply_fraction", "exhaust_fraction")]
    names = [*limits, *(name for name in edges if name not in rig.fixed)]
    found = _fitted(plant, pieces, names, noise)
    centre_v, half_v = found.values[:2]
    shares = np.array([[1.0, -1.0], [1.0, 1.0]])
    deviations = np.sqrt(np.diag(shares @ found.covariance[:2, :2] @ shares.T))
    lower_v, upper_v = float(centre_v - half_v), float(centre_v + half_v)
    kept = 2 + names.count(edges[0])  # sizes of the paths are not: they only shape the edges
    return DeadZoneLimits(
        rig=rig,
        estimates=estimated(("lower_limit_v", "upper_limit_v"), (lower_v, upper_v), deviations),
        parameters=estimated(names[:kept], found.values[:kept], found.deviations[:kept]),
        curves=tuple(_curves(plant, pieces, found.residuals, noise)),
        lower_v=lower_v,
        upper_v=upper_v,
    )


def _fitted(plant: Plant, pieces: list[Recording], names: list[str], noise: float) -> Solution:
    known, own = plant.parameters, plant.values
    unknowns = [
        Unknown(own[name], _scale(name, plant), known[name].lower, known[name].upper)
        for name in names
    ]
    runs = [outputs_under(plant, piece, names) for piece in pieces]
    starts = [guessed_states(plant, piece)[0, :, 0] for piece in pieces]
    measured = [piece[plant.measured[0]] for piece in pieces]

    def residuals(x: np.ndarray) -> np.ndarray:
        rows = zip(measured, runs, starts, strict=True)
        return np.concatenate([m - run(x, start)[0] for m, run, start in rows])

    return solve(residuals, unknowns, noise)


def _scale(name: str, plant: Plant) -> float:
    """A change of a parameter that shows."""
    if name.endswith("_v"):
        return EDGE_V
    return 0.1 if name.endswith("_fraction") else 0.2 * plant.parameters[name].typical


def _curves(
    plant: Plant, pieces: list[Recording], residuals: np.ndarray, noise: float
) -> list[Curve]:
    command, pressure = plant.commands[0].name, plant.measured[0]
    parts = np.split(residuals, np.cumsum([len(piece) for piece in pieces])[:-1])
    return [
        Curve(
            label=piece.name,
            along=piece[command],
            measured=piece[pressure],
            fitted=piece[pressure] - left,
            noise=noise,
        )
        for piece, left in zip(pieces, parts, strict=True)
    ]


def _check_sweep(tank: TankOnValve, recording: Recording) -> None:
    plant = tank.plant
    command, pressure = recording[plant.commands[0].name], recording[plant.measured[0]]
    steady_supply(recording)
    low_pa, high_pa = float(np.min(pressure)), float(np.max(pressure))
    expected = "a slow sweep of the command through both limits, which fills and empties the tank"
    ways = {
        "moves": high_pa - low_pa,
        "rises": float(np.max(pressure - np.minimum.accumulate(pressure))),
        "falls": float(np.max(np.maximum.accumulate(pressure) - pressure)),
    }
    for way, moved_pa in ways.items():
        if moved_pa < REACHED * tank.span_pa(recording):
            what = (
                f"is no map of the dead zone: the pressure {way} by {moved_pa / 1e5:.2g} bar only"
            )
            raise unfit(recording, what, expected)
    smooth = np.convolve(command, np.ones(25) / 25, mode="valid")
    fastest_v_s = float(np.max(np.abs(np.diff(smooth)))) / recording.sample_time_s
    if fastest_v_s > FASTEST_V_S:
        what = f"is no map of the dead zone: the command moves at {fastest_v_s:.3g} V/s"
        raise unfit(recording, what, f"{expected}, below {FASTEST_V_S:g} V/s")
    rests_at(tank, recording, high_pa, charged=True)
    rests_at(tank, recording, low_pa, charged=False)


PROCEDURE = Procedure(
    name="dead-zone",
    gives="limits of the dead zone, leak of the closed spool",
    manoeuvre="valve on a closed tank, from ambient: two periods of a slow sine of the command "
    "(20 s), 1.2 V about its centre, so that the tank fills and empties once in each",
    channels="valve.command and reservoir.pressure at 100 Hz or more; supply.pressure where the "
    "supply is not constant",
    example="dead-zone tank.toml map.csv -o tank2.toml --figures figures",
    source="paper 002 Fig. 11, Table 3 (S002-2)",
    printed={"lower_limit_v": 4.53, "upper_limit_v": 5.37},
    run=dead_zone,
)
