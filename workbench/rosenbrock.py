"""The integrator: RODAS3 with the exact Jacobian, refined only where its own error asks for it.

Why this one.  The plants are stiff (a bristle at 1e4 to 1e5 1/s, laminar flow at 1e3 1/s, an end
stop at 1e3 rad/s) and have kinks (contact, dead zone, reversal).  A Rosenbrock method needs one
Jacobian and one factorisation per step and no iteration, so it is a fixed sequence of arithmetic:
CasADi can expand it, map it, differentiate it and turn it into C.  RODAS3 (Sandu et al. 1997,
"Benchmarking stiff ODE solvers for atmospheric chemistry problems II") is L-stable, of order 3 in
four stages, and its last stage is the error of an embedded method of order 2.

One step in the form of Hairer and Wanner, "Solving ordinary differential equations II", IV.7:

    (I / (h gamma) - J) k_i = f(x + sum_j a_ij k_j) + sum_j c_ij k_j / h,   x1 = x + sum m_i k_i

A sample is divided into steps of at most :data:`COARSEST_STEP_S`.  Where the embedded error of a
step exceeds the tolerances, or is not a number, the step is done again as :data:`FINER` steps, each
checked in the same way, down to :data:`LEVELS` levels; the last level is taken as it comes.  Only
what is needed is evaluated (a CasADi switch), and the choice depends on the start of the step
alone, so a run is reproducible sample by sample.

The elimination is written out without pivoting.  That is safe here because the diagonal of
I / (h gamma) - J dominates for small h, and it keeps the structural zeros of J.  The states are
eliminated in the order that creates the fewest new entries (Markowitz 1957).

Errors and speed are printed by ``pytest tests/benchmarks -s --benchmark-enable``.
"""

from __future__ import annotations

from math import ceil

import casadi as ca
import numpy as np

GAMMA = 0.5
COARSEST_STEP_S = 1e-3
FINER = 4
LEVELS = 6  # the finest steps are 1/1024 of the coarse one: a contact met at speed needs them


def controlled_step(
    symbols: tuple[ca.SX, ...],
    rates: ca.SX,
    sample_time_s: float,
    tolerances: np.ndarray,
    coarsest_s: float = COARSEST_STEP_S,
) -> ca.Function:
    """(x, u, d, p) -> x one sample later, inputs held.

    ``symbols`` are the columns x, u, d, p; ``tolerances``, shape (n_x,), is the error of one step
    above which it is done again in finer steps (root of the sum of squares of error / tolerance).
    """
    x, u, d, p = (ca.MX.sym(k, s.numel()) for k, s in zip("xudp", symbols, strict=True))
    trial = checked_step(symbols, rates, tolerances)
    advance = _last(trial)
    for _ in range(LEVELS - 1):
        advance = _refined(trial, advance)
    steps = steps_of(sample_time_s, coarsest_s)
    x_next = _times(advance, steps, x, ca.vertcat(u, d, p), sample_time_s / steps)
    return ca.Function("step", [x, u, d, p], [x_next], [*"xudp"], ["x_next"])


def steps_of(sample_time_s: float, coarsest_s: float = COARSEST_STEP_S) -> int:
    """Into how many steps a sample is divided."""
    return max(ceil(sample_time_s / coarsest_s - 1e-9), 1)


def checked_step(symbols: tuple[ca.SX, ...], rates: ca.SX, tolerances: np.ndarray) -> ca.Function:
    """(x, held, h) -> (x after h seconds, true where the error passes); held is (u, d, p)."""
    x, *inputs = symbols
    held, h = ca.SX.sym("held", sum(s.numel() for s in inputs)), ca.SX.sym("h")
    ends = np.cumsum([0, *(s.numel() for s in inputs)]).tolist()
    later, error = single_step(symbols, rates)(x, *ca.vertsplit(held, ends), h)
    passes = ca.sumsqr(error / tolerances) < 1.0  # false, too, where it is not a number
    return ca.Function("trial", [x, held, h], [later, passes])


def _last(trial: ca.Function) -> ca.Function:
    """(x, held, h) -> x after one step, whatever its error."""
    x, held, h = (ca.MX.sym(k, trial.numel_in(i)) for i, k in enumerate(("x", "held", "h")))
    return ca.Function("last", [x, held, h], [trial(x, held, h)[0]])


