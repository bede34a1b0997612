"""What a rig was doing at each sample: valve, flow, motion, rest, ends, reversal, gear shift.

Regimes overlap: a sample may be "at rest" and "valve closed" at once.  Those that a recording does
not show are left out.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from workbench.comparison.course import Course, course_of
from workbench.comparison.gear_shift import phases
from workbench.comparison.motion import motion
from workbench.fitting.errors import in_units
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.starts import guessed_states
from workbench.plant import Plant, Signal
from workbench.recording import Recording
from workbench.simulation import arriving_at_rest
from workbench.units import display_scale, display_unit

OPEN_SHARE = 1e-3  # of the range of a command, behind the dead zone
NEAR_NULL_SHARE = 0.02  # likewise
CARRYING_SHARE = 0.1  # of the largest flow of the recording
CHOKED = 1.0 - 1e-6  # of the choked flow; rounding takes less, and 0.001 of the ratio no more


def regimes(plant: Plant, recording: Recording) -> dict[str, np.ndarray]:
    """Which samples belong to each regime, shape (n,) each; only those that the channels show.

    The plant comes with what is absent in it, or without.
    """
    return regimes_of(course_of(plant, recording))


def regimes_of(course: Course) -> dict[str, np.ndarray]:
    """The same for a course that is known already; names are words: ``valve into chamber b``."""
    found = _valve_sides(course) | _flows(course) | phases(course)
    several = len(course.places) > 1
    for place in course.places:
        own = motion(course, place)
        found |= {f"{place.member} {name}": each for name, each in own.items()} if several else own
    return {name.replace("_", " "): each for name, each in found.items() if each.any()}


def shares(chosen: Mapping[str, np.ndarray], squared: np.ndarray) -> dict[str, float]:
    """Share of the squared error (n,) that falls into each regime, largest first.

    Samples without an error are NaN and count for nothing.
    """
    total = float(np.nansum(squared))
    found = {
        name: float(np.nansum(squared[samples])) / total if total > 0 else 0.0
        for name, samples in chosen.items()
    }
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def equally_weighted(errors: np.ndarray) -> np.ndarray:
    """Squared error with the same weight for every output, (...,), of errors (n_y, ...) in SI.

    NaN where there is none.  In units of the noise a fine position sensor would outweigh every
    pressure.
    """
    squares = errors**2
    seen = np.isfinite(squares)
    total = np.nansum(squares, axis=tuple(range(1, squares.ndim)), keepdims=True)
    weighted = np.where(seen, squares, 0.0) / np.maximum(total, 1e-300)
    return np.where(seen.any(axis=0), weighted.sum(axis=0), np.nan)


def regime_shares(fit: Fit) -> dict[str, float]:
    """Share of the squared error of a fit by regime, over all its recordings.

    Outputs weigh alike, as in a comparison.  A fit weighs windows by the typical errors in such
    windows, and so those at rest a hundred times as much as full strokes: no user asks for that.
    """
    windows, plant = fit.windows, fit.plant.lean()
    known = (windows.weight > 0) & ~fit.unsimulated
    squares = equally_weighted(np.where(known, in_units(fit), np.nan))
    sums: dict[str, float] = {}
    done = 0
    for recording, firsts in zip(windows.recordings, windows.firsts, strict=True):
        squared = np.full(len(recording), np.nan)
        for k, first in enumerate(firsts, start=done):
            squared[first : first + windows.length] = squares[k]
        done += len(firsts)
        course = Course(fit.plant, plant, recording, *guessed_states(plant, recording))
        for name, samples in regimes_of(course).items():
            sums[name] = sums.get(name, 0.0) + float(np.nansum(squared[samples]))
    total = float(np.nansum(squares))
    found = {name: part / total if total > 0 else 0.0 for name, part in sums.items()}
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def _valve_sides(course: Course) -> dict[str, np.ndarray]:
    """Sides of each command as it arrives behind all that alters it, dead zone included."""
    plant = course.plant
    arriving = (plant.model.conditions.read(signal.name) for signal in plant.commands)
    rest, found = arriving_at_rest(plant), {}
    for signal, command in zip(plant.commands, course.along(*arriving), strict=True):
        found |= _sides(signal, command - rest[signal.name], _moves_gas(plant, signal))
    return found


def _sides(signal: Signal, away: np.ndarray, valve: bool) -> dict[str, np.ndarray]:
    """Sides by how far ``away`` from its rest a command arrives, named by where it rests."""
    member = signal.name.rpartition(".")[0]
    span = signal.upper - signal.lower if np.isfinite(signal.upper - signal.lower) else 1.0
    closed = OPEN_SHARE * span
    if signal.levels:
        return {f"{member} energised": away > closed, f"{member} released": away <= closed}
    unit, to_people = display_unit(signal.name), display_scale(signal.name).from_si
    centre = f"{to_people(signal.nominal):.4g} {unit}".strip()
    sides = {f"above {centre}": away > closed, f"below {centre}": away < -closed}
    if not valve:
        return {f"{member} {side}": samples for side, samples in sides.items()}
    near = (np.abs(away) > closed) & (np.abs(away) <= NEAR_NULL_SHARE * span)
    return {
        f"{member} closed": np.abs(away) <= closed,
        f"{member} near null": near,
        **{f"{member} open {side}": samples for side, samples in sides.items()},
    }


def _moves_gas(plant: Plant, signal: Signal) -> bool:
    """True where a command goes to what fills or vents something."""
    member = signal.name.rpartition(".")[0]
    kinds = {kind for effect, kind, _ in plant.model.flows if effect == member}
    return bool(kinds & {"MassFlow", "PressureRate"})


def _flows(course: Course) -> dict[str, np.ndarray]:
    """Choked or subsonic, for each path and direction while it carries flow.

    A valve that leaks or is underlapped fills and vents a chamber at once: it carries flow the way
    of what both leave, and where they cancel, none.
    """
    paths = course.plant.model.paths
    flows = course.along(*(path.flow_kg_s for path in paths))
    shares_of_choked = course.along(*(path.choked_share for path in paths))
    if not flows.size:
        return {}
    least = CARRYING_SHARE * float(np.nanmax(np.abs(flows)))
    net: dict[tuple[str, str], np.ndarray] = {}
    for path, flow in zip(paths, flows, strict=True):
        ends = (path.effect, path.balance)
        net[ends] = net.get(ends, np.zeros(len(flow))) + flow
    found: dict[str, np.ndarray] = {}
    for path, flow, share in zip(paths, flows, shares_of_choked, strict=True):
        left = net[path.effect, path.balance]
        for way, sign in (("into", 1.0), ("out of", -1.0)):
            carrying = (sign * flow > least) & (sign * left > least)
            name = f"{path.effect} {way} {path.balance}"
            for state, holds in (("choked", share >= CHOKED), ("subsonic", share < CHOKED)):
                key = f"{name} {state}"
                found[key] = found.get(key, np.zeros(len(flow), dtype=bool)) | (carrying & holds)
    return found
