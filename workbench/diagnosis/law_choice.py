"""Which term a law takes next: one secant each, and votes of halves of the windows.

Every term is simulated once, at a small size.  That gives what it changes, D, in the metric of the
scan (:mod:`workbench.diagnosis.scan`), where the nominal parameters and the start states are
projected out, and with it what an amount a of it would gain,

    c(a) - c(0) = 2 a D'Mr + a^2 D'MD

on any share of the windows.  A term is stable where it gains within a quarter of the most on seven
in ten of many random halves of the windows; of the stable ones the law takes the one that gains
most on all, or in its place a constant in the same balance that gains as much but for a twentieth:
where a pressure stays in its range, a steady flow is like a term in it too, and the simpler one is
told.  A term that does the same as an effect of the catalogue is left to that effect: it has a
name.  Unlike a regression on the smoothed missing term this blurs no coefficient, and it asks all
balances at once.

Source: diagnosis.md 1.9; Meinshausen and Buehlmann 2010 (stability selection).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.candidate import Candidate
from workbench.diagnosis.blind_starts import blind_starts
from workbench.diagnosis.metric import Metric, every_second
from workbench.diagnosis.scan import Profile
from workbench.diagnosis.ties import CLOSE_DROP, SAME_DIRECTION
from workbench.effect import Parameter
from workbench.effects.empirical import CONSTANT
from workbench.fitting.problem import Problem, fuller
from workbench.fitting.start_states import carried

SECANT = 0.3  # of the typical size
HALVES = 40
NEARLY = 1.0 - CLOSE_DROP  # of the most that a term gains on the same windows
STABLE = 0.7  # of the halves: what one window alone asks for is in half of them
AS_MUCH = 0.95  # of the gain of another term, by which a constant is told in its place
RUNS_AWAY = 1e75  # deviations: beyond, squares and what is made of them are no numbers
SEED = 1


@dataclass(frozen=True)
class _Secants:
    """What terms change, by window: Gram matrices of [J, D, r], (n_windows, n, n).

    ``least`` and ``most`` bound the amounts of the terms in secants; ``rest`` is what the priors
    add to the block of J, and ``offset`` to that of r.
    """

    grams: np.ndarray
    least: np.ndarray
    most: np.ndarray
    rest: np.ndarray
    offset: np.ndarray

    def gains(self, windows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Fall of the cost by each term alone on some windows, counted as all, and its amount."""
        n_p = len(self.offset)
        gram = self.grams[windows].mean(axis=0) * len(self.grams)
        hessian, along = gram[:n_p, :n_p] + self.rest, gram[:n_p, n_p:].copy()
        along[:, -1] += self.offset
        solved = np.linalg.solve(hessian, along) if n_p else along
        sizes = gram[n_p:-1, n_p:-1].diagonal() - np.sum(along[:, :-1] * solved[:, :-1], axis=0)
        slopes = gram[n_p:-1, -1] - along[:, :-1].T @ solved[:, -1]
        amounts = -np.divide(slopes, sizes, out=np.zeros_like(slopes), where=sizes > 0.0)
        amounts = np.clip(amounts, self.least, self.most)
        return -(2.0 * amounts * slopes + amounts**2 * sizes), amounts


