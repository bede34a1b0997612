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
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from scipy.linalg import LinAlgWarning, eigvalsh, solve_discrete_lyapunov

LONGEST = 1 << 14  # samples of dwell time that are still looked at
MOST = 1.0 - 1e-9  # that a function may keep of itself in a sample
JOINING = 4  # loops that join a problem at a time

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
        if not share_a_function([*loops[one], *loops[other]])
    )
    own = [loops[name][0] for name in names]
    if (P := common_function(own)) is not None:
        decay = _decay_per_s(P, own, sample_time_s)
        return Certificate(names, (), P, False, decay, breaking, 0.0, True)
    samples = dwell_samples(own)
    dwell_s = None if samples is None else samples * sample_time_s
    return Certificate(names, (), None, False, 0.0, breaking, dwell_s, samples == 1)


def common_function(loops: Sequence[np.ndarray]) -> np.ndarray | None:
    """P with A' P A < P for all loops, shape (n, n), or None where none was found.

    Maximises by how much all of them shrink x'Px, in coordinates in which the first loop does so
    evenly: the poles of a slow integral and a fast lag are far apart.
    """
    if any(_radius(A) >= 1.0 for A in loops):
        return None
    moved, T = _evenly(loops)
    P = _shrinking([Move(0, 0, A) for A in moved])
    if P is None:
        return None
    back = np.linalg.inv(T)
    return back.T @ P[0] @ back


def share_a_function(loops: Sequence[np.ndarray]) -> bool:
    """Whether a common function was found, be it one that they hardly shrink.

    Of many loops most hold nothing back, and a matrix inequality is dear: the problem begins with a
    few, and those that grow under their function join them until none does.
    """
    if any(_radius(A) >= 1.0 for A in loops):
        return False
    moves = [Move(0, 0, A) for A in _evenly(loops)[0]]
    asked, P = [], np.eye(len(moves[0].M))[None]
    while growing := [m for m in moves if _growth(m, P) >= MOST]:
        asked += sorted(growing, key=lambda m: -_growth(m, P))[:JOINING]
        P = _shrinking(asked)
        if P is None:
            return False
    return True


def dwell_samples(loops: Sequence[np.ndarray]) -> int | None:
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


def _dwells(loops: Sequence[np.ndarray], samples: int) -> bool:
    """True when functions P_i were found, and checked, for this dwell time."""
    T = [_coordinates(A) for A in loops]
    moves = []
    for i, j in product(range(len(loops)), repeat=2):
        power = np.linalg.matrix_power(loops[i], 1 if i == j else samples)
        moves.append(Move(i, j, np.linalg.solve(T[j], power @ T[i])))
    evenly = np.repeat(np.eye(len(T[0]))[None], len(T), axis=0)
    return _hold(moves, evenly) or _shrinking(moves) is not None


@dataclass(frozen=True)
class Move:
    """x goes to M x, its function from P[before] to P[after]: M' P[after] M < P[before]."""

    before: int
    after: int
    M: np.ndarray


def _evenly(loops: Sequence[np.ndarray]) -> tuple[list[np.ndarray], np.ndarray]:
    """Loops in coordinates in which the first one shrinks evenly, and T of x = T z."""
    T = _coordinates(loops[0])
    return [np.linalg.solve(T, A @ T) for A in loops], T


def _shrinking(moves: Sequence[Move]) -> np.ndarray | None:
    """Functions P <= I, (number, n, n), that the moves shrink most; None where they shrink none."""
    import cvxpy as cp

    one, number = np.eye(len(moves[0].M)), 1 + max(each.before for each in moves)
    P, gain = [cp.Variable(one.shape, symmetric=True) for _ in range(number)], cp.Variable()
    shrinks = [P[e.before] - e.M.T @ P[e.after] @ e.M >> gain * one for e in moves]
    _solve(cp.Problem(cp.Maximize(gain), [*(each << one for each in P), *shrinks]))
    found = None if gain.value is None else np.array([each.value for each in P])
    return found if found is not None and _hold(moves, found) else None


def _solve(problem) -> None:
    """Solve, and leave it to the check whether there is an answer, and how good it is."""
    import cvxpy as cp

    with warnings.catch_warnings(), suppress(cp.SolverError):
        warnings.simplefilter("ignore")
        problem.solve(solver=cp.CLARABEL)


def _hold(moves: Sequence[Move], P: np.ndarray) -> bool:
    """True where all functions are positive and every move shrinks its own."""
    return all(map(_positive, P)) and all(_growth(each, P) < MOST for each in moves)


def _decay_per_s(P: np.ndarray, loops: Sequence[np.ndarray], sample_time_s: float) -> float:
    most = max(_growth(Move(0, 0, A), P[None]) for A in loops)
    return float(-np.log(most) / (2.0 * sample_time_s))


def _growth(move: Move, P: np.ndarray) -> float:
    """Largest ratio of the function after a move to the one before."""
    return float(eigvalsh(move.M.T @ P[move.after] @ move.M, P[move.before])[-1])


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
