"""Interacting multiple models: a bank of extended filters, one per regime, with their odds.

    mixing       c_j = sum_i T_ij mu_i,   x_0j = sum_i (T_ij mu_i / c_j) x_i,
                 P_0j = sum_i (T_ij mu_i / c_j) (P_i + (x_i - x_0j)(x_i - x_0j)')
    filtering    each regime from its own x_0j, P_0j, with log-likelihood l_j
    odds         log mu_j = l_j + log c_j, less the logarithm of their sum
    combination  as mixing, with the odds as weights

Odds stay logarithms throughout.  filterpy multiplies likelihoods as numbers: those of several
precise outputs underflow, and the odds then fall back to the transition prior without a word; nor
does its bank pass the command on to the filters.  So its formulas stand here, and its estimator is
the oracle of the test where likelihoods are moderate.

Source: Blom and Bar-Shalom 1988, "The interacting multiple model algorithm for systems with
Markovian switching coefficients"; Bar-Shalom, Li and Kirubarajan 2001, Sec. 11.6.6.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from estimators.extended_kalman import ExtendedKalman
from estimators.regimes import Regime, regimes
from estimators.stochastic_plant import LIKELY, StochasticPlant
from workbench.contracts import Estimate

PROBABILITY = "probability of "


def mixed(
    X: np.ndarray, P: np.ndarray, log_odds: np.ndarray, T: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States, covariances and log c_j with which the regimes begin a sample.

    ``X`` (m, n), ``P`` (m, n, n) and ``log_odds`` (m,) by regime; T[i, j] is the probability that
    regime i is followed by regime j.
    """
    joint = np.log(T) + log_odds[:, None]
    foreseen = np.logaddexp.reduce(joint, axis=0)
    means, spreads = zip(*(combined(X, P, w) for w in np.exp(joint - foreseen).T), strict=True)
    return np.array(means), np.array(spreads), foreseen


def combined(X: np.ndarray, P: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of a mixture; ``weights`` (m,) add up to one."""
    mean = weights @ X
    off = X - mean
    return mean, np.tensordot(weights, P, 1) + (weights[:, None] * off).T @ off


@dataclass(frozen=True, kw_only=True)
class InteractingModels(StochasticPlant):
    """One extended filter per regime of the plant, and how likely each regime is.

    The notes hold the probability of each regime, the log-likelihood of a sample under all of them,
    and ``nis`` of the likeliest.  Noise of states that the regimes leave out is passed over.

    Attributes
    ----------
    dwell_s
        Mean time for which a regime lasts; all others are as likely to follow.
    creep
        What a held position gains per square root of a second, in units of its scale: presliding.
    """

    dwell_s: float = 0.05
    creep: float = 1e-3

    def start(self, measurement: np.ndarray) -> Estimate:
        begun = [member.start(measurement) for member in self.members.values()]
        X, P = (np.array([e.memory[k] for e in begun]) for k in (0, 1))
        return self._estimate(X, P, np.full(len(begun), -np.log(len(begun))), {})

    def update(self, last: Estimate, command: np.ndarray, measurement: np.ndarray) -> Estimate:
        received = np.isfinite(measurement)
        y = np.where(received, measurement, 0.0)
        X, P, foreseen = mixed(*last.memory, self.transition)
        rows = zip(self.members.values(), X, P, strict=True)
        found = [member.sample(x, p, command, y, received) for member, x, p in rows]
        log_odds = foreseen + np.array([each.log_likelihood for each in found])
        log_odds = np.where(np.isfinite(log_odds), log_odds, -np.inf)
        if not np.isfinite(log_odds).any():
            raise ArithmeticError(f"{self.plant.name}: no regime has a finite likelihood")
        likely = float(np.logaddexp.reduce(log_odds))
        log_odds -= likely
        lost = ~np.isfinite(log_odds)
        best = int(np.argmax(log_odds))
        X, P = (np.array([getattr(each, name) for each in found]) for name in "XP")
        X[lost], P[lost] = X[best], P[best]
        told = {LIKELY: likely, "nis": found[best].nis, "received": float(received.sum())}
        return self._estimate(X, P, np.maximum(log_odds, LEAST), told)

    def _estimate(
        self, X: np.ndarray, P: np.ndarray, log_odds: np.ndarray, told: Mapping[str, float]
    ) -> Estimate:
        odds = np.exp(log_odds)
        found = next(iter(self.members.values())).estimate(*combined(X, P, odds / odds.sum()))
        notes = {PROBABILITY + name: float(p) for name, p in zip(self.members, odds, strict=True)}
        memory = (X, P, log_odds)
        return Estimate(
            found.names, found.state, found.covariance, memory, {**found.notes, **notes, **told}
        )

    def retuned(self, process_noise: Mapping[str, float]) -> InteractingModels:
        """The same with other process noise, on functions that are there already."""
        other = replace(self, process_noise=process_noise)
        other.__dict__["members"] = {
            name: member.retuned(other._noise_of(member.plant))
            for name, member in self.members.items()
        }
        return other

    @cached_property
    def transition(self) -> np.ndarray:
        """T[i, j]: probability that regime i is followed by regime j, rows add up to one.

        exp(h G) with G = -1 / dwell on the diagonal and the rest of it shared out beside that: a
        long sample may hold several switches, and forgets what was before.
        """
        m = len(self.members)
        if m == 1:
            return np.ones((1, 1))
        kept = np.exp(-self.sample_time_s / self.dwell_s * m / (m - 1))
        return np.full((m, m), (1.0 - kept) / m) + kept * np.eye(m)

    @cached_property
    def members(self) -> dict[str, ExtendedKalman]:
        """The filter of each regime."""
        return {name: self._member(plant) for name, plant in regimes(self.plant).items()}

    def _member(self, plant: Regime) -> ExtendedKalman:
        states = plant.model.states
        return ExtendedKalman(
            plant=plant,
            sample_time_s=self.sample_time_s,
            measurement_noise=self.measurement_noise,
            process_noise=self._noise_of(plant),
            unknown_inputs=self.unknown_inputs,
            initial_deviation={n: s for n, s in self.initial_deviation.items() if n in states},
        )

    def _noise_of(self, plant: Regime) -> dict[str, float]:
        """Process noise of a regime: what is held creeps, and is not pushed."""
        states, held = plant.model.states, dict(plant.held)
        sizes = dict(zip(states, plant.scale, strict=True))
        still = {*held, *held.values()}
        noise = {n: q for n, q in self.process_noise.items() if n in states and n not in still}
        return noise | {position: self.creep * sizes[position] for position in held}


LEAST = -700.0  # logarithm of odds below which a regime is as good as out, and must come back
