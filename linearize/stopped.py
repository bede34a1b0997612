"""A mode for each end stop: what rests against it is held there until pressure pulls it off.

The spring of a stop (2e6 N/m) makes poles that no design wants; without its give the position and
the velocity are held.  The piston leaves where the force away from the stop beats static friction.

Source: physics.md 4.3 ({free, stop lo, stop hi}); set-valued contact as in 4.2, "hold at Neutral".
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linearize.axis import Travel
from linearize.cuts import Guard, Interval
from linearize.holding import PROBES, least_rate, whole_point
from linearize.modes import HybridModel, Mode
from linearize.reduction import LeftOut

NEAR = 1e-3  # of the range: nearer than this to a stop counts as being there

AT_STOPS = (
    LeftOut("sliding into a stop", "the mode at the stop", "the impact is over within 1 ms"),
    LeftOut("sliding off a stop", "the free slide", "a stop only pushes"),
    LeftOut(
        "sticking at a stop", "the mode at the stop", "static friction counts in what ends that one"
    ),
)
LOWER, UPPER = "at lower stop", "at upper stop"


def stop_cut(travel: Travel) -> tuple[Interval, ...]:
    """The two ends of the range, each of which holds what it stops."""
    low, high = travel.ends
    near, held = NEAR * (high - low), (travel.position, travel.velocity)
    return (
        Interval(travel.prefix + LOWER, -np.inf, low + near, low, held),
        Interval(travel.prefix + UPPER, high - near, np.inf, high, held),
    )


def guarded(hybrid: HybridModel, travel: Travel, mode: Mode) -> Mode:
    """The mode of a stop with what ends it: motion away, and a force that static friction loses to.

    The force is the rate of the velocity where friction hinders it most, affine in the pressures.
    What comes against the stop faster than it rests is stopped whatever the force: that speed
    outweighs what the supply's pressure can do.
    """
    others = [n for s, region in mode.box.items() if s != travel.position for n in region.holds]
    model = hybrid.model.holding(others)
    away = 1 if mode.box[travel.position].label == travel.prefix + LOWER else -1
    probes = away * np.linspace(travel.resting, travel.sliding, PROBES)
    column = model.states.index(travel.velocity)
    row = away * least_rate(model, whole_point(hybrid, mode), column, probes, away)
    names = (*model.states, *model.commands)
    pulled = {name: -float(w) for name, w in zip(names, row, strict=False) if w}
    supply_pa = float(model.quantities("supply.pressure_pa")(model.initial, model.plant.nominal[0]))
    strongest = max(abs(w) for name, w in pulled.items() if name.endswith("_pa")) * supply_pa
    pulled[travel.velocity] = -away * strongest / travel.resting
    guards = (Guard({travel.velocity: -away}, travel.resting), Guard(pulled, -float(row[-1])))
    return replace(mode, guards=(*mode.guards, *guards))


def stopped_signals(hybrid: HybridModel) -> set[str]:
    """The positions that some mode holds at an end stop."""
    return {
        signal
        for mode in hybrid.modes
        for signal, region in mode.box.items()
        if region.label.endswith((LOWER, UPPER))
    }


def has_stops(hybrid: HybridModel) -> bool:
    """True where some mode holds what rests against an end stop."""
    return bool(stopped_signals(hybrid))
