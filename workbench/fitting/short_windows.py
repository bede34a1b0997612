"""A way out of a poor valley: the parameters are fitted to shorter windows first.

Within a window errors pile up, and where parts meet or break away the cost is rough: a fit from the
priors may end in a valley in which every long window runs past its impacts at the wrong instants.
Windows of a tenth of the length start anew before that happens, and their cost is smooth; from
where they lead, windows of about twice the length know more of the parameters.  In two steps, a
tenth and a third, some gearbox actuators were left well above the noise.  The long windows are
weighed by what they leave from there, not by what the fit left that is to be bettered; where they
leave more than noise, points beside their end are tried as they were beside that of the fit.

Source: multiple shooting, Bock 1983, "Recent advances in parameter identification techniques for
ODE", whose short intervals widen the valley of the right parameters.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.fitting.begun_anew import begun_anew
from workbench.fitting.continued import continued
from workbench.fitting.errors import only_noise
from workbench.fitting.own_errors import ITERATIONS, better_of, by_own_errors
from workbench.fitting.problem import Problem, fitted_twice
from workbench.fitting.shaken import shaken
from workbench.fitting.window_length import FEWEST_SAMPLES, moves
from workbench.fitting.windows import cut_windows
from workbench.recording import Recording

SHARES = (0.1, 0.2, 0.4, 0.7)  # of the length of a window, one after the other


def better_from_short_windows(problem: Problem, train: Sequence[Recording]) -> Problem:
    """The problem with the fit that begins where short windows lead, if that one is better.

    Nothing is tried where only noise is left, nothing moves, or windows are short.
    """
    base = problem.base
    plant = base.windows.plant
    tenth = round(SHARES[0] * base.windows.length)
    if only_noise(base) or not moves(plant) or not len(base.unknowns) or tenth < FEWEST_SAMPLES:
        return problem
    t = _of_short_windows(problem, train)
    tried = fitted_twice(base.windows, base.unknowns, t)
    tried = begun_anew(by_own_errors(continued(tried, ITERATIONS)))
    tried = tried if only_noise(tried) else shaken(tried, ITERATIONS)
    better = better_of(base, tried)
    return problem if better is base else problem.with_base(better)


def _of_short_windows(problem: Problem, train: Sequence[Recording]) -> np.ndarray:
    """Scaled unknowns, from the priors over ever longer windows."""
    long, unknowns = problem.base.windows, problem.base.unknowns
    noise = dict(zip(long.plant.measured, long.noise.tolist(), strict=True))
    length_s = long.length * train[0].sample_time_s
    t = problem.at_priors
    for share in SHARES:
        windows = cut_windows(long.plant, train, noise, share * length_s, round(len(long) / share))
        t = continued(fitted_twice(windows, unknowns, t), ITERATIONS).point.t
    return t
