"""The likeliest point of a normal distribution inside bounds: a small QP, asked only if needed."""

from __future__ import annotations

import numpy as np

SOLVED = 1
JITTER = 1e-12  # of the largest variance: what is known exactly still has a factor
SLACK = 1e-6  # by which a solution may pass a bound, of the larger of 1 and the bound


class OutsideError(ArithmeticError):
    """No point inside the bounds was found."""


def nearest_inside(
    d: np.ndarray, P: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The z of min (z - d)' P^-1 (z - d) with lower <= z <= upper, and P^-1 (z - d).

    With P = L L' and z = d + L s it is the shortest s with lower <= d + L s <= upper, which needs
    no inverse of P; all of shape (n,), P (n, n), infinite bounds where there are none.

    Raises
    ------
    OutsideError
        If the solver finds no such point, or says so of one that is outside.

    Source: Arnström, Bemporad and Axehill 2022, "A dual active-set solver for embedded quadratic
    programming using recursive LDL' updates" (DAQP).
    """
    import daqp

    bounded = np.flatnonzero(np.isfinite(lower) | np.isfinite(upper))
    n = len(d)
    L = np.linalg.cholesky(P + JITTER * P.diagonal().max() * np.eye(n))
    rows = np.ascontiguousarray(L[bounded])
    limits = [np.clip(each[bounded] - d[bounded], -1e30, 1e30) for each in (upper, lower)]
    sense = np.zeros(len(bounded), dtype=np.int32)
    s, _, flag, told = daqp.solve(np.eye(n), np.zeros(n), rows, *limits, sense)
    z = d + L @ s
    passed = np.maximum(z - upper, lower - z) / np.maximum(1.0, np.abs(z))
    if flag != SOLVED or not (np.isfinite(z).all() and passed.max() <= SLACK):
        raise OutsideError(f"no estimate inside the bounds: DAQP ended with {flag}")
    multipliers = np.zeros(n)
    multipliers[bounded] = -np.asarray(told["lam"])
    return z, multipliers
