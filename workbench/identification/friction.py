"""S002-4 to S002-6: friction map from runs at constant speed, break-away from stick-slip.

    F(v) = sign(v) g(v) + sigma_2 v,    g(v) = F_c + (F_s - F_c) exp(-(v / v_s)^2)

by direction.  Runs at constant command give F_c and sigma_2, break-aways F_s; v_s is fitted only
where a run is slow enough to show it (three v_s) beside two others of its direction, and else stays
the rig's.  Where a slow run has one other beside it, what is not known of v_s counts in both.  F_s
depends on where the piston rests, and its deviation counts the spread over the break-aways.

Where the rig has friction by pressure, it keeps its factor, and the map is without that part.

The bristle follows by rule, in `bristle.py` (S002-6).

Source: paper 002 Eqs. 12 to 14, 20, 21, Figs. 13, 14, Table 5 (magnitudes for v < 0, E002-6;
sigma_1 in N s/m, E002-13); physics.md 5.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import inf

import casadi as ca
import numpy as np

from workbench.effect import Conditions
from workbench.effects import StribeckFriction
from workbench.errors import InputError, Message, listed
from workbench.identification.bristle import bristle, rule
from workbench.identification.estimate import Estimate, estimated
from workbench.identification.least_squares import Solution, Unknown, solve
from workbench.identification.result import Curve, Identified, Procedure, complete, unfit
from workbench.identification.settled import settled
from workbench.identification.sliding import (
    BreakAway,
    SteadyRun,
    break_aways,
    breaking_forces,
    motion,
    speeds,
    steady_run,
)
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.units import public_name

LEAST_SPEEDS = 2  # in each direction: Coulomb and viscous part
SPEEDS_OF_FALL = 3  # in one direction: these, and the fall of the curve
SLOW = 3.0  # Stribeck velocities: a run below shows the fall of the curve
LEAST_DEVIATION_N = 0.3  # of a force: two pressures and how they are averaged
ONSET_M_S, FAR_M_S = 1e-6, 10.0  # where friction is static, and where no Stribeck peak is left
WEIGHT_LEAN = 1.0  # how far the weights of the asymmetry lie from the rig's
FALL_UNKNOWN = 0.5  # share of the Stribeck velocity that is not known where two speeds are all
FREE = ("coulomb_force_n", "viscous_n_s_m", "asymmetry", "coulomb_weight")
STATIC = ("stiction_excess_n", "excess_weight")
FALL = "stribeck_velocity_m_s"


@dataclass(frozen=True, kw_only=True)
class FrictionMap(Identified):
    """The map: runs, break-aways, and ``curves`` with force against speed.

    ``shape`` is the fitted curve on a fine grid of speeds, (2, n): speed and force.
    """

    runs: tuple[SteadyRun, ...]
    break_aways: tuple[BreakAway, ...]
    shape: np.ndarray


@dataclass(frozen=True)
class _Law:
    """The plant's own friction in steady sliding as functions of some of its parameters."""

    effect: StribeckFriction
    free: tuple[str, ...]
    force: ca.Function
    told: ca.Function


def friction(rig: Rig, recordings: Sequence[Recording]) -> FrictionMap:
    """Friction by direction from runs at constant speed, and from stick-slip where recorded.

    Raises
    ------
    InputError
        If the plant has no such friction, a recording holds neither a steady run nor a
        break-away, or one direction has fewer than two runs.
    """
    complete(recordings)
    plant = rig.fit_for(recordings[0])
    effect = _friction(plant)
    runs: list[SteadyRun] = []
    breaks: list[BreakAway] = []
    for piece in (piece for each in recordings for piece in each.pieces):
        moved = motion(plant, effect, piece)
        run, starts = steady_run(moved), break_aways(moved)
        if run is None and not starts:
            what = "shows no friction: neither a steady speed over 60 mm nor a break-away from rest"
            raise unfit(piece, what, PROCEDURE.manoeuvre)
        if run is not None:
            runs.append(run)
        else:
            breaks += starts
    _check_directions(recordings, runs, breaks)
    shown = [f"{effect.name}.{name}" for name in _free(effect, runs, breaks)]
    free = [name for name in shown if name not in rig.fixed]
    if not free:
        names = f"one of {listed(map(public_name, shown))} free"
        raise InputError(Message("fixes all that these recordings tell", rig.name, names))
    told, found, doubts = settled(
        rig, free, lambda names: _fitted(_law(effect, _fields(names)), runs, breaks)
    )
    law = _law(effect, _fields(told))
    found = _unsure(found, law, runs, breaks)
    estimates = _told(law, found)
    return FrictionMap(
        rig=rig,
        estimates=(*estimates, *rule(estimates)),
        parameters=(*_parameters(law, found), *bristle(effect, estimates)),
        curves=(_curve(law, found, runs),),
        runs=tuple(runs),
        break_aways=tuple(breaks),
        shape=_shape(law, found, runs),
        doubts=doubts,
    )


