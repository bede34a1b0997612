"""How the true valve of the rig is measured and fitted: input pressure, area, flow.

Source: paper 000 Figs. 5, 7 and 8; physics.md 2.1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from studies.papers.rig_records import SUBSTEPS, Runs, recorded
from studies.truth import crr_rig as true
from studies.truth.crr_rig_flow import openings
from workbench.air import IsoLaw, NozzleLaw
from workbench.effects.proportional_valve import InputPressure, ProportionalValve, TwoFlows
from workbench.identification.least_squares import Solution, Unknown, solve
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.simulation import simulate

CENTRE_V, HALF_WIDTH_V = 5.25, 0.75  # printed
STATIC_V = np.round(CENTRE_V + np.arange(-1.2, 1.21, 0.1), 3)
WAIT_S = 5.0  # eight time constants of 6 cm3 behind the hole that the centred valve leaves
OPENED_V = np.round(np.arange(0.5, 4.76, 0.25), 3)  # away from the offset
EVERY = 5  # samples: the area's fits need no finer ones
STEP_S = 1.5
ORDER = 5
CHAMBERS = ("cap", "rod_side")
LITRE_KG = 1.185e-3  # ISO 6358 reference
GAUGE_PA = 1.013e5
REAL_B = 0.3  # critical ratio of a spool valve, in place of a nozzle's 0.528


@dataclass(frozen=True)
class Curve:
    """Pressures at rest of one chamber; the fit: centre, half width, low and high pressure."""

    chamber: str
    pressure_pa: np.ndarray
    fit: Solution


@dataclass(frozen=True)
class Areas:
    """Areas that fit single steps, and what two laws make of them.

    charging, discharging   equivalent area by opening, m^2, shape (n,), of cap and rod side
    coefficients            of the segment: charging, discharging
    rmse_pa                 of the pressure at openings that no law was fitted to, by law
    """

    charging: np.ndarray
    discharging: np.ndarray
    coefficients: tuple[float, float]
    polynomials: tuple[np.ndarray, np.ndarray]
    rmse_pa: dict[str, float]


def valve_of(plant: Plant) -> ProportionalValve:
    """The plant's valve."""
    return next(each for each in plant.effects if isinstance(each, ProportionalValve))


def input_pressure_pa(
    plant: Plant, command_v: np.ndarray, numbers: np.ndarray, side: float
) -> np.ndarray:
    """The plant's input pressure for (centre, half width, low, high) on one side of the valve."""
    centre_v, half_v, low_pa, high_pa = map(float, numbers)
    valve = replace(valve_of(plant), underlap_v=half_v)
    share = InputPressure.supply_share(valve, ca.DM(side * (command_v - centre_v)))
    return low_pa + share.full().ravel() * (high_pa - low_pa)


def static_curves(plant: Plant, rig: true.CrrRig, seed: int) -> list[Curve]:
    """S000-1: each chamber at its smallest volume, so that it comes to rest in seconds."""
    n = len(STATIC_V)
    command = np.tile(STATIC_V, (round(1e3 * WAIT_S), 2))
    start_m = np.repeat([0.0, true.STROKE_M], n)
    runs = recorded(rig, command, start_m, GAUGE_PA, fixed=True, substeps=SUBSTEPS, seed=seed)
    ours = [runs.cap_pa[:, :n], runs.rod_side_pa[:, n:]]
    found = []
    for chamber, pressure_pa, side in zip(CHAMBERS, ours, (1.0, -1.0), strict=True):
        rest_pa = pressure_pa[-100:].mean(axis=0)
        found.append(Curve(chamber, rest_pa, _curve(plant, rest_pa, side)))
    return found


def _curve(plant: Plant, rest_pa: np.ndarray, side: float) -> Solution:
    unknowns = [
        Unknown(5.0, 0.1, 4.0, 6.0),
        Unknown(0.5, 0.1, 0.05, 2.0),
        Unknown(1e5, 1e4),
        Unknown(6e5, 1e4),
    ]
    return solve(
        lambda numbers: input_pressure_pa(plant, STATIC_V, numbers, side) - rest_pa,
        unknowns,
        noise=50.0,
    )


def centre_pressure_pa(plant: Plant, two_flows: bool) -> float:
    """Rest pressure of the plant's cap side at the offset, piston fixed."""
    held = plant.with_values({"rod.mass_kg": 1e9})
    if two_flows:
        other = replace(valve_of(held), underlap=TwoFlows(), discharge_asymmetry=0.0)
        held = held.without("valve").with_effects(other)
    command = np.full(601, CENTRE_V)
    seen = simulate(held, Recording("rest", 10e-3, {"valve.command_v": command}))
    return float(seen["cap.pressure_pa"][-1])


