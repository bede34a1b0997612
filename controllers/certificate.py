"""Stability across modes: one quadratic Lyapunov function for all, or else a dwell time.

The modes are taken with their laws as sampled closed loops x[k+1] = A_i x[k].  Where gains are
mixed between modes, a mode has several: its own law and those that may be mixed in.  Since a loop
is linear in the law, what holds for each of them holds for every mix.

Common function.    A' P A < P for every loop of every mode: stable under any switching.
Dwell time.         A_i' P_i A_i < P_i and (A_i')^n P_j A_i^n < P_i for all i, j: stable if every
                    mode lasts n samples or longer, each with its own law.

Both are linear matrix inequalities.  A solver's answer is not taken for granted: what is certified
was checked by eigenvalues afterwards.  It concerns the deviation from the wanted motion, without
limits and without dry friction other than the constants of the modes.

Source: J. C. Geromel and P. Colaneri, "Stability and stabilization of discrete time switched
systems", Int. J. Control 79 (2006) 719, Theorem 1 (dwell time); S. Boyd et al., "Linear Matrix
Inequalities in System and Control Theory", SIAM 1994, Ch. 5 (common function).
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from scipy.linalg import LinAlgWarning, eigvalsh, solve_discrete_lyapunov

LONGEST = 1 << 14  # samples of dwell time that are still looked at
MOST = 1.0 - 1e-9  # that a function may keep of itself in a sample

Loops = Mapping[str, tuple[np.ndarray, ...]]
"""Closed loops by mode, its own law's first, each of shape (n, n)."""


@dataclass(frozen=True)
class Certificate:
    """What is proved of a set of modes under their laws.

    modes          that were asked for
    unstable       those whose own loop is unstable: nothing can be certified with them
    common         P of the common function, shape (n, n), None where there is none
    mixing         whether it holds under every mix of gains too, or with each mode's own law only
    decay_per_s    at which the root of that function shrinks at least
    breaking       pairs of modes that have no common function under every mix of their gains
    dwell_s        shortest time in a mode that is certified; 0 with a common function, None where
                   nothing is
    any_switching  whether every switching is certified: by one function, or as the dwell time is
                   one sample
    """

    modes: tuple[str, ...]
    unstable: tuple[str, ...]
    common: np.ndarray | None
    mixing: bool
    decay_per_s: float
    breaking: tuple[tuple[str, str], ...]
    dwell_s: float | None
    any_switching: bool = False


def certificate(loops: Loops, sample_time_s: float) -> Certificate:
    """The strongest statement that can be proved.

    First one function for every mix of gains, then one for each mode's own law, then a dwell time.
    """
    names = tuple(loops)
    unstable = tuple(name for name in names if _radius(loops[name][0]) >= 1.0)
    if unstable:
        return Certificate(names, unstable, None, False, 0.0, (), None)
    everything = [A for each in loops.values() for A in each]
    if (P := common_function(everything)) is not None:
        decay = _decay_per_s(P, everything, sample_time_s)
        return Certificate(names, (), P, True, decay, (), 0.0, True)
    breaking = tuple(
        (one, other)
        for one, other in combinations(names, 2)
        if common_function([*loops[one], *loops[other]]) is None
    )
    own = [loops[name][0] for name in names]
    if (P := common_function(own)) is not None:
        decay = _decay_per_s(P, own, sample_time_s)
        return Certificate(names, (), P, False, decay, breaking, 0.0, True)
    samples = dwell_samples(own)
    dwell_s = None if samples is None else samples * sample_time_s
    return Certificate(names, (), None, False, 0.0, breaking, dwell_s, samples == 1)


