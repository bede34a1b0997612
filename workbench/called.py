"""Calls of CasADi functions on arrays, without a Python number for every value.

A call in CasADi's own way turns each array into a matrix of its own and each result into a list of
Python numbers on its way to NumPy.  For the outputs of a few hundred windows that takes as long as
their simulation.  Here the function reads and writes the arrays themselves.
"""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np


def called(function: ca.Function, *arguments: object) -> tuple[np.ndarray, ...]:
    """All results of a function as dense arrays, each of the shape of its output.

    A one-dimensional argument is a column; each must have the shape of its input.

    Raises
    ------
    ValueError
        If an argument has another shape than its input, or their number differs.
    RuntimeError
        If the function fails.
    """
    if len(arguments) != function.n_in():
        raise ValueError(f"{function.name()} takes {function.n_in()}, not {len(arguments)} inputs")
    buffer, evaluate = function.buffer()
    given = [_column_major(function, k, value) for k, value in enumerate(arguments)]
    results = [np.zeros(function.nnz_out(k)) for k in range(function.n_out())]
    for k, values in enumerate(given):
        buffer.set_arg(k, memoryview(values))
    for k, values in enumerate(results):
        buffer.set_res(k, memoryview(values))
    _evaluated(function, buffer, evaluate)
    return tuple(_dense(function.sparsity_out(k), values) for k, values in enumerate(results))


def prepared(function: ca.Function) -> Callable[..., list[np.ndarray]]:
    """:func:`called` for what is called at every sample: columns in, columns out, no checks.

    Arguments are contiguous columns of floats for dense inputs, results are new ones.  Not for
    several threads.
    """
    buffer, evaluate = function.buffer()
    lengths = [function.nnz_out(k) for k in range(function.n_out())]

    def call(*columns: np.ndarray) -> list[np.ndarray]:
        results = [np.empty(length) for length in lengths]
        for k, values in enumerate(columns):
            buffer.set_arg(k, memoryview(values))
        for k, values in enumerate(results):
            buffer.set_res(k, memoryview(values))
        _evaluated(function, buffer, evaluate)
        return results

    return call


class Curve:
    """A function of one number and one value for every sample, without checks or new arrays.

    Not for several threads.
    """

    def __init__(self, function: ca.Function) -> None:
        self._function = function
        self._given, self._found = np.zeros(1), np.zeros(1)
        self._buffer, self._evaluate = function.buffer()
        self._buffer.set_arg(0, memoryview(self._given))
        self._buffer.set_res(0, memoryview(self._found))

    def __call__(self, value: float) -> float:
        self._given[0] = value
        _evaluated(self._function, self._buffer, self._evaluate)
        return float(self._found[0])

    def __reduce__(self) -> tuple[type[Curve], tuple[ca.Function]]:
        """Another process makes its own buffer."""
        return Curve, (self._function,)


def result(function: ca.Function, *arguments: object) -> np.ndarray:
    """The first result of :func:`called`."""
    return called(function, *arguments)[0]


def _evaluated(
    function: ca.Function, buffer: ca.FunctionBuffer, evaluate: Callable[[], None]
) -> None:
    """Run what reads and writes the arrays of a buffer, and say so where it fails."""
    evaluate()
    if buffer.ret():
        raise RuntimeError(f"{function.name()} failed")


def _column_major(function: ca.Function, place: int, value: object) -> np.ndarray:
    """Values that the function reads for one input, column by column."""
    pattern = function.sparsity_in(place)
    given = np.asarray(value, dtype=float)
    given = given[:, None] if given.ndim == 1 else np.atleast_2d(given)
    if given.shape != pattern.shape:
        raise ValueError(
            f"{function.name()}: input {function.name_in(place)} has shape {pattern.shape}, "
            f"given is {given.shape}"
        )
    if pattern.is_dense():
        return np.ascontiguousarray(given.T).ravel()
    return np.ascontiguousarray(given[np.array(pattern.row(), dtype=int), _columns(pattern)])


def _dense(pattern: ca.Sparsity, values: np.ndarray) -> np.ndarray:
    if pattern.is_dense():
        return values.reshape(pattern.shape, order="F")
    found = np.zeros(pattern.shape)
    found[np.array(pattern.row(), dtype=int), _columns(pattern)] = values
    return found


def _columns(pattern: ca.Sparsity) -> np.ndarray:
    """Column of every stored value."""
    return np.array(pattern.get_col(), dtype=int)
