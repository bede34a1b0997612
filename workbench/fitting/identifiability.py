"""Which parameters a recording can tell, before anything is fitted to it.

The sensitivity of all windows at the priors, start states projected out: its rank, and by how much
it would sharpen each prior.

Source: Ljung, System Identification, 2nd ed., 4.5 and 9.2; diagnosis.md 1.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.fitting.linearised import Point, linearise
from workbench.fitting.noise import measured_noise
from workbench.fitting.posterior import FLAT
from workbench.fitting.problem import staged
from workbench.fitting.unknowns import nominal_unknowns
from workbench.fitting.window_length import window_length_s
from workbench.fitting.windows import cut_windows, one_clock
from workbench.recording import Recording
from workbench.rig import Rig

MOST_WINDOWS = 24
NOTHING = 1e-6  # of the largest singular value: below it a direction is not seen at all


@dataclass(frozen=True)
class Identifiability:
    """What a recording tells of the uncertain parameters of a rig.

    names       full names, in the order of ``share``
    share       posterior over prior standard deviation, (n_p,)
    rank        of the sensitivity
    """

    names: tuple[str, ...]
    share: np.ndarray
    rank: int

    @property
    def flat(self) -> tuple[str, ...]:
        """Those that keep their prior."""
        return tuple(n for n, s in zip(self.names, self.share, strict=True) if s > FLAT)


def identifiability(rig: Rig, train: Sequence[Recording]) -> Identifiability:
    """Rank and sharpening of the priors, at the rig's own values.

    Raises
    ------
    ValueError
        If the recordings hold no whole window, differ in their sample times, or show no noise.
    """
    one_clock(train)
    whole = rig.fit_for(train[0])
    added = rig.added_to(whole)
    plant = staged(whole, *(c.member for c in added))
    unknowns = nominal_unknowns(plant, rig.deviations, rig.held, added)
    if not len(unknowns):
        return Identifiability((), np.zeros(0), 0)
    noise = measured_noise(train, plant.measured)
    windows = cut_windows(plant, train, noise, window_length_s(plant, train), MOST_WINDOWS)
    windows = windows.rescaled(windows.residuals([plant], windows.start)[0])
    at = linearise(windows, unknowns, Point(np.zeros(len(unknowns)), windows.start))
    rows = at.projected(at.parameters)
    sensitivity = rows.reshape(-1, rows.shape[2])
    sizes = np.linalg.svd(sensitivity, compute_uv=False)
    information = sensitivity.T @ sensitivity + np.diag(unknowns.precision)
    spread = np.sqrt(np.diag(np.linalg.inv(information)) * unknowns.precision)
    return Identifiability(unknowns.names, spread, int(np.sum(sizes > NOTHING * sizes[0])))
