"""What a residual is looked at against: position, velocity, command, pressure ratio."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from studies.text import labelled
from workbench.comparison.compare import RecordingComparison, signal_error
from workbench.comparison.course import course_of
from workbench.comparison.regimes import regimes_of
from workbench.fitting.errors import SignalError
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.units import display_scale, public_name

Regimes = Mapping[str, tuple["RegimeErrors", ...]]
SUPPLY = "supply.pressure_pa"


@dataclass(frozen=True)
class Driver:
    """One quantity along a recording, (n,), in the unit of its label."""

    label: str
    values: np.ndarray = field(repr=False)


@dataclass(frozen=True)
class RegimeErrors:
    """One regime: its shares of time and of the squared error, and the error of each output."""

    name: str
    share_of_time: float
    share_of_error: float
    errors: Mapping[str, SignalError]


def regime_errors(rig: Rig, recording: Recording, found: RecordingComparison) -> Regimes:
    """By horizon, the regimes of a recording, the largest share of the error first.

    Outputs count alike in a share, each over its own whole squared error.
    """
    chosen = regimes_of(course_of(rig.fit_for(recording), recording))
    by_horizon = {}
    for horizon, rows in found.simulated.items():
        errors = {name: (found.measured[name] - rows[name]) ** 2 for name in rows}
        sums = {name: max(float(np.nansum(each)), 1e-300) for name, each in errors.items()}
        regimes = []
        for regime, samples in chosen.items():
            shares = [float(np.nansum(errors[name][samples])) / sums[name] for name in errors]
            own = {
                name: signal_error(
                    found.measured[name][samples], rows[name][samples], found.noise[name].value
                )
                for name in rows
            }
            told = RegimeErrors(regime, float(samples.mean()), float(np.mean(shares)), own)
            regimes.append(told)
        by_horizon[horizon] = tuple(sorted(regimes, key=lambda each: -each.share_of_error))
    return by_horizon


def drivers_of(rig: Rig, recording: Recording) -> tuple[Driver, ...]:
    """Those of the four that the recording and its rig can tell, in that order."""
    plant = rig.fit_for(recording)
    found = []
    for place in course_of(plant, recording).places[:1]:
        found += [_driver(place.name, place.value), _driver(place.speed_name, place.speed)]
    for signal in plant.commands[:1]:
        found.append(_driver(signal.name, recording[signal.name]))
    return (*found, *_ratio(plant, recording))


def _driver(name: str, values: np.ndarray) -> Driver:
    return Driver(labelled(name), display_scale(name).from_si(values))


def _ratio(plant: Plant, recording: Recording) -> Iterator[Driver]:
    """The first chamber's pressure over the supply, or over the second where there is none."""
    pressures = [n for n in recording.channels if n.endswith("pressure_pa") and n != SUPPLY]
    if not pressures:
        return
    first, *others = pressures
    if SUPPLY in recording.channels:
        below, over = recording[SUPPLY], "supply"
    elif SUPPLY in plant.values:
        below, over = plant.values[SUPPLY], "supply"
    elif others:
        below, over = recording[others[0]], _words(others[0])
    else:
        yield _driver(first, recording[first])
        return
    yield Driver(f"pressure ratio {_words(first)} / {over} (-)", recording[first] / below)


def _words(name: str) -> str:
    return public_name(name).rpartition(".")[0].replace("_", " ")