def worth_scanning(
    problem: Problem, terms: Sequence[Candidate], known: Iterable[Profile], least: float = 0.0
) -> tuple[list[Candidate], list[Candidate]]:
    """The term that a law takes next, none where none is stable, and those without a name.

    All of them where nothing moves and start states are blind: few terms, and no secant tells.
    ``known`` are the profiles of the catalogue's effects on the same windows; a term that promises
    no more than ``least`` of the cost is not worth it.
    """
    at = problem.base
    windows, point, metric, of_all = every_second(at.windows, at.unknowns, at.point, at.derivatives)
    if not terms or blind_starts(windows.plant, metric.at):
        return list(terms), list(terms)
    members = (c.member for c in terms)
    richer = windows.with_plant(fuller(problem.whole, windows.plant, *members))
    starts, values = carried(point.starts, windows, richer), at.unknowns.values(point.t)
    steps = {c.strength: _secant(richer.plant.parameters[c.strength]) for c in terms}
    plants = [richer.plant.with_values({**values, name: h}) for name, h in steps.items()]
    changes = _numbers(metric.rows(richer.residuals(plants, starts)) - metric.normal.residual)
    bounds = (richer.plant.parameters[name] for name in steps)
    ends = np.array([(each.lower, each.upper) for each in bounds])
    secants = _secants(metric, changes, *np.sort(ends / np.array([*steps.values()])[:, None]).T)
    amounts = secants.gains(np.arange(len(windows)))[1]
    signatures = [metric.signature(-a * d)[0] for a, d in zip(amounts, changes, strict=True)]
    named = [_has_a_name(problem, each, known) for each in signatures]
    gains = _stable_gains(secants, ~np.array(named))
    nameless = [term for term, there in zip(terms, named, strict=True) if not there]
    return [terms[_plainest(terms, gains)]] if gains.max() > least / of_all else [], nameless


def _plainest(terms: Sequence[Candidate], gains: np.ndarray) -> int:
    """Row of the term that gains most, or of a constant in the same balance that gains as much."""
    best = int(gains.argmax())
    for row, term in enumerate(terms):
        alike = (term.place, term.cause.balance) == (terms[best].place, terms[best].cause.balance)
        if alike and term.cause.drivers == (CONSTANT,) and gains[row] >= AS_MUCH * gains[best]:
            return row
    return best


def _numbers(changes: np.ndarray) -> np.ndarray:
    """What terms change, (n_terms, n_windows, n); nothing where a window is lost by a size.

    One that runs away has no secant, and its square would be no number for all terms.
    """
    lost = ~(np.abs(changes) < RUNS_AWAY).all(axis=(1, 2), keepdims=True)
    return np.where(lost, 0.0, changes)


def _secant(known: Parameter) -> float:
    """A size to be tried: within the bounds, to the side that is wider."""
    sign = 1.0 if known.upper >= -known.lower else -1.0
    return sign * SECANT * known.typical


def _secants(metric: Metric, changes: np.ndarray, least: np.ndarray, most: np.ndarray) -> _Secants:
    normal = metric.normal
    columns = (normal.derivatives, changes.transpose(1, 2, 0), normal.residual[:, :, None])
    stacked = np.concatenate(columns, axis=2)
    grams = stacked.transpose(0, 2, 1) @ stacked
    n_p = normal.derivatives.shape[2]
    rest = normal.hessian - grams[:, :n_p, :n_p].sum(axis=0)
    return _Secants(grams, least, most, rest, normal.precision * metric.at.point.t)


def _has_a_name(problem: Problem, signature: np.ndarray, known: Iterable[Profile]) -> bool:
    """True where an effect of the catalogue can do what a term would do on this recording.

    A leak lets no gas in: an effect of one sign is compared with its sign.
    """
    size = float(np.linalg.norm(signature))
    if size <= 0.0:
        return True
    for each in known:
        cosine = float(signature @ each.signature) / size
        signed = problem.whole.parameters[each.candidate.strength].signed
        if (abs(cosine) if signed else cosine) > SAME_DIRECTION * float(
            np.linalg.norm(each.signature)
        ):
            return True
    return False


def _stable_gains(secants: _Secants, own: np.ndarray) -> np.ndarray:
    """What each term gains on all windows; 0 for those that are not stable or not ``own``."""
    n = len(secants.grams)
    random, votes = np.random.default_rng(SEED), np.zeros(len(own))
    for _ in range(HALVES):
        gains = secants.gains(random.permutation(n)[: max(n // 2, 1)])[0] * own
        votes += (gains >= NEARLY * gains.max()) & (gains > 0.0)
    return secants.gains(np.arange(n))[0] * own * (votes >= STABLE * HALVES)
