"""A way out of valleys above where a fit began: the plant as it came is a place like any other.

Where a slide leans on its stop, or sticks and breaks away, the cost is rough.  A fit may leave the
values that a rig came with for a place that a few windows like, and end in a dent that costs more
than those values cost with start states of their own: these it fitted only while parameters moved.
So the plant as it came gets its start states, and where it costs less than the fit, the fit begins
anew from there and can only fall.  A rig that was fitted before, or one with a good data sheet,
begins near the floor and is not left worse.
"""

from __future__ import annotations

import numpy as np

from workbench.fitting.continued import continued
from workbench.fitting.gauss_newton import Fit, fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.own_errors import ITERATIONS
from workbench.fitting.shaken import shaken
from workbench.fitting.start_states import as_it_came


def no_worse_than_it_came(fit: Fit) -> Fit:
    """The same fit, or a lower one of the same windows from the values that its plant came with."""
    if not len(fit.unknowns):
        return fit
    came, _ = as_it_came(fit, None)
    if not came.cost < fit.cost:
        return fit
    begun = Point(np.zeros(len(fit.unknowns)), came.point.starts)
    tried = fit_windows(fit.windows, fit.unknowns, begun, ITERATIONS)
    return shaken(continued(tried, ITERATIONS), ITERATIONS)