def _friction(plant: Plant) -> StribeckFriction:
    found = [e for e in plant.effects if isinstance(e, StribeckFriction) and not e.against]
    positions = {name for name in plant.state_list if name.endswith("position_m")}
    if not found or f"{found[0].body}.position_m" not in positions:
        what = "has no friction at a body whose position is recorded"
        raise InputError(Message(what, plant.name, "a rig of a drive or a cylinder"))
    return found[0]


def _check_directions(
    recordings: Sequence[Recording], runs: list[SteadyRun], breaks: list[BreakAway]
) -> None:
    source = ", ".join(dict.fromkeys(each.source or each.name for each in recordings))
    forward = sum(run.velocity_m_s > 0 for run in runs)
    if min(speeds(runs, way) for way in (True, False)) < LEAST_SPEEDS:
        what = f"{forward} runs forward and {len(runs) - forward} back are no friction map"
        expected = f"runs at {LEAST_SPEEDS} constant speeds or more in each direction"
        raise InputError(Message(what, expected=expected, file=source))
    if breaks and len({each.forward for each in breaks}) < 2:
        way = "forward" if breaks[0].forward else "back"
        what = f"all {len(breaks)} break-aways go {way}"
        raise InputError(Message(what, expected="some in each direction, or none", file=source))


def _free(
    effect: StribeckFriction, runs: list[SteadyRun], breaks: list[BreakAway]
) -> tuple[str, ...]:
    """The law's own parameters that such recordings may tell."""
    many = max(speeds(runs, way) for way in (True, False)) >= SPEEDS_OF_FALL
    falls = breaks and many and _is_slow(effect, runs)
    return (*FREE, *(STATIC if breaks else ()), *((FALL,) if falls else ()))


def _fields(names: Iterable[str]) -> tuple[str, ...]:
    """Names without that of their member."""
    return tuple(name.rpartition(".")[2] for name in names)


def _law(effect: StribeckFriction, free: tuple[str, ...]) -> _Law:
    """The law with symbols for what is free; forces that vary along the stroke average out.

    What pressure adds is not in the runs' friction, and so not in the law either.
    """
    theta = {name: ca.SX.sym(name) for name in free}
    symbolic = replace(effect, position_share=0.0, pressure_factor_n_pa=0.0, **theta)
    v, unknown = ca.SX.sym("v"), ca.vertcat(*theta.values())

    def at(velocity: ca.SX | float) -> Conditions:
        now = Conditions()
        now.place(f"{effect.body}.velocity_m_s", velocity)
        now.place(f"{effect.body}.position_m", 0.0)
        for chamber in effect.chambers:
            now.place(f"{chamber}.pressure_pa", 0.0)
        return now

    force = ca.Function("force", [v, unknown], [symbolic.steady_force_n(at(v))])
    told = [
        value
        for side in (1.0, -1.0)
        for value in (
            symbolic.dry_force_n(at(side * ONSET_M_S)),
            symbolic.dry_force_n(at(side * FAR_M_S)),
            side * symbolic.viscous_force_n(side),
        )
    ]
    rows = ca.vertcat(*told)
    return _Law(
        effect, free, force, ca.Function("told", [unknown], [rows, ca.jacobian(rows, unknown)])
    )


