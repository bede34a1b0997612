"""A sample of a Kalman filter as one function in machine code, for running sample by sample.

A step of a small plant takes microseconds, and so the price is in the calls: everything from the
old estimate to the new one is one CasADi function, compiled as a whole and called through buffers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from workbench.compiled import compiled
from workbench.plant_filter import PlantFilter

SPREAD, COVARIANCE = 1, 3  # places of the square matrices among arguments and results


class Updated(NamedTuple):
    """What a sample gives, X and P scaled, the others in SI units.

    X, P                   shapes (n_X,) and (n_X, n_X)
    state, covariance      of the plant's own states, shapes (n_x,) and (n_x, n_x)
    innovation, deviation  by output, shape (n_y,); what was not received is 0
    log_likelihood, nis    of what was received; nis is the innovation squared over its covariance
    """

    X: np.ndarray
    P: np.ndarray
    state: np.ndarray
    covariance: np.ndarray
    innovation: np.ndarray
    deviation: np.ndarray
    log_likelihood: float
    nis: float


class _WholeFilter(PlantFilter):
    """The same filter with its step in CasADi throughout, which can be compiled as a whole."""

    @cached_property
    def _advance(self) -> ca.Function:
        return self.advance


@dataclass(frozen=True)
class FilterUpdate:
    """Predict, then correct, in one call; ``filter`` must use every sample.

    The buffers are its own, so that two threads need one each.  What states gain in a sample is an
    argument, so that filters which differ in that alone share one function: that of ``like``.
    """

    filter: PlantFilter
    like: FilterUpdate | None = None

    def __call__(
        self, X: np.ndarray, P: np.ndarray, u: np.ndarray, y: np.ndarray, received: np.ndarray
    ) -> Updated:
        """Of the estimate one sample before, the command since then and what is measured now."""
        arguments, results, _ = self._buffers
        for place, value in zip(arguments, (X, P, u, y, received), strict=True):
            place[...] = value
        self.run()
        *arrays, likely, nis = results
        return Updated(*(each.copy() for each in arrays), float(likely[0]), float(nis[0]))

    @cached_property
    def run(self) -> Callable[[], None]:
        """The call alone, on what the buffers hold."""
        return self._buffers[2]

    def retuned(self, process_noise: Mapping[str, float]) -> FilterUpdate:
        """The same with other process noise; the function is there already."""
        return FilterUpdate(replace(self.filter, process_noise=process_noise), self)

    @cached_property
    def function(self) -> ca.Function:
        """(X, P, u, y, received, d, p, Q) -> :class:`Updated`, compiled where that can be done."""
        return self.like.function if self.like else compiled(self.built)

    @cached_property
    def built(self) -> ca.Function:
        """The same as CasADi has it."""
        own = {name: getattr(self.filter, name) for name in PlantFilter.__dataclass_fields__}
        whole = _WholeFilter(**own)
        n = len(whole.plant.scale)
        X, P, u, d, p, y, received = (
            ca.MX.sym(f"i{i}", *whole.correct.size_in(i)) for i in range(7)
        )
        Q = ca.MX.sym("Q", *whole.step_covariance.shape)
        ahead, spread, _ = whole.predict_gaining(X, P, u, d, p, Q)
        told = whole.correct_with_nis(ahead, spread, u, d, p, y, received)
        X1, P1, e, deviation, likely, nis = *told[:5], told[-1]
        size = ca.DM(whole.scale[:n])
        results = [X1, P1, X1[:n] * size, P1[:n, :n] * (size @ size.T), e, deviation, likely, nis]
        results = [ca.densify(each) for each in results]
        return ca.Function("update", [X, P, u, y, received, d, p, Q], results)

    @cached_property
    def _buffers(self) -> tuple:
        """Arrays that the function reads and writes, and what runs it; d, p and Q are set once."""
        f = self.function
        buffer, run = f.buffer()
        _, d, p = self.filter.plant.nominal
        arguments = [_empty(f.size_in(i), i == SPREAD) for i in range(f.n_in())]
        results = [_empty(f.size_out(i), i in (SPREAD, COVARIANCE)) for i in range(f.n_out())]
        for place, value in zip(
            arguments[5:], (d, p, self.filter.step_covariance.ravel()), strict=True
        ):
            place[...] = value
        for i, each in enumerate(arguments):
            if each.size:
                buffer.set_arg(i, _flat(each))
        for i, each in enumerate(results):
            buffer.set_res(i, _flat(each))
        return arguments[:5], results, _Run(run, (buffer, arguments, results))


class _Run(NamedTuple):
    """A call, with what must live as long as it does."""

    call: Callable[[], None]
    kept: tuple

    def __call__(self) -> None:
        self.call()


def _empty(shape: tuple[int, int], square: bool) -> np.ndarray:
    """Zeros in CasADi's order; what is not a square matrix, even of one row, is a vector."""
    return np.zeros(shape, order="F") if square else np.zeros(shape[0] * shape[1])


def _flat(array: np.ndarray) -> memoryview:
    """The numbers of an array as they lie in memory."""
    return memoryview(array.ravel(order="K"))
