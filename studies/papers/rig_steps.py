"""Open-loop steps of the papers' rig: friction from them, and what models make of them.

Source: paper 000 Figs. 9 to 11; rows S000-3, S000-4 and S001-2 of physics.md section 5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.papers.rig_records import Runs
from studies.papers.rig_valve_fits import Areas, Curve
from studies.truth import crr_rig as true
from workbench.effects import StribeckFriction
from workbench.identification.sliding import BreakAway, Motion, SteadyRun, motion, steady_run
from workbench.plant import Plant
from workbench.plants.crr_cylinder import NOMINAL_CENTRE_V, OFFSET_V
from workbench.recording import Recording
from workbench.simulation import simulate

FITTED_V = (6.0, 5.75, 5.5, 5.35, 5.15, 5.0, 4.75, 4.5, 4.0)
OTHER_V = (5.875, 5.625, 5.4, 5.3, 5.25, 5.2, 5.1, 4.875, 4.625, 4.25)
SUPPLIES_PA = (5e5, 6.5e5, 8e5)
REST_S, LENGTH_S = 0.02, 2.02
MARGIN_M, MOVED_M, TRAVEL_M = 0.010, 0.5e-3, 0.050
POSITION, COMMAND = "rod.position_m", "valve.command_v"
PRESSURES = ("cap.pressure_pa", "rod_side.pressure_pa")


SLOW_V = 0.2  # of the offset: pressure rises so slowly that the start shows F_S
AVERAGED = 10  # samples of a force


@dataclass(frozen=True)
class Friction:
    """S000-3: what was read off the runs, and F_S, F_C in N, C_v in N s/m."""

    runs: list[SteadyRun]
    starts: list[BreakAway]

    @property
    def static_n(self) -> float:
        return float(np.mean([each.force_n for each in self.starts]))

    @property
    def line(self) -> tuple[float, float]:
        """F_C and C_v of a straight line through the sizes of the forces at steady speed."""
        speed, force = (
            np.abs([getattr(run, key) for run in self.runs]) for key in ("velocity_m_s", "force_n")
        )
        slope, level = np.polyfit(speed, force, 1)
        return float(level), float(slope)


@dataclass(frozen=True)
class Answer:
    """How a rod answers one step: first motion, s behind it; 50 mm, s from there; pressures, Pa.

    Times are nan where it does not come so far.
    """

    first_s: float
    travel_s: float
    needed_pa: float


def commands(levels_v: tuple[float, ...]) -> np.ndarray:
    """Rest at the offset, then each level, shape (n_samples, n_levels)."""
    n, rest = round(1e3 * LENGTH_S), round(1e3 * REST_S)
    sent = np.tile(np.array(levels_v), (n, 1))
    sent[:rest] = OFFSET_V
    return sent


def starts_m(levels_v: tuple[float, ...]) -> np.ndarray:
    """The end from which there is room, or mid stroke at the offset."""
    out = np.sign(np.array(levels_v) - OFFSET_V)
    return true.STROKE_M / 2 - out * (true.STROKE_M / 2 - MARGIN_M)


def friction(plant: Plant, all_runs: list[Runs]) -> Friction:
    """S000-3: steady runs as the tool reads them, starts from steps near the offset."""
    law = next(each for each in plant.effects if isinstance(each, StribeckFriction))
    runs, starts = [], []
    for each in all_runs:
        for k, level_v in enumerate(each.command_v[-1]):
            channels = {
                COMMAND: each.command_v[:, k],
                POSITION: each.position_m[:, k],
                **dict(zip(PRESSURES, (each.cap_pa[:, k], each.rod_side_pa[:, k]), strict=True)),
            }
            moved = motion(plant, law, Recording("step", 1e-3, channels))
            run = steady_run(moved)
            runs += [run] if run else []
            start = _start(moved) if abs(level_v - OFFSET_V) < SLOW_V else None
            starts += [start] if start else []
    return Friction(runs, starts)


def _start(moved: Motion) -> BreakAway | None:
    """The largest force up to the first motion; none where there is no motion."""
    rest = round(1e3 * REST_S)
    away = moved.position_m - moved.position_m[:rest].mean()
    first = int(np.argmax(np.abs(away) > MOVED_M))
    if not first:
        return None
    forward = bool(away[first] > 0)
    force = np.convolve(moved.friction_n(forward), np.full(AVERAGED, 1 / AVERAGED), mode="same")
    size = np.max(force[rest:first])
    return BreakAway(float(moved.position_m[0]), forward, float(size))


def simulated(plant: Plant, level_v: float, supply_pa: float) -> Recording:
    """A model under one of the steps, from the moment of the step."""
    start_m = float(starts_m((level_v,))[0])
    placed = plant.with_values({"supply.pressure_pa": supply_pa})
    placed.__dict__["model"] = plant.model  # its expressions hold for all values
    x0, names = placed.initial, plant.model.states
    for chamber, side in (("cap", 1.0), ("rod_side", -1.0)):
        part = next(p for p in placed.parts if p.name == chamber)
        at_m = [side * (m - true.STROKE_M / 2) for m in (x0[names.index(POSITION)], start_m)]
        volume = [part.dead_volume_m3 + part.area_m2 * (true.STROKE_M / 2 + m) for m in at_m]
        x0[names.index(f"{chamber}.mass_kg")] *= volume[1] / volume[0]
    x0[names.index(POSITION)] = start_m
    command = commands((level_v,))[round(1e3 * REST_S) :, 0]
    return simulate(placed, Recording("step", 1e-3, {COMMAND: command}), x0)


def answer(position_m: np.ndarray, cap_pa: np.ndarray, rod_side_pa: np.ndarray) -> Answer:
    """What is read off one run from the moment of the step."""
    moved = np.abs(position_m - position_m[0])
    first, there = (int(np.argmax(moved > far)) for far in (MOVED_M, TRAVEL_M))
    nan = float("nan")
    rod_share = float(true.AREAS_M2[1, 0]) / true.CAP_AREA_M2
    needed = float(np.abs(cap_pa - rod_share * rod_side_pa)[first]) if first else nan
    return Answer(1e-3 * first or nan, 1e-3 * (there - first) if there else nan, needed)


def answers(runs: Runs) -> list[Answer]:
    """Of the true rig, one per run."""
    rest = round(1e3 * REST_S)
    rows = (each[rest:].T for each in (runs.position_m, runs.cap_pa, runs.rod_side_pa))
    return [answer(*row) for row in zip(*rows, strict=True)]


def identified(plant: Plant, curves: list[Curve], areas: Areas, found: Friction) -> Plant:
    """The model with what S000-1 to S000-3 find on a rig."""
    centre_v, half_v = np.mean([each.fit.values[:2] for each in curves], axis=0)
    charging, discharging = areas.coefficients
    coulomb_n, viscous = found.line
    mean = (charging + discharging) / 2
    made = plant.with_values(
        {
            "valve_offset.offset_v": float(centre_v) - NOMINAL_CENTRE_V,
            "valve.underlap_v": float(half_v),
            "valve.discharge_coefficient": mean,
            "valve.discharge_asymmetry": charging / mean - 1.0,
            "friction.coulomb_force_n": coulomb_n,
            "friction.stiction_excess_n": found.static_n - coulomb_n,
            "friction.viscous_n_s_m": viscous,
        }
    )
    made.__dict__["model"] = plant.model
    return made