def common_function(loops: list[np.ndarray]) -> np.ndarray | None:
    """P with A' P A < P for all loops, shape (n, n), or None where none was found.

    Maximises by how much all of them shrink x'Px, in coordinates in which the first loop does so
    evenly: the poles of a slow integral and a fast lag are far apart.
    """
    import cvxpy as cp

    if any(_radius(A) >= 1.0 for A in loops):
        return None
    T = _coordinates(loops[0])
    moved = [np.linalg.solve(T, A @ T) for A in loops]
    n = len(T)
    P, gain = cp.Variable((n, n), symmetric=True), cp.Variable()
    shrinks = [P - A.T @ P @ A >> gain * np.eye(n) for A in moved]
    _solve(cp.Problem(cp.Maximize(gain), [P << np.eye(n), *shrinks]))
    if not _holds([(A, P.value, P.value) for A in moved]):
        return None
    back = np.linalg.inv(T)
    return back.T @ P.value @ back


def dwell_samples(loops: list[np.ndarray]) -> int | None:
    """Fewest samples in each loop for which stability is proved, None where there are none."""
    most = 1
    while not _dwells(loops, most):
        most *= 2
        if most > LONGEST:
            return None
    least = most // 2
    while most - least > 1:
        middle = (least + most) // 2
        least, most = (least, middle) if _dwells(loops, middle) else (middle, most)
    return most


def _dwells(loops: list[np.ndarray], samples: int) -> bool:
    """True when functions P_i were found, and checked, for this dwell time."""
    import cvxpy as cp

    n, T = len(loops[0]), [_coordinates(A) for A in loops]
    P, gain = [cp.Variable((n, n), symmetric=True) for _ in loops], cp.Variable()
    moves = {}
    for i, j in product(range(len(loops)), repeat=2):
        power = np.linalg.matrix_power(loops[i], 1 if i == j else samples)
        moves[i, j] = np.linalg.solve(T[j], power @ T[i])
    shrinks = [P[i] - M.T @ P[j] @ M >> gain * np.eye(n) for (i, j), M in moves.items()]
    _solve(cp.Problem(cp.Maximize(gain), [*(each << np.eye(n) for each in P), *shrinks]))
    return _holds([(M, P[j].value, P[i].value) for (i, j), M in moves.items()])


def _solve(problem) -> None:
    """Solve, and leave it to the check whether there is an answer, and how good it is."""
    import cvxpy as cp

    with warnings.catch_warnings(), suppress(cp.SolverError):
        warnings.simplefilter("ignore")
        problem.solve(solver=cp.CLARABEL)


def _holds(shrinks: list[tuple[np.ndarray, np.ndarray | None, np.ndarray | None]]) -> bool:
    """True when M' P M < Q, with P and Q positive, for each (M, P, Q)."""
    return all(
        P is not None
        and Q is not None
        and _positive(P)
        and _positive(Q)
        and _growth(M, P, Q) < MOST
        for M, P, Q in shrinks
    )


def _decay_per_s(P: np.ndarray, loops: list[np.ndarray], sample_time_s: float) -> float:
    most = max(_growth(A, P, P) for A in loops)
    return float(-np.log(most) / (2.0 * sample_time_s))


def _growth(M: np.ndarray, P: np.ndarray, Q: np.ndarray) -> float:
    """Largest ratio of x' M' P M x to x' Q x."""
    return float(eigvalsh(M.T @ P @ M, Q)[-1])


def _positive(P: np.ndarray) -> bool:
    least, *_, most = np.linalg.eigvalsh(P)
    return bool(least > 1e-12 * most)


def _coordinates(A: np.ndarray) -> np.ndarray:
    """T of x = T z: in z the function that A shrinks evenly, A' P A - P = -I, is the identity."""
    with warnings.catch_warnings():
        # Any coordinates do: what is found in them is tried on the loops.
        warnings.simplefilter("ignore", LinAlgWarning)
        P = solve_discrete_lyapunov(A.T, np.eye(len(A)))
    return np.linalg.inv(np.linalg.cholesky(P).T)


def _radius(A: np.ndarray) -> float:
    return float(np.abs(np.linalg.eigvals(A)).max())
