"""Modes of a leg: by the region of every joint, and by how each of them slides or sticks.

The valves are not cut: at a point each joint slides steadily or rests, and needs no friction for
that.  A joint that sticks takes up what the others do to it, so each mode is that of the leg with
its sticking joints held; see :func:`linearize.coupling.with_reactions`.

Source: physics.md 2.3 and 4.3.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import chain
from math import inf

import numpy as np

from linearize.axis import Axis, Box
from linearize.cuts import Interval, Region
from linearize.equilibrium import OperatingPoint, operating_point
from linearize.modes import HybridModel, Mode, hybrid_modes
from linearize.reduction import DesignModel, LeftOut, design_model
from workbench.plant import Plant

HALVES = ("low", "high")
NO_STOPS = LeftOut("joints at their stops", "free motion", "the range of a leg ends before them")
NO_VALVES = LeftOut(
    "positions of the valves", "those of a steady slide", "they would make 27 times as many modes"
)


def leg_modes(plant: Plant, axes: tuple[Axis, ...]) -> HybridModel:
    """Halves of the range of each joint x {slide -, stick, slide +} of each: 216 modes of three."""
    model = design_model(plant)
    model = replace(model, pushes={axis.velocity: axis.pressures[0] for axis in axes})
    axes = tuple(replace(axis, places=HALVES) for axis in axes)
    cuts: dict[str, tuple[Region, ...]] = {a.position: a.place_cut() for a in axes}
    cuts |= {axis.velocity: axis.friction_cut() for axis in axes}

    def placed(model: DesignModel, box: Box) -> OperatingPoint:
        return _steady(model, axes, box)

    made = hybrid_modes(plant, cuts, placed, model)
    return replace(made, no_modes=(NO_STOPS, NO_VALVES))


def joint_modes(plant: Plant, axes: tuple[Axis, ...]) -> HybridModel:
    """Of each joint {slide -, slide +} by place, the others held where the leg begins.

    A joint's mode has its own angle, speed, pressures and command only: the other cylinders do not
    move it while they hold.
    """
    model = design_model(plant)
    model = replace(model, pushes={axis.velocity: axis.pressures[0] for axis in axes})
    modes: list[Mode] = []
    for axis in axes:
        cuts: dict[str, tuple[Region, ...]] = {axis.velocity: axis.friction_cut()}
        cuts[axis.position] = axis.place_cut()
        others = (each for each in axes if each is not axis)
        cuts |= {each.velocity: (_held(each),) for each in others}
        made = hybrid_modes(plant, cuts, lambda m, box: _steady(m, axes, box), model)
        modes += [_own(m, axis) for m in made.modes if axis.velocity in m.state_names]
    return HybridModel(plant, model, tuple(modes), (NO_STOPS, NO_VALVES))


def _held(axis: Axis) -> Interval:
    return Interval("", -inf, inf, 0.0, (axis.position, axis.velocity))


def _own(mode: Mode, axis: Axis) -> Mode:
    """What a mode says of one joint alone."""
    states = (axis.position, axis.velocity, *axis.pressures)
    x = [mode.state_names.index(name) for name in states]
    u = [mode.command_names.index(axis.command)]
    box = {name: mode.box[name] for name in (axis.velocity, axis.position)}
    return replace(
        mode,
        name=" ".join(region.label for region in box.values()),
        box=box,
        state_names=states,
        command_names=(axis.command,),
        A=mode.A[np.ix_(x, x)],
        B=mode.B[np.ix_(x, u)],
        C=mode.C[:, x],
        D=mode.D[:, u],
        state=mode.state[x],
        command=mode.command[u],
        drift=mode.drift[x],
        scale=mode.scale[x],
    )


def _steady(model: DesignModel, axes: tuple[Axis, ...], box: Box) -> OperatingPoint:
    """Each joint slides steadily, or its pressures carry it at rest."""
    given = {name: region.point for name, region in box.items()}
    free, vanish = zip(*(axis.balanced for axis in axes), strict=True)
    return operating_point(model, given, tuple(chain(*free)), tuple(chain(*vanish)))
