"""Solvers of the quadratic program of linear MPC: DAQP, which is the usual one, or OSQP.

A step is the same whatever was solved before: of one program DAQP keeps the factors, which do not
change, and OSQP nothing.  The word of neither is taken for granted: z must be finite and keep all
rows.  DAQP is an active-set method and exact; OSQP a first-order one, here with tightened
tolerances and polish.  ``workbench study control-speed`` prints speed and error of both.

Source: D. Arnstrom, A. Bemporad and D. Axehill, "A dual active-set solver for embedded quadratic
programming using recursive LDL' updates", IEEE Trans. Automatic Control 67 (2022) 4362;
B. Stellato et al., "OSQP: an operator splitting solver for quadratic programs", Mathematical
Programming Computation 12 (2020) 637.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
import scipy.sparse as sp

if TYPE_CHECKING:
    from controllers.condensed import Program

OPTIMAL = 1  # DAQP's flag
AT_UPPER, AT_LOWER = 1, 3  # its marks of a row that is taken for active at the beginning
FAR = 1e30  # as good as no bound
FEASIBLE = 1e-5  # V, or units of the slack


class Answer(NamedTuple):
    """What a solver found, and where the next program may start.

    z             the optimum, shape (n_z,)
    iterations    those of the solver
    multipliers   of the rows, shape (n_c,): positive at the upper side, negative at the lower
    """

    z: np.ndarray
    iterations: int
    multipliers: np.ndarray


class Start(NamedTuple):
    """The last optimum z and its multipliers, as :class:`Answer` has them."""

    z: np.ndarray
    multipliers: np.ndarray


class Solver(Protocol):
    """Solves min z'Hz/2 + g'z, low <= rows z <= high of a program."""

    def solved(
        self,
        program: Program,
        g: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        start: Start | None,
    ) -> Answer | None:
        """The optimum, from a start where there is one; None where there is no optimum."""
        ...


@dataclass(frozen=True)
class Daqp:
    """The dual active-set method; exact, and the faster one here.

    It starts from the multipliers, whose signs tell what was active.  By the last z alone it finds
    nothing active, since the sides have moved on by a sample.
    """

    def solved(
        self,
        program: Program,
        g: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        start: Start | None,
    ) -> Answer | None:
        if not np.isfinite(g).all():
            return None
        order = program.order
        lower, upper = np.maximum(low, -FAR)[order], np.minimum(high, FAR)[order]
        marks = np.zeros(len(order), dtype=np.int32)
        if start is not None:
            held = start.multipliers[order]
            marks[held > 0.0], marks[held < 0.0] = AT_UPPER, AT_LOWER
        z, flag, info = program.workspace.solved(g, lower, upper, marks)
        if flag != OPTIMAL:
            return None
        multipliers = np.empty(len(order))
        multipliers[order] = info["lam"]
        return checked(program, Answer(z, int(info["iterations"]), multipliers), low, high)


class Workspace:
    """DAQP on one hessian and one set of rows, whose factors it keeps from call to call.

    Nothing else is kept: every call gives all that changes, and what is active at its beginning.
    Not for several threads.
    """

    def __init__(self, hessian: np.ndarray, general: np.ndarray) -> None:
        self._fixed = hessian, general
        self._model: Any = None

    def solved(
        self, g: np.ndarray, lower: np.ndarray, upper: np.ndarray, marks: np.ndarray
    ) -> tuple[np.ndarray, int, dict[str, Any]]:
        """Optimum, flag and more, for the sides of all rows and DAQP's marks of them, (n_c,)."""
        model = self._model or self._factored(len(marks))
        model.update(f=g, bupper=upper, blower=lower, sense=marks)
        z, _, flag, info = model.solve()
        self._model = model if flag == OPTIMAL else None
        return z, flag, info

    def _factored(self, rows: int) -> Any:
        """The model of a program without bounds, so that the first call is like all others."""
        import daqp

        (hessian, general), free = self._fixed, np.full(rows, FAR)
        model = daqp.Model()
        model.setup(hessian, np.zeros(len(hessian)), general, free, -free)
        return model

    def __reduce__(self) -> tuple[type[Workspace], tuple[np.ndarray, np.ndarray]]:
        """Another process factors anew."""
        return Workspace, self._fixed


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
        start: Start | None,
    ) -> Answer | None:
        import osqp

        if not np.isfinite(g).all():
            return None
        solver = osqp.OSQP()
        solver.setup(
            sp.csc_matrix(np.triu(program.hessian)),
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
            solver.warm_start(x=start.z, y=start.multipliers)
        found = solver.solve(raise_error=False)
        if found.info.status_val != osqp.SolverStatus.OSQP_SOLVED:
            return None
        return checked(program, Answer(found.x, int(found.info.iter), found.y), low, high)


def checked(program: Program, answer: Answer, low: np.ndarray, high: np.ndarray) -> Answer | None:
    """The answer of a solver if it is finite and keeps the sides of all rows."""
    if not np.isfinite(answer.z).all():
        return None
    at = program.rows @ answer.z
    kept = (at >= low - FEASIBLE).all() and (at <= high + FEASIBLE).all()
    return answer if kept else None
