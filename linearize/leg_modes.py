"""Modes of a leg: by the region of every joint, and by how each of them slides or sticks.

A joint that sticks takes up what the others do to it, so each mode is that of the leg with its
sticking joints held; see :func:`linearize.coupling.with_reactions`.  At a point each joint slides
steadily or rests, and needs no friction for that.  There the pressures of a joint at rest meet
those that its valve lets in, and flow changes most steeply with pressure: a mode that is to follow
a joint at rest under an open valve needs a point with that valve open.

Source: physics.md 2.3 and 4.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain, product
from math import inf

import numpy as np

from linearize.axis import Axis, Box
from linearize.cuts import Interval, Region
from linearize.equilibrium import OperatingPoint, operating_point
from linearize.modes import HybridModel, Mode, Placing, hybrid_modes
from linearize.reduction import DesignModel, LeftOut, design_model
from linearize.stopped import AT_STOPS, guarded, stop_cut
from workbench.plant import Plant

HALVES = ("low", "high")
FINER = "they make 1728 modes in place of 216; --regimes has them"
NO_STOPS = LeftOut("joints at their stops", "free motion", FINER)
NO_VALVES = LeftOut("positions of the valves", "those of a steady slide or of rest", FINER)
NO_VALVES_BUT_AT_REST = LeftOut(
    "positions of the valves but where a joint sticks", "those of a steady slide", "8 times as many"
)
STICK = 1  # of the three regions of a friction cut


def leg_modes(plant: Plant, axes: tuple[Axis, ...]) -> HybridModel:
    """Halves of the range of each joint x {slide -, stick, slide +} of each: 216 modes of three."""
    axes = tuple(replace(axis, places=HALVES) for axis in axes)
    cuts: dict[str, tuple[Region, ...]] = {a.position: a.place_cut() for a in axes}
    cuts |= {axis.velocity: axis.friction_cut() for axis in axes}
    made = hybrid_modes(plant, cuts, leg_placing(axes), _model(plant, axes))
    return replace(made, no_modes=(NO_STOPS, NO_VALVES))


def leg_regimes(plant: Plant, axes: tuple[Axis, ...]) -> HybridModel:
    """Each joint {slide -, slide +, stick x its valve} x halves, or at a stop: 1728 modes of three.

    Stops come first, since where several modes hold the first one counts.
    """
    axes = tuple(replace(axis, places=HALVES) for axis in axes)
    model, modes = _model(plant, axes), []
    for kinds in product(*map(_kinds, axes)):
        cuts = {signal: regions for kind in kinds for signal, regions in kind.items()}
        made = hybrid_modes(plant, cuts, leg_placing(axes), model)
        at_stops = [axis for axis in axes if axis.velocity not in cuts]
        for mode in made.modes:
            for axis in at_stops:
                mode = guarded(made, axis, mode)
            modes.append(mode)
    return HybridModel(plant, model, tuple(modes), (*AT_STOPS, NO_VALVES_BUT_AT_REST))


def _kinds(axis: Axis) -> Iterator[dict[str, tuple[Region, ...]]]:
    """Cuts of one joint: at either stop, sliding either way, sticking under its valve."""
    for stop in stop_cut(axis):
        yield {axis.position: (stop,)}
    for k, friction in enumerate(axis.friction_cut()):
        valve = {axis.command: axis.valve_cut()} if k == STICK else {}
        yield {axis.position: axis.place_cut(), axis.velocity: (friction,), **valve}


def _model(plant: Plant, axes: tuple[Axis, ...]) -> DesignModel:
    pushes = {axis.velocity: axis.pressures[0] for axis in axes}
    return replace(design_model(plant), pushes=pushes)


def leg_placing(axes: tuple[Axis, ...]) -> Placing:
    """Each joint slides steadily, or its pressures carry it at rest, whatever the valve then does.

    A valve that is not in its region there is at the point of it, all else stays.  What no region
    cuts is at its initial angle, and at rest.
    """
    free, vanish = (tuple(chain(*names)) for names in zip(*(a.balanced for a in axes), strict=True))

    def placed(model: DesignModel, box: Box) -> OperatingPoint:
        points = {name: region.point for name, region in box.items()}
        moving = {axis.velocity: 0.0 for axis in axes}
        moving |= {name: value for name, value in points.items() if name in model.states}
        found = operating_point(model, moving, free, vanish)
        at = dict(
            zip((*model.states, *model.commands), (*found.state, *found.command), strict=True)
        )
        off = {n: points[n] for n in model.commands if n in box and not box[n].contains(at[n])}
        return operating_point(model, at | off) if off else found

    return placed


def joint_modes(plant: Plant, axes: tuple[Axis, ...]) -> HybridModel:
    """Of each joint {slide -, slide +} by place, the others held where the leg begins.

    A joint's mode has its own angle, speed, pressures and command only: the other cylinders do not
    move it while they hold.  What it leaves out stands at its point beside it.
    """
    model = design_model(plant)
    model = replace(model, pushes={axis.velocity: axis.pressures[0] for axis in axes})
    modes: list[Mode] = []
    for axis in axes:
        cuts: dict[str, tuple[Region, ...]] = {axis.velocity: axis.friction_cut()}
        cuts[axis.position] = axis.place_cut()
        others = (each for each in axes if each is not axis)
        cuts |= {each.velocity: (_held(each),) for each in others}
        made = hybrid_modes(plant, cuts, leg_placing(axes), model)
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
    names, point = (*mode.state_names, *mode.command_names), (*mode.state, *mode.command)
    whole = dict(zip(names, map(float, point), strict=True))
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
        elsewhere={n: v for n, v in whole.items() if n not in (*states, axis.command)},
    )
