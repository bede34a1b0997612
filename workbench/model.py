"""The one CasADi model of a plant, which simulation, design, estimation and fitting all read."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from workbench.compiled import compiled
from workbench.effect import Conditions, Expression, MassFlow, Term
from workbench.ensemble import Ensemble, ensemble
from workbench.rosenbrock import controlled_step

BLOCK = 20  # samples of one call


@dataclass(frozen=True)
class FlowPath:
    """A path of gas: who makes it, and the balance that it enters where its flow is positive.

    ``choked_share`` is the flow over what it would be if choked, psi(p_d/p_u).
    """

    effect: str
    balance: str
    flow_kg_s: Expression
    choked_share: Expression


@dataclass(frozen=True)
class Model:
    """A plant as CasADi expressions.  Every name reads ``part.quantity_unit``.

    Attributes
    ----------
    states, commands, measured_inputs, parameters, measured
        Names, in the order of the vectors x, u, d, p and y.
    symbols
        The column vectors x, u, d, p.
    rates, outputs
        dx/dt, shape (n_x, 1), and y, shape (n_y, 1).
    flows
        Every single flow, by ``(effect, kind, balance)``: who does what to whom.
    paths
        Every path of gas of which it is known where it is choked.
    tolerances
        Error per step that the integrator lets pass, shape (n_x,).
    conditions
        Every quantity of the plant as an expression, for example ``chamber_a.temperature_k``.
    """

    states: tuple[str, ...]
    commands: tuple[str, ...]
    measured_inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    measured: tuple[str, ...]
    symbols: tuple[ca.SX, ...]
    rates: ca.SX
    outputs: ca.SX
    flows: dict[tuple[str, str, str], Expression]
    paths: tuple[FlowPath, ...]
    tolerances: np.ndarray
    conditions: Conditions = field(repr=False)
    _steps: dict[float, ca.Function] = field(default_factory=dict, init=False, repr=False)
    _compiled: dict[float, ca.Function] = field(default_factory=dict, init=False, repr=False)
    _blocks: dict[float, ca.Function] = field(default_factory=dict, init=False, repr=False)
    _ensemble: dict[float, Ensemble | None] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def f(self) -> ca.Function:
        """(x, u, d, p) -> (dx/dt, y).  The only place where the physics is evaluated."""
        results = [self.rates, self.outputs]
        return ca.Function("f", [*self.symbols], results, [*"xudp"], ["rates", "outputs"])

    @cached_property
    def h(self) -> ca.Function:
        """(x, u, d, p) -> y alone, for where the rates are not needed."""
        return ca.Function("h", [*self.symbols], [self.outputs], [*"xudp"], ["outputs"])

    @cached_property
    def jacobians(self) -> ca.Function:
        """(x, u, d, p) -> (A, B, C, D): derivatives of rates and outputs in x and u."""
        x, u, _, _ = self.symbols
        blocks = [ca.jacobian(e, s) for e in (self.rates, self.outputs) for s in (x, u)]
        return ca.Function("jacobians", [*self.symbols], blocks, [*"xudp"], [*"ABCD"])

    def quantities(self, *names: str) -> ca.Function:
        """(x, u, d, p) -> the named quantities, shape (n, 1)."""
        values = ca.vertcat(*(self.conditions.read(name) for name in names))
        return ca.Function("quantities", [*self.symbols], [values], [*"xudp"], ["values"])

    def step(self, sample_time_s: float) -> ca.Function:
        """(x, u, d, p) -> x one sample later with inputs held; see :mod:`workbench.rosenbrock`.

        For building: it can be differentiated, and ``compiled`` with what is built from it.
        """
        if sample_time_s not in self._steps:
            self._steps[sample_time_s] = controlled_step(
                self.symbols, self.rates, sample_time_s, self.tolerances
            )
        return self._steps[sample_time_s]

    def compiled_step(self, sample_time_s: float) -> ca.Function:
        """The same as :meth:`step`, for running: machine code where there is a C compiler."""
        if sample_time_s not in self._compiled:
            self._compiled[sample_time_s] = compiled(self.step(sample_time_s))
        return self._compiled[sample_time_s]

    def block(self, sample_time_s: float) -> ca.Function:
        """(x, u, d, p) -> (x, X): BLOCK steps, u, d and X with a column for each, p with one.

        Between calls CasADi copies every parameter for every column, which takes a third of the
        time of a compiled step; inside a block it does not.
        """
        sizes = zip("xudp", self.symbols, (1, BLOCK, BLOCK, 1), strict=True)
        x, u, d, p = (ca.MX.sym(name, s.numel(), columns) for name, s, columns in sizes)
        later = self.step(sample_time_s).mapaccum(BLOCK)(x, u, d, ca.repmat(p, 1, BLOCK))
        return ca.Function("block", [x, u, d, p], [later[:, -1], later])

    def run(self, sample_time_s: float, samples: int) -> ca.Function:
        """(x, u, d, p) -> states after each of so many samples, for running; see :func:`run_of`."""
        return run_of(self.compiled_block(sample_time_s), samples)

    def compiled_block(self, sample_time_s: float) -> ca.Function:
        """The same as :meth:`block`, for running: machine code where there is a C compiler."""
        if sample_time_s not in self._blocks:
            self._blocks[sample_time_s] = compiled(self.block(sample_time_s))
        return self._blocks[sample_time_s]

    def ensemble(self, sample_time_s: float) -> Ensemble | None:
        """Outputs of many windows side by side in lanes; None where that cannot be had."""
        if sample_time_s not in self._ensemble:
            self._ensemble[sample_time_s] = ensemble(self, sample_time_s) if self.states else None
        return self._ensemble[sample_time_s]


def flow_paths(flows: Iterable[tuple[str, Term]]) -> tuple[FlowPath, ...]:
    """The paths among the flows of these effects, by name of the effect."""
    return tuple(
        FlowPath(effect, term.balance, term.value, term.choked_share)
        for effect, term in flows
        if isinstance(term, MassFlow) and term.choked_share is not None
    )


def run_of(block: ca.Function, samples: int) -> ca.Function:
    """(x, u, d, p) -> states after each of so many samples, (n_x, samples), block by block.

    u and d have a column for each sample, p has one.  ``block`` is that of :meth:`Model.block`; the
    last one steps on under the last input where the samples do not fill it.
    """
    blocks = -(-samples // BLOCK)
    beyond = blocks * BLOCK - samples
    x, p = (ca.MX.sym(name, block.size1_in(k)) for name, k in (("x", 0), ("p", 3)))
    u, d = (ca.MX.sym(name, block.size1_in(k), samples) for name, k in (("u", 1), ("d", 2)))
    held = [ca.horzcat(v, ca.repmat(v[:, -1], 1, beyond)) for v in (u, d)]
    _, later = block.mapaccum(blocks)(x, *held, ca.repmat(p, 1, blocks))
    return ca.Function("run", [x, u, d, p], [later[:, :samples]])
