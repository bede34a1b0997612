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
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.effects import ConstantWallHeat
from workbench.fitting.noise import measured_noise
from workbench.identification.held_gas import (
    STILL_M,
    geometry,
    held_position_m,
    kept_share,
    plugged,
    position_channel,
    pressed_chamber,
)
from workbench.identification.least_squares import Solution, Unknown, solve
from workbench.identification.result import (
    Curve,
    Estimate,
    Identified,
    Procedure,
    complete,
    estimated,
    known_before,
    unfit,
)
from workbench.identification.runs import outputs_under
from workbench.parts import Chamber
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.vessel import Vessel

LATER_S = 0.02  # after the stop: sensors and the piston have come to rest
LEAST_NOISE = 10.0  # noise deviations that the pressure must decay by
LEAST_TIME_CONSTANTS = 3.0
MOST_HEATED = 2.0  # temperature behind the stop over that of the wall, or the inverse
MOST_LOST = 0.3  # of the gas: more is no leak of a plugged chamber
TYPICAL_LEAK_M2 = 1e-9


@dataclass(frozen=True, kw_only=True)
class WallHeatFit(Identified):
    """Time constant, conductance and coefficients; ``curves`` hold exponential and pressure."""

    chamber: str


@dataclass(frozen=True)
class _Decay:
    """One decay: the pressure from the stop on, and the vessel it happens in.

    ``kept`` is the gas that is there at the end over that before the push, both at the temperature
    of the wall; 1 where no piston moves.
    """

    recording: Recording
    vessel: Plant
    channel: str
    noise: float
    kept: float


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
    decays = [_decay(plant, each) for each in recordings]
    _check_volumes(rig, decays)
    for each in decays:
        _check_plugged(each)
    tops = [_exponential(each) for each in decays]
    name = _coefficient(decays[0].vessel)
    fits = [_fitted(each, name) for each in decays]
    coefficient = _together([Estimate(name, f.values[0], f.deviations[0]) for f in fits])
    return WallHeatFit(
        rig=rig,
        estimates=_paper_chain(decays[0], tops[0], coefficient),
        parameters=(coefficient,),
        curves=tuple(c for rows in zip(decays, tops, fits, strict=True) for c in _curves(*rows)),
        chamber=decays[0].channel.partition(".")[0],
    )


def _check_volumes(rig: Rig, decays: Sequence[_Decay]) -> None:
    """The gas that cools is that of the whole volume; a vessel's is the rig's own."""
    dead = {f"{each.channel.partition('.')[0]}.dead_volume_m3" for each in decays}
    why = "the gas that cools is that of the whole volume"
    known_before(rig, sorted(dead & set(rig.plant.values)), "dead-volume", why)


def _check_plugged(decay: _Decay) -> None:
    """Refuse what a valve fills or empties: that comes to rest like an exponential too.

    The gas of a plugged chamber stays there, and its pressure falls or rises by its temperature
    alone.
    """
    measured = decay.recording[decay.channel]
    n = max(len(measured) // 20, 1)
    first, last = float(measured[0]), float(measured[-n:].mean())
    if abs(decay.kept - 1.0) > MOST_LOST:
        what = f"{decay.kept:.0%} of the gas before the push is there at the end"
    elif not 1.0 / MOST_HEATED < first / last < MOST_HEATED:
        what = f"{first / 1e5:.2g} bar that come to {last / 1e5:.2g} bar are more than heat does"
    else:
        return
    expected = "both ports of the chamber plugged, so that its gas stays"
    raise unfit(decay.recording, f"is no thermal decay: {what}", expected)


def _decay(plant: Plant, recording: Recording) -> _Decay:
    """The part of a recording after the push, checked."""
    chamber = pressed_chamber(plant, recording)
    channel = f"{chamber.name}.pressure_pa"
    noise = measured_noise([recording], [channel])[channel]
    held_m = held_position_m(chamber, recording)
    volume, surface = geometry(plant, chamber, held_m)
    rest = recording.part(_stopped(chamber, recording, held_m), len(recording))
    pressure = rest[channel] if len(rest) else np.zeros(1)
    n = max(len(rest) // 20, 1)
    fallen_pa = abs(float(np.mean(pressure[:n]) - np.mean(pressure[-n:])))
    if len(rest) < 50 or fallen_pa < LEAST_NOISE * noise:
        what = f"is no thermal decay: {chamber.name} moves by {fallen_pa / 1e5:.2g} bar after it"
        expected = f"a decay of at least {LEAST_NOISE * noise / 1e5:.2g} bar, logged to its end"
        raise unfit(recording, what, expected)
    kept = kept_share(plant, chamber, recording, volume, float(np.mean(pressure[-n:])))
    return _Decay(rest, plugged(plant, chamber, volume, surface), channel, noise, kept)


def _stopped(chamber: Chamber | Vessel, recording: Recording, held_m: float) -> int:
    """The sample at which a pushed piston and its sensors have come to rest; 0 of a vessel."""
    if isinstance(chamber, Vessel):
        return 0
    moving = np.flatnonzero(np.abs(recording[position_channel(chamber)] - held_m) > STILL_M)
    expected = "a piston pushed quickly and then held, both ports of its chamber plugged"
    if not len(moving):
        raise unfit(recording, "is no thermal decay: the piston never moves", expected)
    return int(moving[-1]) + 1 + round(LATER_S / recording.sample_time_s)


def _exponential(decay: _Decay) -> Solution:
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


def _state(decay: _Decay, pressure_pa: float, end_pa: float) -> np.ndarray:
    """Vessel state at a pressure, with the mass of gas that is at wall temperature at the end."""
    vessel, volume = decay.vessel, next(p for p in decay.vessel.parts if hasattr(p, "volume_m3"))
    x = vessel.initial.copy()
    states = list(vessel.state_list)
    x[states.index(decay.channel)] = pressure_pa
    mass = f"{volume.name}.mass_kg"
    if mass in states:
        x[states.index(mass)] = volume.mass_at(end_pa, volume.volume_m3)
    return x


def _paper_chain(
    decay: _Decay, exponential: Solution, coefficient: Estimate
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


def _per_coefficient(decay: _Decay, end_pa: float) -> tuple[float, float]:
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
    point = _state(decay, end_pa, end_pa), *vessel.nominal[:2], own
    rate, watt, kelvin = map(float, ca.Function("slopes", [*model.symbols], slopes)(*point))
    return -rate, -watt / kelvin


def _coefficient(vessel: Plant) -> str:
    heat = next(e for e in vessel.effects if isinstance(e, ConstantWallHeat))
    return f"{heat.name}.coefficient_w_m2_k"


def _fitted(decay: _Decay, name: str) -> Solution:
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
        lambda x: measured - run(x[[0, 3]], _state(decay, x[1], x[2]))[0], unknowns, decay.noise
    )


def _curves(decay: _Decay, exponential: Solution, fit: Solution) -> list[Curve]:
    time_s, measured = decay.recording.time_s, decay.recording[decay.channel]
    rows = (("exponential", exponential), ("heat law", fit))
    return [
        Curve(
            label=f"{decay.recording.name}, {label}",
            along=time_s,
            measured=measured,
            fitted=measured - found.residuals,
        )
        for label, found in rows
    ]


def _together(found: list[Estimate]) -> Estimate:
    """The mean of estimates of one number, weighted by what is known of each."""
    weights = np.array([1.0 / max(each.deviation, 1e-30) ** 2 for each in found])
    mean = float(weights @ [each.value for each in found] / weights.sum())
    return Estimate(found[0].name, mean, float(weights.sum() ** -0.5))


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
