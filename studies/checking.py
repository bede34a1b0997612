"""A rig's closed loop with designs from files, also over plants drawn from its uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from controllers.design_file import read_design
from studies.closed_loop_check import SCENARIOS, Check, check
from studies.closed_loop_figures import check_figures
from studies.figures.style import styled
from workbench.plant import Plant, require
from workbench.rig import Rig

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DRAWS = 1000  # of one parameter until it lies within its bounds


def check_rig(
    rig: Rig,
    designs: Iterable[Path],
    estimators: Iterable[str],
    scenarios: Iterable[str] = (),
    runs: int = 1,
    progress: Callable[[str], None] = lambda message: None,
) -> Check:
    """Designs of files against the rig's plant; from the second run on, against drawn ones.

    Raises
    ------
    KeyError
        If a scenario or an estimator does not exist.
    """
    names = tuple(scenarios) or tuple(SCENARIOS)
    require(names, SCENARIOS, "the list of scenarios")
    controllers = {path.stem: read_design(path).controller for path in designs}
    rows, records, rng = [], [], np.random.default_rng(0)
    for number in range(runs):
        progress(f"closed loop, run {number + 1} of {runs}")
        plant = drawn(rig, rng) if number else rig.plant
        found = check(plant, controllers, estimators, names, believed=rig.plant, seed=number)
        mark = f" {number + 1}" if runs > 1 else ""
        rows += [replace(row, design=row.design + mark) for row in found.rows]
        records += found.records
    return Check(tuple(rows), tuple(records))


def drawn(rig: Rig, rng: np.random.Generator) -> Plant:
    """The plant with every uncertain parameter drawn anew, within its bounds."""
    plant, values = rig.plant, {}
    for name, value in plant.values.items():
        known, deviation = plant.parameters[name], rig.standard_deviation(name)
        absent = known.null is not None and value == known.null
        if deviation <= 0.0 or absent or name in rig.fixed:
            continue
        draws = value + deviation * rng.standard_normal(DRAWS)
        inside = draws[(draws >= known.lower) & (draws <= known.upper)]
        values[name] = float(inside[0]) if len(inside) else value
    return plant.with_values(values)


def styled_figures(found: Check) -> dict[str, Figure]:
    """The figures of a check in the common style."""
    with styled():
        return check_figures(found)
