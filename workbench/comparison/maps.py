"""Maps of the error: RMS in cells over position and speed, and over command and pressure.

A cell with few samples tells of chance, and stays empty.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from workbench.comparison.course import Course

CELLS = 6, 20  # fewest and most along each axis
TYPICAL = 20  # samples of a cell, were they spread evenly
FEWEST = 5  # samples of a cell that is shown
OUTER_SHARE = 2e-3  # of the samples beyond either end of an axis: spikes of a slope


@dataclass(frozen=True)
class ErrorMap:
    """RMS error of one output over two quantities, all in SI.

    Attributes
    ----------
    x_name, y_name, output
        Full names.
    x_edges, y_edges
        Of the cells, (n_x + 1,) and (n_y + 1,).
    rms
        Shape (n_x, n_y), NaN where there are too few samples.
    """

    x_name: str
    y_name: str
    output: str
    x_edges: np.ndarray
    y_edges: np.ndarray
    rms: np.ndarray


def motion_maps(course: Course, errors: Mapping[str, np.ndarray]) -> tuple[ErrorMap, ...]:
    """Every output over position and speed; with several places, each place's own alone."""
    places, found = course.places, []
    for place in places:
        own = [name for name in errors if len(places) == 1 or name == place.name]
        x, y = (place.name, place.value), (place.speed_name, place.speed)
        found += [error_map(x, y, (name, errors[name])) for name in own]
    return tuple(each for each in found if each)


def command_maps(course: Course, errors: Mapping[str, np.ndarray]) -> tuple[ErrorMap, ...]:
    """The error of every pressure over the recorded command that moves it, and the pressure."""
    recording, found = course.recording, []
    for command, pressure in _fed(course):
        x, y = ((name, recording[name]) for name in (command, pressure))
        found.append(error_map(x, y, (pressure, errors[pressure])))
    return tuple(each for each in found if each)


def error_map(
    x: tuple[str, np.ndarray], y: tuple[str, np.ndarray], error: tuple[str, np.ndarray]
) -> ErrorMap | None:
    """RMS of an error in cells over two quantities: full name and samples (n,) of each.

    None where no cell holds enough samples.
    """
    seen = np.isfinite([x[1], y[1], error[1]]).all(axis=0)
    if not seen.any():
        return None
    values = [samples[seen] for _, samples in (x, y)]
    edges = [_edges(each) for each in values]
    size, *_ = np.histogram2d(*values, bins=edges, weights=error[1][seen] ** 2)
    count, *_ = np.histogram2d(*values, bins=edges)
    enough = count >= FEWEST
    if not enough.any():
        return None
    rms = np.sqrt(np.where(enough, size, np.nan) / np.where(enough, count, 1.0))
    return ErrorMap(x[0], y[0], error[0], *edges, rms)


def _edges(values: np.ndarray) -> np.ndarray:
    """Equal cells over what occurs; over its levels where a quantity takes two values only."""
    levels = np.unique(values)
    if len(levels) == 1:
        return levels[0] + np.array([-0.5, 0.5])
    if len(levels) == 2:
        half = (levels[1] - levels[0]) / 2.0
        return levels[0] + half * np.array([-1.0, 1.0, 3.0])
    low, high = np.quantile(values, [OUTER_SHARE, 1.0 - OUTER_SHARE])
    low, high = (low, high) if high > low else (levels[0], levels[-1])
    cells = int(np.clip(np.sqrt(len(values) / TYPICAL), *CELLS))
    return np.linspace(low, high, cells + 1)


def _fed(course: Course) -> Iterator[tuple[str, str]]:
    """Commands with the measured pressures they feed; a single command feeds all."""
    plant = course.plant
    pressures = [name for name in plant.measured if name.endswith(".pressure_pa")]
    for command in plant.model.commands:
        member = command.rpartition(".")[0]
        fed = {balance for effect, _, balance in plant.model.flows if effect == member}
        alone = len(plant.commands) == 1
        for pressure in pressures:
            if alone or pressure.rpartition(".")[0] in fed:
                yield command, pressure
