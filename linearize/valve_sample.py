"""One solenoid valve alone, sample by sample: what its two seats pass after its commands.

Coil and armature do not feel the gas, so that a valve can be run beside the rest of the plant.  The
two seats are told apart: on its way the armature leaves one of them before it comes near the other,
so that for a millisecond both are open.

Source: physics.md 2.5 (coil, armature, and what the ports pass).
"""

from __future__ import annotations

from collections.abc import Iterable

import casadi as ca
import numpy as np

from workbench.effect import Expression
from workbench.effects.solenoid_valve import SolenoidValve
from workbench.errors import InputError, Message
from workbench.plant import Plant
from workbench.rosenbrock import controlled_step

VALVES = ("valve_1", "valve_2")
FINER = 4  # instants of one sample over which the flow is averaged
CHARGING, VENTING = 0, 1  # rows of the flows and shares
STANDING_PA = 3e5  # chamber pressure under which the armature moves: that of a shift
PAST_STOP_M = 1.0  # lifts are cut at the stops: this is all that there is
AMBIENT, SUPPLY = "atmosphere.pressure_pa", "supply.pressure_pa"


def valve_sample(plant: Plant, valve: str, sample_time_s: float) -> ca.Function:
    """(x, command, p) -> (x one sample later, shares (2,)) of a valve of a lean plant.

    x are the states of the valve, p all parameters of the plant: one function serves plants that
    differ in these alone.  The shares, on the mean over the sample, are of the charging flow of a
    valve that has been energised for long and of the venting flow of one that has been released
    for long; the flow into the chamber is linear in them, but for a leak beside the seats, which
    both ends have.

    The force of the pressures on the armature, null in the plant of paper 003, is that at 3 bar.

    Raises
    ------
    InputError
        See :func:`ends_pa`.
    """
    ends_pa(plant)
    flows, step = _alone(plant, valve, sample_time_s / FINER)
    x, u, p = (ca.MX.sym(k, flows.numel_in(i)) for i, k in enumerate("xup"))
    place = _names(_effect(plant, valve)).index(f"{valve}.armature_position_m")
    released, energised = (_unit(x, place, end_m) for end_m in (0.0, PAST_STOP_M))
    none, all_ = flows(released, 0.0, p), flows(energised, 1.0, p)
    shut = ca.vertcat(none[CHARGING], all_[VENTING])
    wide = ca.vertcat(all_[CHARGING], none[VENTING]) - shut
    at, passed = x, 0.5 * flows(x, u, p)
    for k in range(FINER):
        at = step(at, u, ca.DM(0, 1), p)
        passed += flows(at, u, p) * (0.5 if k == FINER - 1 else 1.0)
    shares = (passed / FINER - shut) / wide
    return ca.Function("valve_sample", [x, u, p], [at, shares])


def valve_ends(plant: Plant, valve: str) -> np.ndarray:
    """States of a valve that has long been released and of one that has long been energised.

    Shape (n_x, 2).
    """
    effect = _effect(plant, valve)
    driven = effect.driven()
    ends = [(float(state.initial), float(driven[state.quantity])) for state in effect.states()]
    return np.array(ends)


def ends_pa(plant: Plant) -> tuple[float, float]:
    """Pressure of the atmosphere and of the supply, between which the valves of a plant work.

    Raises
    ------
    InputError
        If the supply is no higher than the atmosphere: then nothing flows.
    """
    read = ca.Function("read", [*plant.model.symbols], _ends_pa(plant))
    low_pa, high_pa = map(float, read(plant.initial, *plant.nominal))
    if not high_pa > low_pa:
        expected = f"more than the {1e-5 * low_pa:.3g} bar of the atmosphere"
        raise InputError(Message(f"is {1e-5 * high_pa:g} bar", SUPPLY, expected))
    return low_pa, high_pa


def standing(commands: Iterable[int]) -> list[float]:
    """Shares of valves that have stood for long under their commands, two for each."""
    return [float(share) for command in commands for share in (command, 1 - command)]


def _alone(plant: Plant, valve: str, step_s: float) -> tuple[ca.Function, ca.Function]:
    """Flows of (x, u, p) and step of (x, u, -, p), x that of the valve.

    The flows are those into a chamber at atmospheric pressure, which only charges, and at that of
    the supply, which only vents.
    """
    model, effect = plant.model, _effect(plant, valve)
    x, u, d, p = model.symbols
    own = [model.states.index(name) for name in _names(effect)]
    command = model.commands.index(f"{valve}.command")
    rest = [k for k in range(len(model.states)) if k not in own]
    others = [k for k in range(len(model.commands)) if k != command]
    chamber, mass = (
        model.states.index(f"{effect.chamber}.{q}") for q in ("pressure_pa", "mass_kg")
    )
    start = plant.initial

    def under(pressure_pa: Expression, what: ca.SX) -> ca.SX:
        at = ca.SX(start)
        at[mass] *= pressure_pa / start[chamber]
        at[chamber] = pressure_pa
        new = [at[rest], ca.SX.zeros(len(others)), ca.SX(ca.DM(plant.nominal[1]))]
        return ca.substitute([what], [x[rest], u[others], d], new)[0]

    flow = ca.SX(model.flows[valve, "MassFlow", effect.chamber])
    at_start = [ca.SX(ca.DM(each)) for each in (start, *plant.nominal[:2])]
    both_pa = ca.substitute(_ends_pa(plant), [x, u, d], at_start)
    flows = ca.vertcat(*(under(pressure_pa, flow) for pressure_pa in both_pa))
    passed = ca.Function("passed", [x[own], u[command], p], [flows])
    rates = under(STANDING_PA, model.rates[own])
    symbols = (x[own], u[command], ca.SX(0, 1), p)
    return passed, controlled_step(symbols, rates, step_s, model.tolerances[own])


def _ends_pa(plant: Plant) -> list[ca.SX]:
    """The same as expressions."""
    return [ca.SX(plant.model.conditions.read(name)) for name in (AMBIENT, SUPPLY)]


def _effect(plant: Plant, valve: str) -> SolenoidValve:
    (found,) = (e for e in plant.effects if isinstance(e, SolenoidValve) and e.name == valve)
    return found


def _names(effect: SolenoidValve) -> list[str]:
    return [f"{effect.name}.{state.quantity}" for state in effect.states()]


def _unit(x: ca.MX, place: int, value: float) -> ca.DM:
    """A state of zeros but for one."""
    found = ca.DM.zeros(x.numel())
    found[place] = value
    return found
