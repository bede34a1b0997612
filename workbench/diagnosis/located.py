"""Where a model fails: the balance that lacks something, and what it lacks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from workbench.diagnosis.missing_term import Course, Dependence, Intensities, Loop

LEAST_GAIN = 4.0  # of log-likelihood: 55 to 1; with less a balance is named by chance


@dataclass(frozen=True)
class Where:
    """Where the model fails.

    Attributes
    ----------
    by_balance
        Log-likelihood gained by an unknown input in each balance, at prior parameters; 0 where
        none is likelier.
    balance
        The one that gains most; of the gas of a chamber and its heat the gas, unless the heat gains
        clearly more.  That of an empirical law where one is told (``by_law``): windows found it.
    term
        Its missing term over the training recordings, shape (n,), in SI, named by ``term_name``
        with its unit, for example ``force_n``.
    term_deviation, time_s
        Its standard deviation and the sample times, shape (n,).
    against
        Its dependence on the driving variables, strongest first.
    by_regime
        Share of the squared error of the prior fit by regime, largest first; regimes overlap.
    intensities
        Of the random walk that the term is, and the term at another one.
    imitated
        Share of the term's variance that the nominal parameters explain within their priors; it
        is left out in ``against``.
    rest, course
        The term without that share, shape (n,), and what the smoother ran through.
    """

    balance: str
    by_balance: Mapping[str, float]
    term_name: str
    time_s: np.ndarray
    term: np.ndarray
    term_deviation: np.ndarray
    against: tuple[Dependence, ...]
    by_regime: Mapping[str, float]
    intensities: Intensities | None = None
    imitated: float = 0.0
    by_law: bool = False
    rest: np.ndarray | None = field(default=None, repr=False)
    course: Course | None = field(default=None, repr=False)

    @property
    def certain(self) -> bool:
        """True where the balance gains more than chance gives, or a law tells it."""
        return self.by_law or self.by_balance.get(self.balance, 0.0) > LEAST_GAIN

    @property
    def alike(self) -> tuple[str, ...]:
        """Other balances that gain as much as the named one, but for what chance gives."""
        if self.by_law:
            return ()
        least = max(self.by_balance.get(self.balance, 0.0) - LEAST_GAIN, 0.0)
        gaining = (name for name, gain in self.by_balance.items() if gain > least)
        return tuple(name for name in gaining if name != self.balance)

    @property
    def marked(self) -> tuple[str, ...]:
        """The named balance and those alike; none where it gains no more than chance gives."""
        return (self.balance, *self.alike) if self.certain else ()

    @property
    def memory(self) -> tuple[Dependence, Loop] | None:
        """The variable that the term follows most, and the loop it runs there; None without."""
        first = next(iter(self.against), None)
        loop = first and first.memory
        return (first, loop) if first and loop else None
