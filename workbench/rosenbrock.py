"""The integrator: RODAS3 with the exact Jacobian, refined only where its own error asks for it.

Why this one.  The plants are stiff (a bristle at 1e4 to 1e5 1/s, laminar flow at 1e3 1/s, an end
stop at 1e3 rad/s) and have kinks (contact, dead zone, reversal).  A Rosenbrock method needs one
Jacobian and one factorisation per step and no iteration, so it is a fixed sequence of arithmetic:
CasADi can expand it, map it, differentiate it and turn it into C.  RODAS3 (Sandu et al. 1997,
"Benchmarking stiff ODE solvers for atmospheric chemistry problems II") is L-stable, of order 3 in
four stages, and its last stage is the error of an embedded method of order 2.

One step in the form of Hairer and Wanner, "Solving ordinary differential equations II", IV.7:

    (I / (h gamma) - J) k_i = f(x + sum_j a_ij k_j) + sum_j c_ij k_j / h,   x1 = x + sum m_i k_i

A sample is first done in :data:`COARSE` steps.  Where the embedded error exceeds the tolerance of
some state, or a value is not finite, the sample is done again in finer steps, at most the last
level of :data:`LEVELS`.  Only the level that is needed is evaluated (a CasADi switch), and the
choice depends on the start of the sample alone, so a run is reproducible sample by sample.

The elimination is written out without pivoting.  That is safe here because the diagonal of
I / (h gamma) - J dominates for small h, and it keeps the structural zeros of J.
"""

from __future__ import annotations

from math import ceil

import casadi as ca
import numpy as np

GAMMA = 0.5
COARSEST_STEP_S = 0.5e-3
LEVELS = (1, 4, 16, 64)  # steps per COARSEST_STEP_S


def controlled_step(
    symbols: tuple[ca.SX, ...], rates: ca.SX, sample_time_s: float, tolerances: np.ndarray
) -> ca.Function:
    """(x, u, d, p) -> x one sample later, inputs held.

    ``symbols`` are the columns x, u, d, p; ``tolerances``, shape (n_x,), is the error of one
    coarse step that each state may make before the sample is done again in finer steps.
    """
    one = single_step(symbols, rates)
    coarse = max(ceil(sample_time_s / COARSEST_STEP_S - 1e-9), 1)
    x, u, d, p = (ca.MX.sym(k, s.numel()) for k, s in zip("xudp", symbols, strict=True))
    levels = [_repeated(one, sample_time_s, coarse * finer, tolerances) for finer in LEVELS]
    result = levels[-1]
    for level in reversed(levels[:-1]):
        result = _refined(level, result)
    x_next, _ = result(x, u, d, p)
    return ca.Function("step", [x, u, d, p], [x_next], [*"xudp"], ["x_next"])


def single_step(symbols: tuple[ca.SX, ...], rates: ca.SX) -> ca.Function:
    """(x, u, d, p, h) -> (x after h seconds, error of the embedded method), one RODAS3 step."""
    x, u, d, p = symbols
    h, n = ca.SX.sym("h"), x.numel()
    f = ca.Function("f", [x, u, d, p], [rates])
    W = ca.SX.eye(n) / (GAMMA * h) - ca.jacobian(rates, x)
    lower, upper = _factorised(W)

    k1 = _solved(lower, upper, rates)
    k2 = _solved(lower, upper, rates + 4.0 / h * k1)
    k3 = _solved(lower, upper, f(x + 2.0 * k1, u, d, p) + (k1 - k2) / h)
    before = x + 2.0 * k1 + k3
    k4 = _solved(lower, upper, f(before, u, d, p) + (k1 - k2 - 8.0 / 3.0 * k3) / h)
    return ca.Function("single", [x, u, d, p, h], ca.cse([before + k4, k4]))


def _repeated(one: ca.Function, sample_time_s: float, steps: int, tolerances: np.ndarray):
    """(x, u, d, p) -> (x one sample later, largest error over tolerance) in equal steps."""
    x, u, d, p = (ca.MX.sym(k, one.numel_in(i)) for i, k in enumerate("xudp"))
    carried, n = ca.MX.sym("carried", x.numel() + 1), x.numel()
    following, error = one(carried[:n], u, d, p, sample_time_s / steps)
    size = ca.mmax(ca.fabs(error) / tolerances)
    size = ca.if_else(size < np.inf, size, np.inf)  # a NaN compares false, and counts as too large
    result = ca.vertcat(following, ca.fmax(carried[n], size))
    many = ca.Function("fold", [carried, u, d, p], [result]).expand().fold(steps)
    columns = (ca.repmat(v, 1, steps) for v in (u, d, p))
    end = many(ca.vertcat(x, 0.0), *columns)
    return ca.Function(f"in_{steps}", [x, u, d, p], [end[:n], end[n]])


def _refined(level: ca.Function, finer: ca.Function) -> ca.Function:
    """The level where its error passes, else the finer one; only one of both is finished."""
    x, u, d, p = (ca.MX.sym(k, level.numel_in(i)) for i, k in enumerate("xudp"))
    found, size = ca.MX.sym("found", x.numel()), ca.MX.sym("size")
    keep = ca.Function("keep", [x, u, d, p, found, size], [found, size])
    again = ca.Function("again", [x, u, d, p, found, size], [*finer(x, u, d, p)])
    chosen = ca.Function.if_else("chosen", keep, again)
    x_next, worst = level(x, u, d, p)
    results = chosen(worst < 1.0, x, u, d, p, x_next, worst)
    return ca.Function("refined", [x, u, d, p], [*results])


def _factorised(W: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Unit lower and upper triangle of W by elimination without pivoting, zeros kept."""
    n = W.shape[0]
    lower, upper = ca.SX.eye(n), ca.SX(W)
    for k in range(n):
        for i in range(k + 1, n):
            if not upper.sparsity().has_nz(i, k):
                continue
            factor = upper[i, k] / upper[k, k]
            lower[i, k] = factor
            upper[i, k:] = ca.sparsify(upper[i, k:] - factor * upper[k, k:])
    return ca.sparsify(lower), ca.sparsify(ca.triu(upper))


def _solved(lower: ca.SX, upper: ca.SX, right: ca.SX) -> ca.SX:
    """Solution of L U k = right."""
    n = lower.shape[0]
    y: list[ca.SX] = []
    for i in range(n):
        known = [lower[i, j] * y[j] for j in range(i) if lower.sparsity().has_nz(i, j)]
        y.append(right[i] - sum(known))
    k: list[ca.SX] = [ca.SX(0)] * n
    for i in reversed(range(n)):
        known = [upper[i, j] * k[j] for j in range(i + 1, n) if upper.sparsity().has_nz(i, j)]
        k[i] = (y[i] - sum(known)) / upper[i, i]
    return ca.vertcat(ca.SX(0, 1), *k)
