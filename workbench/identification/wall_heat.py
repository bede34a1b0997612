"""S002-3: heat coefficient of the wall from the thermal decay of a plugged chamber.

The piston is pushed quickly from y_i to y_f and held there; the gas comes back to the temperature
of the wall, and its pressure with it:

    p(t) = p_f + dp exp(-t / tau),    k = m c_v / tau,    lambda_0 = lambda(k) at (p_f, T_w)

tau is that of the exponential; conductance and coefficient of this chain are read from the
plant's own heat law linearised at the end of the decay.  The chain makes the coefficient too large
after a push and too small after a pull, more so for a long one, because the decay is no exponential
(E002-15): the coefficient grows with sqrt(p T).  So the coefficient of the rig is fitted to the
pressure itself, with the gas temperature at the stop and a leak as unknowns; the time constant that
it gives at rest is told too.

Source: paper 002 Eqs. 16 to 19, Fig. 12, Table 4; physics.md 5, row S002-3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import nan

import casadi as ca
import numpy as np

from workbench.effects import ConstantWallHeat
from workbench.identification.decay import Decay, check_plugged, start_state, thermal_decay
from workbench.identification.estimate import Estimate, estimated
from workbench.identification.least_squares import Solution, Unknown, solve
from workbench.identification.result import (
    Curve,
    Identified,
    Procedure,
    complete,
    known_before,
    unfit,
)
from workbench.identification.runs import outputs_under
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig

LEAST_TIME_CONSTANTS = 3.0
TYPICAL_LEAK_M2 = 1e-9
LEAST = 1e-30  # of a deviation that is divided by
CLEARLY = 2.5  # times what their deviations say: decays contradict each other


@dataclass(frozen=True, kw_only=True)
class WallHeatFit(Identified):
    """Time constant, conductance and coefficients; ``curves`` hold exponential and pressure."""

    chamber: str


def wall_heat(rig: Rig, recordings: Sequence[Recording]) -> WallHeatFit:
    """Coefficient of the wall's heat law; several decays count together.

    Raises
    ------
    InputError
        If a recording holds no decay after a push, or one too short or too small, or the dead
        volume of its chamber is not known.
    """
    complete(recordings)
    plant = rig.fit_for(recordings[0])
    decays = [thermal_decay(plant, each) for each in recordings]
    _check_volumes(rig, decays)
    for each in decays:
        check_plugged(each)
    tops = [_exponential(each) for each in decays]
    name = _coefficient(decays[0].vessel)
    fits = [_fitted(each, name) for each in decays]
    each_own = [Estimate(name, f.values[0], f.deviations[0]) for f in fits]
    coefficient, apart = _together(each_own)
    by_volume = _by_volume(rig, decays, each_own)
    deviation = float(np.hypot(coefficient.deviation, by_volume))
    return WallHeatFit(
        rig=rig,
        estimates=_paper_chain(decays[0], tops[0], coefficient),
        parameters=(replace(coefficient, deviation=deviation),),
        doubts=_contradictions(each_own, apart),
        curves=tuple(c for rows in zip(decays, tops, fits, strict=True) for c in _curves(*rows)),
        chamber=decays[0].chamber,
    )


def _check_volumes(rig: Rig, decays: Sequence[Decay]) -> None:
    """The gas that cools is that of the whole volume; a vessel's is the rig's own."""
    dead = {f"{each.chamber}.dead_volume_m3" for each in decays}
    why = "the gas that cools is that of the whole volume"
    known_before(rig, sorted(dead & set(rig.plant.values)), "dead-volume", why)


def _exponential(decay: Decay) -> Solution:
    """p_f, dp and tau of the exponential."""
    time_s, measured = decay.recording.time_s, decay.recording[decay.channel]
    n = max(len(measured) // 20, 1)
    end, span = float(measured[-n:].mean()), float(measured[:n].mean() - measured[-n:].mean())
    fallen = np.flatnonzero((measured - end) / span < np.exp(-1.0))
    guess_s = max(float(time_s[fallen[0]]), 5 * decay.recording.sample_time_s)
    unknowns = [
        Unknown(end, abs(span)),
        Unknown(span, abs(span)),
        Unknown(guess_s, guess_s, 0.1 * guess_s, 10 * guess_s),
    ]
    found = solve(lambda x: measured - x[0] - x[1] * np.exp(-time_s / x[2]), unknowns, decay.noise)
    if time_s[-1] < LEAST_TIME_CONSTANTS * found.values[2]:
        what = (
            f"ends {time_s[-1]:.2g} s after the push, at a time constant of {found.values[2]:.2g}"
        )
        expected = f"{LEAST_TIME_CONSTANTS:g} time constants with the piston held"
        raise unfit(decay.recording, what, expected)
    return found


def _paper_chain(
    decay: Decay, exponential: Solution, coefficient: Estimate
) -> tuple[Estimate, ...]:
    """Time constant, conductance and coefficient of the chain; time constant of the fitted law."""
    tau, share = exponential.values[2], exponential.deviations[2] / exponential.values[2]
    per_s, conductance = _per_coefficient(decay, exponential.values[0])
    chained = 1.0 / (tau * per_s)
    at_rest = 1.0 / (coefficient.value * per_s)
    names = ("time_constant_s", "conductance_w_k", "chain_coefficient_w_m2_k")
    found = np.array([tau, conductance * chained, chained])
    known = Estimate(
        "rest_time_constant_s", at_rest, at_rest * coefficient.deviation / coefficient.value
    )
    return (*estimated(names, found, share * found), known)


def _per_coefficient(decay: Decay, end_pa: float) -> tuple[float, float]:
    """1 / tau and conductance for a coefficient of one, at the end of the decay.

    1 / tau = -d(p')/dp at constant mass; both are proportional to the coefficient there.
    """
    vessel, model = decay.vessel, decay.vessel.model
    name, x = _coefficient(vessel), model.symbols[0]
    at = model.states.index(decay.channel)
    temperature = model.conditions.read(decay.channel.replace("pressure_pa", "temperature_k"))
    heat = model.flows[name.partition(".")[0], "HeatFlow", decay.channel.partition(".")[0]]
    slopes = [ca.gradient(e, x)[at] for e in (model.rates[at], heat, temperature)]
    own = vessel.nominal[2].copy()
    own[model.parameters.index(name)] = 1.0
    point = start_state(decay, end_pa, end_pa), *vessel.nominal[:2], own
    rate, watt, kelvin = map(float, ca.Function("slopes", [*model.symbols], slopes)(*point))
    return -rate, -watt / kelvin


def _coefficient(vessel: Plant) -> str:
    heat = next(e for e in vessel.effects if isinstance(e, ConstantWallHeat))
    return f"{heat.name}.coefficient_w_m2_k"


def _fitted(decay: Decay, name: str) -> Solution:
    """Coefficient, pressure at the stop, pressure at the end, and leak, by simulation."""
    measured = decay.recording[decay.channel]
    run = outputs_under(decay.vessel, decay.recording, [name, "chamber_leak.area_m2"])
    end_pa = float(measured[-max(len(measured) // 20, 1) :].mean())
    known = decay.vessel.parameters[name]
    own = max(decay.vessel.values[name], 0.1 * known.typical)
    unknowns = [
        Unknown(own, own, known.lower, known.upper),
        Unknown(float(measured[0]), 1e3),
        Unknown(end_pa, 1e3),
        Unknown(0.0, TYPICAL_LEAK_M2, 0.0),
    ]
    return solve(
        lambda x: measured - run(x[[0, 3]], start_state(decay, x[1], x[2]))[0],
        unknowns,
        decay.noise,
    )


def _curves(decay: Decay, exponential: Solution, fit: Solution) -> list[Curve]:
    time_s, measured = decay.recording.time_s, decay.recording[decay.channel]
    rows = (("exponential", exponential, nan), ("heat law", fit, decay.noise))
    return [
        Curve(
            label=f"{decay.recording.name}, {label}",
            along=time_s,
            measured=measured,
            fitted=measured - found.residuals,
            noise=noise,
        )
        for label, found, noise in rows
    ]


def _together(found: list[Estimate]) -> tuple[Estimate, float]:
    """The mean of estimates of one number, and how many of their deviations they lie apart.

    Weighted by what is known of each; where they lie further apart than that, the mean is known so
    much worse.
    """
    weights = _weights(found)
    values = np.array([each.value for each in found])
    mean = float(weights @ values)
    off = (values - mean) / [max(each.deviation, LEAST) for each in found]
    apart = float(np.sqrt(off @ off / max(len(found) - 1, 1)))
    alone = float(np.sum([max(each.deviation, LEAST) ** -2.0 for each in found]) ** -0.5)
    return Estimate(found[0].name, mean, max(apart, 1.0) * alone), apart


def _weights(found: list[Estimate]) -> np.ndarray:
    weights = np.array([max(each.deviation, LEAST) ** -2.0 for each in found])
    return weights / weights.sum()


def _contradictions(found: list[Estimate], apart: float) -> tuple[str, ...]:
    """What to say of decays that tell of different coefficients."""
    if apart < CLEARLY:
        return ()
    low, high = (pick(each.value for each in found) for pick in (min, max))
    said = (
        f"the {len(found)} decays contradict each other, {low:.4g} to {high:.4g} W/(m^2 K), "
        f"{apart:.2g} times what their deviations say: is the dead volume right, and was the "
        "piston held still?"
    )
    return (said,)


def _by_volume(rig: Rig, decays: list[Decay], found: list[Estimate]) -> float:
    """What the mean moves by at dead volumes that are larger by their deviation.

    Every decay of one chamber moves along; the chambers' volumes are known independently.
    """
    moved = dict.fromkeys((each.chamber for each in decays), 0.0)
    for decay, own, weight in zip(decays, found, _weights(found), strict=True):
        name = f"{decay.chamber}.dead_volume"
        more_m3 = rig.deviations.get(f"{name}_m3", 0.0)
        if more_m3:
            change = 1.0 + rig.plant.values.get(f"{name}_change", 0.0)
            larger = _fitted(decay.larger_by(change * more_m3), own.name).values[0]
            moved[decay.chamber] += float(weight * (larger - own.value))
    return float(np.linalg.norm(list(moved.values())))


PROCEDURE = Procedure(
    name="wall-heat",
    gives="thermal time constant, heat coefficient of the wall",
    manoeuvre="ports of one chamber plugged, piston pushed or pulled by a third of the stroke in "
    "0.2 s and held for 5 s; several such recordings count together, and the time constant told is "
    "that of the first",
    channels="valve.command, slide.position and the pressure of the chamber at 500 Hz or more",
    first="dead-volume",
    example="wall-heat drive3.toml push.csv -o drive4.toml --figures figures",
    source="paper 002 Eqs. 16 to 19, Fig. 12, Table 4 (S002-3)",
    printed={
        "time_constant_s": 0.662,
        "conductance_w_k": 0.221,
        "chain_coefficient_w_m2_k": 22.563,
        "rest_time_constant_s": 0.662,
        "wall_heat.coefficient_w_m2_k": 22.563,
    },
    run=wall_heat,
)
