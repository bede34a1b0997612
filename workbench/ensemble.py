"""Many runs of one model side by side, on the lanes of the vector unit.

A fit asks for a few hundred windows of a plant with a few dozen sets of values.  Beside CasADi's
own map lanes are 2.4 to 2.9 times as fast on a processor with eight of them (``pytest
tests/benchmarks/test_speed_of_ensemble.py -s --benchmark-enable``).  A step whose error does not
pass is refined as deep as :mod:`workbench.rosenbrock` goes, by its own lane: each is at its own
sample and its own step of it, all try theirs in one call, and a lane whose run is at its end takes
the next, so that none waits for another.  Every lane gives what :meth:`workbench.model.Model.run`
gives, to the last bit.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from workbench.lanes import address, declared, lane_library
from workbench.rosenbrock import FINER, LEVELS, checked_step, steps_of

if TYPE_CHECKING:
    from workbench.model import Model

DRIVER = Path(__file__).with_name("ensemble.c")


@dataclass(frozen=True)
class Ensemble:
    """Outputs of a model over windows of equal length; made by :func:`ensemble`.

    ``sizes`` are those of x, u, d, p and y.
    """

    sizes: tuple[int, ...]
    lanes: int
    _run: Callable[..., None] = field(repr=False)

    def __deepcopy__(self, memo: object) -> Ensemble:
        """Itself: it never changes, and its library has one address."""
        return self

    def __call__(
        self, x0: np.ndarray, u: np.ndarray, d: np.ndarray, p: np.ndarray, threads: int
    ) -> np.ndarray:
        """Outputs (n_y, runs L) of x0 (n_x, runs), u and d (n, runs L), and p (n_p, runs).

        Raises
        ------
        ValueError
            If the shapes do not fit or there are no runs.
        """
        runs = x0.shape[1]
        if not runs:
            raise ValueError("ensemble takes at least one run, given are 0")
        length = u.shape[1] // runs
        shapes = zip(self.sizes, (runs, runs * length, runs * length, runs), strict=False)
        for rows, shape in zip((x0, u, d, p), shapes, strict=True):
            if rows.shape != shape:
                raise ValueError(f"ensemble takes {shape}, given is {rows.shape}")
        given = [np.ascontiguousarray(rows.T, dtype=float) for rows in (x0, u, d, p)]
        y, taken = np.empty((runs * length, self.sizes[-1])), np.zeros(1, dtype=np.int64)
        threads = min(threads, runs)
        lanes = min(self.lanes, -(-runs // threads))
        states = np.empty((threads, lanes, length, self.sizes[0]))

        def run(own: np.ndarray) -> None:
            self._run(runs, length, lanes, *map(address, (*given, y, taken, own)))

        if threads == 1:
            run(states[0])
            return y.T
        with ThreadPoolExecutor(threads) as several:
            list(several.map(run, states))
        return y.T


def ensemble(model: Model, sample_time_s: float) -> Ensemble | None:
    """Runs of a model side by side; None where there is no compiler or an operation has no lanes.

    Build it once: its C is written and looked for in the cache at every call.
    """
    steps = steps_of(sample_time_s)
    sizes = (*(symbol.numel() for symbol in model.symbols), len(model.measured))
    numbers = {
        **dict(zip(("NX", "NU", "ND", "NP", "NY"), sizes, strict=True)),
        "STEPS": steps,
        "LEVELS": LEVELS,
        "FINER": FINER,
        "STEP_S": (sample_time_s / steps).hex(),
    }
    trial = checked_step(model.symbols, model.rates, model.tolerances)
    found = lane_library(DRIVER, numbers, {"trial": trial, "seen": model.h})
    if found is None:
        return None
    count, place = ctypes.c_longlong, ctypes.c_void_p
    run = declared(found.run, [count, count, ctypes.c_int, *[place] * 7])
    return Ensemble(sizes, found.lanes(), run)
