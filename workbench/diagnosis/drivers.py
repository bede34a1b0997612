"""What a missing term may follow: states, inputs and their rates, pressures together, flows.

A leak across a piston goes by the difference of two pressures, a valve that passes too little by
its own flow, a wrong critical ratio by how near to choked that flow is: none of these is a state.

Source: diagnosis.md 1.3.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import casadi as ca
import numpy as np

from workbench.called import result
from workbench.diagnosis.missing_term import Course
from workbench.plant import Plant

PRESSURE = ".pressure_pa"
ALIKE = 0.98  # rank correlation from which two variables are one


def drivers(plant: Plant, course: Course, time_s: np.ndarray) -> dict[str, np.ndarray]:
    """Each variable by name along a course, shape (n,), in SI.

    ``plant`` is the one that the course is of; ``time_s`` holds its times, shape (n,).  What is not
    finite somewhere is left out, and of pressures together what orders the samples as something
    before it does: a constant supply less a pressure says no more than that pressure.
    """
    model = plant.model
    found = dict(zip(model.states, course.states, strict=True))
    found |= zip(model.measured_inputs, course.measured, strict=True)
    pressures = {name: row for name, row in found.items() if name.endswith(PRESSURE)}
    for name, command in zip(model.commands, course.commands, strict=True):
        found |= {name: command, f"rate of {name}": np.gradient(command, time_s)}
    found |= _flows(plant, course)
    found = {name: values for name, values in found.items() if np.isfinite(values).all()}
    ranks = [_ranks(values) for values in found.values()]
    for name, values in _together(pressures).items():
        own = _ranks(values)
        if np.isfinite(values).all() and all(abs(own @ each) < ALIKE for each in ranks):
            found[name] = values
            ranks.append(own)
    return found


def _ranks(values: np.ndarray) -> np.ndarray:
    """Places of the samples in their order, without mean and of length one, (n,)."""
    places = np.argsort(np.argsort(values, kind="stable"), kind="stable").astype(float)
    away = places - places.mean()
    return away / max(float(np.linalg.norm(away)), 1e-300)


def _together(pressures: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Differences and ratios of every two pressures."""
    found = {}
    for (one, first), (other, second) in combinations(pressures.items(), 2):
        places = one.removesuffix(PRESSURE), other.removesuffix(PRESSURE)
        found[" less ".join(places) + PRESSURE] = first - second
        ratio = np.divide(first, second, out=np.full_like(first, np.nan), where=second > 0.0)
        found[" over ".join(places) + ".pressure_ratio"] = ratio
    return found


def _flows(plant: Plant, course: Course) -> dict[str, np.ndarray]:
    """What each valve or line lets into each place, and how near to choked the larger part is."""
    model = plant.model
    if not model.paths:
        return {}
    wanted = ca.vertcat(*(e for path in model.paths for e in (path.flow_kg_s, path.choked_share)))
    give = ca.Function("along", [*model.symbols], [wanted]).map(course.states.shape[1])
    p = np.tile(plant.nominal[2][:, None], course.states.shape[1])
    rows = result(give, course.states, course.commands, course.measured, p)
    found = {}
    for way in dict.fromkeys((path.effect, path.balance) for path in model.paths):
        own = [k for k, path in enumerate(model.paths) if (path.effect, path.balance) == way]
        flows, shares = rows[[2 * k for k in own]], rows[[2 * k + 1 for k in own]]
        larger = np.abs(flows).argmax(axis=0)
        name = " into ".join(way)
        found[f"{name}.flow_kg_s"] = flows.sum(axis=0)
        found[f"{name}.share_of_choked_flow"] = np.take_along_axis(shares, larger[None], 0)[0]
    return found
