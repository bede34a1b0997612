"""Fitting again without what the recordings do not tell."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from workbench.identification.estimate import estimated
from workbench.identification.least_squares import Solution
from workbench.identification.result import why_left
from workbench.rig import Rig
from workbench.units import public_name, written


def settled(
    rig: Rig, names: Sequence[str], fit: Callable[[Sequence[str]], Solution]
) -> tuple[list[str], Solution, tuple[str, ...]]:
    """Names of the parameters that a fit tells, the fit of these, and what to say of the others.

    What a rig keeps must be what the others were fitted to, so that they are fitted again.  The
    solution of ``fit`` begins with its names.
    """
    names, said = list(names), []
    while True:
        found = fit(names)
        n = len(names)
        every = estimated(names, found.values[:n], found.deviations[:n])
        why = next(((e.name, w) for e in every if (w := why_left(rig, e))), None)
        if why is None or n == 1:
            return names, found, tuple(said)
        bad, reason = why
        own = written(rig.plant.values[bad], bad)
        said.append(f"{public_name(bad)} stays {own} and the others are fitted to it: {reason}")
        names.remove(bad)
