"""Where a bench without states fails: the missing force is what its force sensor reads otherwise.

Nothing is integrated, so no smoother is needed: the error of the prior fit, sample by sample, is
what the one momentum balance lacks, and its curve against velocity is the friction that is missing.
The gain of log-likelihood is that of an input which leaves noise alone, n / 2 log(s^2 / noise^2)
with n independent samples and s^2 their mean square.

Source: diagnosis.md 1.3, of a plant whose balance has no rate.
"""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np

from workbench.comparison.regimes import regime_shares
from workbench.diagnosis.dependence import dependences, side
from workbench.diagnosis.drivers import drivers
from workbench.diagnosis.judge import effective_samples
from workbench.diagnosis.located import Where
from workbench.diagnosis.missing_term import Course
from workbench.effect import Balance
from workbench.fitting.errors import in_units, per_sample
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.window_cuts import cut_inputs
from workbench.fitting.windows import Windows

FORCE = ".force_n"
NOISE_KNOWN = 1.1  # times its square: beyond that an error is more than noise


def of_residual(base: Fit) -> Where | None:
    """The missing force of the prior fit of a bench; None where there are states or other outputs.

    Positive is what the sensor reads more than the model, in N.
    """
    windows, plant = base.windows, base.windows.plant
    if plant.state_list or [name[-len(FORCE) :] for name in plant.measured] != [FORCE]:
        return None
    seen = np.isfinite(windows.measured[0]).ravel()
    term = in_units(base)[0].ravel()[seen]
    fed = cut_inputs(plant, windows.recordings, windows.firsts, windows.length)
    u, d = (rows[:, seen] for rows in fed)
    course = Course("", "", np.zeros((0, int(seen.sum()))), u, d)
    time_s = _times(windows)[seen]
    followed = drivers(plant, course, time_s)
    ways = {name: side(values) for name, values in followed.items() if ".velocity_" in name}
    place = plant.measured[0].removesuffix(FORCE)
    balance = f"{place}.{Balance.MOMENTUM.value}"
    return Where(
        balance=balance,
        by_balance={balance: _gain(base)},
        term_name=FORCE.lstrip("."),
        time_s=time_s,
        term=term,
        term_deviation=np.full(len(term), windows.noise[0]),
        against=tuple(
            replace(each, neighbour=None) for each in dependences(followed, ways, term, term)
        ),
        by_regime=regime_shares(base),
    )


def _gain(base: Fit) -> float:
    """Log-likelihood that an input gains which explains all but noise."""
    return 0.5 * effective_samples(base) * log(max(per_sample(base) / NOISE_KNOWN, 1.0))


def _times(windows: Windows) -> np.ndarray:
    """Sample times window after window, one recording behind the other, (n,)."""
    begun, found = 0, []
    for recording, firsts in zip(windows.recordings, windows.firsts, strict=True):
        found += [begun + first + np.arange(windows.length) for first in firsts]
        begun += len(recording)
    return windows.recordings[0].sample_time_s * np.concatenate(found)