def areas(plant: Plant, rig: true.CrrRig, seed: int) -> Areas:
    """S000-2: cap side charging and rod side exhausting at once, from the lower limit."""
    command = np.tile(CENTRE_V + OPENED_V, (round(1e3 * STEP_S), 1))
    start_pa = np.array([[rig.ambient_pressure_pa], [rig.supply_pressure_pa]])
    mid_m = np.full(len(OPENED_V), true.STROKE_M / 2)
    start_pa = np.repeat(start_pa, len(OPENED_V), axis=1)
    runs = recorded(rig, command, mid_m, start_pa, fixed=True, substeps=SUBSTEPS, seed=seed)
    step = Step(plant, runs)
    found = np.array([step.coefficients(k) for k in range(len(OPENED_V))])
    hole_m2 = step.hole_m2
    taught = np.arange(len(OPENED_V)) % 2 == 0
    weight = hole_m2[taught]
    pair = tuple(float(c[taught] @ weight**2 / (weight @ weight)) for c in found.T)
    fits = tuple(np.polyfit(OPENED_V[taught], (c * hole_m2)[taught] * 1e6, ORDER) for c in found.T)
    by_law = {
        "polynomial": np.array([np.polyval(f, OPENED_V) * 1e-6 / hole_m2 for f in fits]).T,
        "segment": np.tile(pair, (len(OPENED_V), 1)),
    }
    rmse_pa = {
        law: float(np.sqrt(np.mean([step.error_pa(k, c[k]) ** 2 for k in np.flatnonzero(~taught)])))
        for law, c in by_law.items()
    }
    return Areas(found[:, 0] * hole_m2, found[:, 1] * hole_m2, pair, fits, rmse_pa)


class Step:
    """The plant with its piston fixed under the steps of a recording."""

    def __init__(self, plant: Plant, runs: Runs) -> None:
        values = {"rod.mass_kg": 1e9, "supply.pressure_pa": runs.rig.supply_pressure_pa}
        self.plant = plant.with_values(values)
        self.runs, self.model = runs, self.plant.model
        valve = replace(valve_of(plant), discharge_coefficient=1.0, discharge_asymmetry=0.0)
        self.hole_m2 = valve.equivalent_area_m2(ca.DM(OPENED_V)).full().ravel()

    def error_pa(self, k: int, pair: np.ndarray) -> np.ndarray:
        """Pressures of both chambers with these two coefficients less the recorded ones."""
        mean = float(np.mean(pair))
        asymmetry = float(pair[0] - pair[1]) / (2 * mean)
        plant = self.plant.with_values(
            {"valve.discharge_coefficient": mean, "valve.discharge_asymmetry": asymmetry}
        )
        plant.__dict__["model"] = self.model  # its expressions hold for all values
        names = [f"{name}.pressure_pa" for name in CHAMBERS]
        x0, start_pa = plant.initial, (self.runs.cap_pa[0, k], self.runs.rod_side_pa[0, k])
        for name, pressure in zip(CHAMBERS, start_pa, strict=True):
            at = self.model.states.index(f"{name}.pressure_pa")
            gas = self.model.states.index(f"{name}.mass_kg")
            x0[gas] *= pressure / x0[at]
            x0[at] = pressure
        command = self.runs.command_v[::EVERY, k]
        seen = simulate(plant, Recording("step", 1e-3 * EVERY, {"valve.command_v": command}), x0)
        real = np.stack([self.runs.cap_pa[::EVERY, k], self.runs.rod_side_pa[::EVERY, k]])
        return (seen.rows(names) - real).ravel()

    def coefficients(self, k: int) -> np.ndarray:
        """Discharge coefficients of charging and discharging that fit one step."""
        unknowns = [Unknown(0.6, 0.05, 0.2, 1.2)] * 2
        return solve(lambda pair: self.error_pa(k, pair), unknowns, noise=500.0).values


def flow_l_min(plant: Plant, command_v: np.ndarray) -> np.ndarray:
    """S001-1: flow into the cap side from 6 to 5 bar gauge, litres at reference state."""
    fed = plant.with_values({"supply.pressure_pa": 6e5 + GAUGE_PA})
    model = plant.model
    x0 = fed.initial
    at, gas = (model.states.index(f"cap.{q}") for q in ("pressure_pa", "mass_kg"))
    x0[gas] *= (5e5 + GAUGE_PA) / x0[at]
    x0[at] = 5e5 + GAUGE_PA
    into = ca.Function("into", [*model.symbols], [model.flows["valve", "MassFlow", "cap"]])
    rate = [float(into(x0, u, [], fed.nominal[2])) for u in command_v]
    return 60.0 * np.array(rate) / LITRE_KG


def true_areas_m2(rig: true.CrrRig) -> np.ndarray:
    """Of the truth's holes, shape (2, n): cap side charging, rod side exhausting."""
    return openings(rig, np.array([CENTRE_V + OPENED_V]))[1][0]


def iso_share() -> float:
    """Flow from 6 to 5 bar gauge by ISO 6358 over that of the nozzle function."""
    ratio = (5e5 + GAUGE_PA) / (6e5 + GAUGE_PA)
    return float(IsoLaw(REAL_B)(ratio) / NozzleLaw()(ratio))


def error_of_areas(found: Areas, rig: true.CrrRig) -> float:
    """Largest relative error of the area of a single step."""
    both = np.stack([found.charging, found.discharging])
    return float(np.abs(both / true_areas_m2(rig) - 1).max())


def without_lag(rig: true.CrrRig) -> true.CrrRig:
    """The rig with a spool and with sensors that follow at once."""
    return replace(rig, valve_period_s=1e-5, pressure_lag_s=0.0)
