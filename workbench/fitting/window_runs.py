"""The model run on windows of equal length, all of them side by side."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from workbench.called import result
from workbench.model import Model

THREADS = 2


@dataclass(frozen=True)
class WindowRuns:
    """Runs of a model over windows of ``length`` samples: in lanes, or by CasADi without any.

    Both use two threads and give the same to the last bit.
    """

    model: Model
    sample_time_s: float
    length: int

    def outputs(self, x0: np.ndarray, u: np.ndarray, d: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Outputs (n_y, runs L) of starts (n_x, runs), inputs (n, runs L) and values (n_p, runs).

        ``x0`` is the start as the sensors show it.
        """
        together = self.model.ensemble(self.sample_time_s)
        if together is None:
            return result(self._by_casadi(x0.shape[1]), x0, u, d, p)
        return together(self._begun(x0, u, d, p), u, d, p, THREADS)

    def ends(self, x0: np.ndarray, u: np.ndarray, d: np.ndarray, p: np.ndarray) -> np.ndarray:
        """States (n_x, runs) one sample after the last; arguments as those of :meth:`outputs`."""
        run = self.model.run(self.sample_time_s, self.length).map(x0.shape[1], "thread", THREADS)
        later = result(run, self._begun(x0, u, d, p), u, d, p)
        return later[:, self.length - 1 :: self.length]

    def _begun(self, x0: np.ndarray, u: np.ndarray, d: np.ndarray, p: np.ndarray) -> np.ndarray:
        """States (n_x, runs) at the first sample; arguments as those of :meth:`outputs`."""
        first = slice(None, None, self.length)
        return result(self._begin.map(x0.shape[1]), x0, u[:, first], d[:, first], p)

    def _by_casadi(self, runs: int) -> ca.Function:
        """So many runs; built once."""
        if runs not in self._built:
            self._built[runs] = self._run.map(runs, "thread", THREADS)
        return self._built[runs]

    @cached_property
    def _built(self) -> dict[int, ca.Function]:
        return {}

    @cached_property
    def _begin(self) -> ca.Function:
        """(x0, u, d, p) -> x at the first sample."""
        symbols = zip("xudp", self.model.symbols, strict=True)
        given = [ca.MX.sym(name, symbol.numel()) for name, symbol in symbols]
        return ca.Function("begin", given, [_behind_sensors(self.model, *given)])

    @cached_property
    def _run(self) -> ca.Function:
        """(x0, u, d, p) -> outputs over one window; u, d of L columns, result (n_y, L)."""
        model, length = self.model, self.length
        columns = (1, length, length, 1)
        x0, u, d, p = (
            ca.MX.sym(name, symbol.numel(), n)
            for name, symbol, n in zip("xudp", model.symbols, columns, strict=True)
        )
        x = _behind_sensors(model, x0, u[:, 0], d[:, 0], p)
        if model.states:
            later = model.run(self.sample_time_s, length - 1)
            x = ca.horzcat(x, later(x, u[:, :-1], d[:, :-1], p))
        else:
            x = ca.MX(0, length)
        y = model.h.map(length)(x, u, d, ca.repmat(p, 1, length))
        return ca.Function("window", [x0, u, d, p], [y])


def _behind_sensors(model: Model, seen: ca.MX, u: ca.MX, d: ca.MX, p: ca.MX) -> ca.MX:
    """The states behind those that sensors show: x - (y - x) where a state x is measured as y."""
    distorted = model.h(seen, u, d, p)
    rows = {name: k for k, name in enumerate(model.measured)}
    return ca.vertcat(
        ca.MX(0, 1),
        *(
            2.0 * seen[k] - distorted[rows[name]] if name in rows else seen[k]
            for k, name in enumerate(model.states)
        ),
    )