def _refined(trial: ca.Function, finer: ca.Function) -> ca.Function:
    """(x, held, h) -> x after one step where its error passes, else after several finer ones."""
    x, held, h = (ca.MX.sym(k, trial.numel_in(i)) for i, k in enumerate(("x", "held", "h")))
    found = ca.MX.sym("found", x.numel())
    keep = ca.Function("keep", [found, x, held, h], [found])
    again = ca.Function("again", [found, x, held, h], [_times(finer, FINER, x, held, h / FINER)])
    later, passes = trial(x, held, h)
    chosen = ca.Function.if_else("chosen", keep, again)(passes, later, x, held, h)
    return ca.Function("refined", [x, held, h], [chosen])


def _times(advance: ca.Function, n: int, x: ca.MX, held: ca.MX, h: ca.MX | float) -> ca.MX:
    """X after n steps of h seconds each."""
    return advance.fold(n)(x, ca.repmat(held, 1, n), ca.repmat(ca.MX(h), 1, n))


def single_step(symbols: tuple[ca.SX, ...], rates: ca.SX) -> ca.Function:
    """(x, u, d, p, h) -> (x after h seconds, error of the embedded method), one RODAS3 step."""
    x, u, d, p = symbols
    h = ca.SX.sym("h")
    f, per_s = ca.Function("f", [x, u, d, p], [rates]), 1.0 / h
    W = ca.SX.eye(x.numel()) * (per_s / GAMMA) - ca.jacobian(rates, x)
    order = elimination_order(W.sparsity())
    back = np.argsort(order).tolist()
    lower, upper, inverse = _factorised(W[order, order])

    def solved(right: ca.SX) -> ca.SX:
        return _solved(lower, upper, inverse, right[order])[back]

    k1 = solved(rates)
    k2 = solved(rates + 4.0 * per_s * k1)
    k3 = solved(f(x + 2.0 * k1, u, d, p) + per_s * (k1 - k2))
    before = x + 2.0 * k1 + k3
    k4 = solved(f(before, u, d, p) + per_s * (k1 - k2 - 8.0 / 3.0 * k3))
    return ca.Function("single", [x, u, d, p, h], ca.cse([before + k4, k4]))


def elimination_order(pattern: ca.Sparsity) -> list[int]:
    """Order of the rows in which elimination creates few new entries: the cheapest pivot next.

    A pivot costs the entries left below it times the entries left beside it; ties go to the first.
    """
    entries = np.zeros(pattern.shape, dtype=bool)
    entries[pattern.get_triplet()] = True
    np.fill_diagonal(entries, False)
    left, order = list(range(len(entries))), []
    while left:
        pivot = min(left, key=lambda k: entries[left, k].sum() * entries[k, left].sum())
        left.remove(pivot)
        order.append(pivot)
        entries |= np.outer(entries[:, pivot], entries[pivot])
        np.fill_diagonal(entries, False)
    return order


def _factorised(W: ca.SX) -> tuple[ca.SX, ca.SX, list[ca.SX]]:
    """Unit lower and upper triangle of W, zeros kept, and one over each pivot; no pivoting."""
    n = W.shape[0]
    lower, upper, inverse = ca.SX.eye(n), ca.SX(W), []
    for k in range(n):
        inverse.append(1.0 / upper[k, k])
        for i in range(k + 1, n):
            if not upper.sparsity().has_nz(i, k):
                continue
            factor = upper[i, k] * inverse[k]
            lower[i, k] = factor
            upper[i, k:] = ca.sparsify(upper[i, k:] - factor * upper[k, k:])
    return ca.sparsify(lower), ca.sparsify(ca.triu(upper)), inverse


def _solved(lower: ca.SX, upper: ca.SX, inverse: list[ca.SX], right: ca.SX) -> ca.SX:
    """Solution of L U k = right."""
    n = lower.shape[0]
    y: list[ca.SX] = []
    for i in range(n):
        known = [lower[i, j] * y[j] for j in range(i) if lower.sparsity().has_nz(i, j)]
        y.append(right[i] - sum(known))
    k: list[ca.SX] = [ca.SX(0)] * n
    for i in reversed(range(n)):
        known = [upper[i, j] * k[j] for j in range(i + 1, n) if upper.sparsity().has_nz(i, j)]
        k[i] = (y[i] - sum(known)) * inverse[i]
    return ca.vertcat(ca.SX(0, 1), *k)
