"""Modes of one cylinder: valve x flow regimes x friction x {free, stops}, or by place.

Source: physics.md 4.3.
"""

from __future__ import annotations

from linearize.axis import Axis
from linearize.cuts import Region
from linearize.modes import HybridModel, Mode, hybrid_modes
from linearize.reduction import DesignModel, LeftOut
from linearize.regimes import flow_regimes
from linearize.stopped import AT_STOPS, guarded, stop_cut
from workbench.plant import Plant

BACKFLOW = LeftOut(
    "choked flow back into the supply", "no mode", "no chamber comes to twice the supply pressure"
)
SHUT = LeftOut(
    "flow regimes with the valve shut", "one mode", "only a leak flows there, beside the motion"
)


def regime_modes(plant: Plant, axis: Axis, model: DesignModel) -> HybridModel:
    """Valve x regime of the flow into each chamber x {free: stick, slide +, slide -; two stops}.

    The regimes are those of the command at the point of its interval.
    """
    stopped, free = [], []
    for number, valve in enumerate(axis.valve_cut()):
        cuts: dict[str, tuple[Region, ...]] = {axis.command: (valve,)}
        if not (axis.shut and number == 1):
            sent = {axis.command: valve.point}
            regimes = {name: flow_regimes(model, name, sent) for name in axis.pressures}
            cuts |= {name: parts for name, parts in regimes.items() if parts}
        stopped += stop_modes(plant, axis, model, cuts)
        free += hybrid_modes(plant, cuts | _friction(axis), axis.point, model).modes
    left_out = (*AT_STOPS, BACKFLOW, *((SHUT,) if axis.shut else ()))
    return HybridModel(plant, model, (*stopped, *free), left_out)


def place_modes(plant: Plant, axis: Axis, model: DesignModel) -> HybridModel:
    """Valve x friction x place, and the two stops."""
    valve: dict[str, tuple[Region, ...]] = {axis.command: axis.valve_cut()}
    cuts = {**valve, **_friction(axis), axis.position: axis.place_cut()}
    free = hybrid_modes(plant, cuts, axis.point, model).modes
    return HybridModel(plant, model, (*stop_modes(plant, axis, model, valve), *free), AT_STOPS)


def stop_modes(
    plant: Plant, axis: Axis, model: DesignModel, cuts: dict[str, tuple[Region, ...]]
) -> list[Mode]:
    """The modes at both ends of the range for each box of these cuts."""
    made = (
        hybrid_modes(plant, {axis.position: (stop,), **cuts}, axis.point, model)
        for stop in stop_cut(axis)
    )
    return [guarded(hybrid, axis, mode) for hybrid in made for mode in hybrid.modes]


def _friction(axis: Axis) -> dict[str, tuple[Region, ...]]:
    return {axis.velocity: axis.friction_cut()}