def _fitted(law: _Law, runs: list[SteadyRun], breaks: list[BreakAway]) -> Solution:
    points = [(r.velocity_m_s, r.force_n, r.deviation_n) for r in runs]
    for forward, size, spread in breaking_forces(breaks):
        side = 1.0 if forward else -1.0
        points.append((side * ONSET_M_S, side * size, spread))
    speed, force, deviation = np.array(points).T
    weight = 1.0 / np.maximum(deviation, LEAST_DEVIATION_N)
    effect, known = law.effect, law.effect.parameters()
    unknowns = []
    for name in law.free:
        own, parameter = float(getattr(effect, name)), known[name]
        lean = WEIGHT_LEAN if name.endswith("_weight") else inf
        scale = max(0.1 * abs(own), 0.05 * parameter.typical, 1e-3)
        unknowns.append(Unknown(own, scale, parameter.lower, parameter.upper, lean))
    evaluate = law.force.map(len(speed))

    def residuals(x: np.ndarray) -> np.ndarray:
        columns = np.repeat(x[:, None], len(speed), axis=1)
        return weight * (force - evaluate(speed[None], columns).full().ravel())

    return solve(residuals, unknowns, noise=1.0)


def _unsure(found: Solution, law: _Law, runs: list[SteadyRun], breaks: list[BreakAway]) -> Solution:
    """The solution with what it moves by at another Stribeck velocity in its covariance.

    A second fit tells, since the fall is too far from linear for a slope.
    """
    if FALL in law.free or not (breaks and _is_slow(law.effect, runs)):
        return found
    own = law.effect.stribeck_velocity_m_s
    slower = replace(law.effect, stribeck_velocity_m_s=(1.0 + FALL_UNKNOWN) * own)
    moved = _fitted(_law(slower, law.free), runs, breaks).values - found.values
    return replace(found, covariance=found.covariance + np.outer(moved, moved))


def _is_slow(effect: StribeckFriction, runs: list[SteadyRun]) -> bool:
    return min(abs(run.velocity_m_s) for run in runs) < SLOW * effect.stribeck_velocity_m_s


def _told(law: _Law, found: Solution) -> tuple[Estimate, ...]:
    """Table 5 of the paper: static, Coulomb and viscous friction by direction."""
    values, slopes = (each.full() for each in law.told(found.values))
    deviations = np.sqrt(np.maximum(np.diag(slopes @ found.covariance @ slopes.T), 0.0))
    names = [
        f"{kind}_{way}_{unit}"
        for way in ("forward", "backward")
        for kind, unit in (("static", "n"), ("coulomb", "n"), ("viscous", "n_s_m"))
    ]
    return estimated(names, values.ravel(), deviations)


def _parameters(law: _Law, found: Solution) -> tuple[Estimate, ...]:
    names = (f"{law.effect.name}.{name}" for name in law.free)
    return estimated(names, found.values, found.deviations)


def _curve(law: _Law, found: Solution, runs: list[SteadyRun]) -> Curve:
    speed = np.array([run.velocity_m_s for run in runs])
    force = np.array([run.force_n for run in runs])
    fitted = np.array([float(law.force(v, found.values)) for v in speed])
    order = np.argsort(speed)
    return Curve(label="runs", along=speed[order], measured=force[order], fitted=fitted[order])


def _shape(law: _Law, found: Solution, runs: list[SteadyRun]) -> np.ndarray:
    top = 1.05 * max(abs(run.velocity_m_s) for run in runs)
    half = np.concatenate([[ONSET_M_S], np.geomspace(1e-3, top, 120)])
    speed = np.concatenate([-half[::-1], half])
    return np.array([speed, [float(law.force(v, found.values)) for v in speed]])


PROCEDURE = Procedure(
    name="friction",
    gives="Coulomb, static and viscous friction by direction, bristle",
    manoeuvre="one constant command per recording, both directions: several that slide at constant "
    "speed over the stroke, and some just outside the dead zone that stick and slip",
    channels="valve.command, slide.position and both pressures at 500 Hz or more",
    example="friction drive4.toml run_*.csv stick_*.csv -o drive5.toml --figures figures",
    source="paper 002 Figs. 13, 14, Table 5 (S002-4, S002-5, S002-6)",
    printed={
        "static_forward_n": 50.97,
        "coulomb_forward_n": 28.35,
        "viscous_forward_n_s_m": 46.01,
        "static_backward_n": 46.15,
        "coulomb_backward_n": 26.22,
        "viscous_backward_n_s_m": 42.18,
    },
    run=friction,
)
