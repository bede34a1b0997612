"""Many runs of one model side by side, in lockstep on the lanes of the vector unit.

A fit asks for a few hundred windows of a plant with a few dozen sets of values.  In lanes all of
them take half to two thirds of the time, by how many steps are refined.  A step whose error does
not pass is refined in the lanes that need it while the others wait, as deep as
:mod:`workbench.rosenbrock` goes; so lanes of one window under different values go together, which
meet an end or break away at the same time.  Every lane gives what
:meth:`workbench.model.Model.run` gives, to the last bit.  A run that is lost, whose every step is
refined to the end, holds up the others of its lanes.
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

GROUPS_AT_ONCE = 4  # groups of lanes that a thread takes before it asks for more

DRIVER = Path(__file__).with_name("lockstep.c")


@dataclass(frozen=True)
class Lockstep:
    """Outputs of a model over windows of equal length; made by :func:`lockstep`.

    ``sizes`` are those of x, u, d, p and y.
    """

    sizes: tuple[int, ...]
    lanes: int
    _run: Callable[..., None] = field(repr=False)

    def __deepcopy__(self, memo: object) -> Lockstep:
        """Itself: it never changes, and its library has one address."""
        return self

    def __call__(
        self,
        x0: np.ndarray,
        u: np.ndarray,
        d: np.ndarray,
        p: np.ndarray,
        alike: int,
        threads: int,
    ) -> np.ndarray:
        """Outputs (n_y, runs L) of x0 (n_x, runs), u and d (n, runs L), and p (n_p, runs).

        The runs k, k + alike, k + 2 alike and so on, which meet the same, lie next to each other.

        Raises
        ------
        ValueError
            If the shapes do not fit, there are no runs, or ``alike`` does not divide their number.
        """
        runs = x0.shape[1]
        if not runs or runs % alike:
            raise ValueError(f"lockstep takes runs by {alike}, given are {runs}")
        length = u.shape[1] // runs
        shapes = zip(self.sizes, (runs, runs * length, runs * length, runs), strict=False)
        for rows, shape in zip((x0, u, d, p), shapes, strict=True):
            if rows.shape != shape:
                raise ValueError(f"lockstep takes {shape}, given is {rows.shape}")
        given = [np.ascontiguousarray(rows.T, dtype=float) for rows in (x0, u, d, p)]
        y = np.empty((runs * length, self.sizes[-1]))
        order = np.arange(runs).reshape(-1, alike).T.ravel().copy()
        groups = -(-runs // self.lanes)
        size = self.lanes * max(min(GROUPS_AT_ONCE, groups // (2 * threads)), 1)
        parts = [order[k : k + size] for k in range(0, runs, size)]

        def run(part: np.ndarray) -> None:
            self._run(len(part), address(part), length, *map(address, given), address(y))

        if len(parts) == 1:
            run(parts[0])
            return y.T
        with ThreadPoolExecutor(threads) as several:
            list(several.map(run, parts))
        return y.T


def lockstep(model: Model, sample_time_s: float) -> Lockstep | None:
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
    run = declared(found.run, [count, place, count, *[place] * 5])
    return Lockstep(sizes, found.lanes(), run)
