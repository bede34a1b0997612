"""Solvers of the quadratic program of linear MPC: DAQP, which is the usual one, or OSQP.

Both keep nothing from one program to the next, so that a step is the same whatever was solved
before, and the word of neither is taken for granted: z must be finite and keep all rows.  DAQP is
an active-set method and exact; OSQP a first-order one, here with tightened tolerances and polish.
``workbench study control-speed`` prints speed and error of both.

Source: D. Arnstrom, A. Bemporad and D. Axehill, "A dual active-set solver for embedded quadratic
programming using recursive LDL' updates", IEEE Trans. Automatic Control 67 (2022) 4362;
B. Stellato et al., "OSQP: an operator splitting solver for quadratic programs", Mathematical
Programming Computation 12 (2020) 637.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
import scipy.sparse as sp

if TYPE_CHECKING:
    from controllers.condensed import Program

OPTIMAL = 1  # DAQP's flag
FAR = 1e30  # as good as no bound
FEASIBLE = 1e-5  # V, or units of the slack

Answer = tuple[np.ndarray, int] | None
"""The optimum z, shape (n_z,), and the solver's iterations; None where there is none."""


class Solver(Protocol):
    """Solves min z'Hz/2 + g'z, low <= rows z <= high of a program."""

    def solved(
        self,
        program: Program,
        g: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        start: np.ndarray | None,
    ) -> Answer:
        """The optimum, from a start where there is one."""
        ...


@dataclass(frozen=True)
class Daqp:
    """The dual active-set method; exact, and the faster one here."""

    def solved(
        self,
        program: Program,
        g: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        start: np.ndarray | None,
    ) -> Answer:
        import daqp

        if not np.isfinite(g).all():
            return None
        first, rest = program.order
        lower, upper = (np.nan_to_num(side, posinf=FAR, neginf=-FAR) for side in (low, high))
        z, _, flag, info = daqp.solve(
            program.H,
            g,
            program.general,
            np.concatenate([upper[first], upper[rest]]),
            np.concatenate([lower[first], lower[rest]]),
            np.zeros(len(low), dtype=np.int32),
            primal_start=start,
        )
        return checked(program, z, low, high, int(info["iterations"])) if flag == OPTIMAL else None


@dataclass(frozen=True, kw_only=True)
class Osqp:
    """Operator splitting with polish, at tolerances that are exact to a millivolt."""

    tolerance: float = 1e-7
    most_iterations: int = 20_000

    def solved(
        self,
        program: Program,
        g: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        start: np.ndarray | None,
    ) -> Answer:
        import osqp

        if not np.isfinite(g).all():
            return None
        solver = osqp.OSQP()
        solver.setup(
            sp.csc_matrix(np.triu(program.H)),
            g,
            sp.csc_matrix(program.rows),
            low,
            high,
            eps_abs=self.tolerance,
            eps_rel=self.tolerance,
            max_iter=self.most_iterations,
            polishing=True,
            verbose=False,
        )
        if start is not None:
            solver.warm_start(x=start)
        found = solver.solve(raise_error=False)
        if found.info.status_val != osqp.SolverStatus.OSQP_SOLVED:
            return None
        return checked(program, found.x, low, high, int(found.info.iter))


def checked(
    program: Program, z: np.ndarray, low: np.ndarray, high: np.ndarray, iterations: int
) -> Answer:
    """The answer of a solver if it is finite and keeps the sides of all rows."""
    if not np.isfinite(z).all():
        return None
    at = program.rows @ z
    kept = (at >= low - FEASIBLE).all() and (at <= high + FEASIBLE).all()
    return (z, iterations) if kept else None
