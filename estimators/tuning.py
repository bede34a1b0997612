"""Process noise from a recording: the one under which what was measured is likeliest.

The states fall into groups: what momentum gains (speeds), what gas gains (pressures and masses),
and the rest.  Each group has one factor on its standard deviations, and the factors are searched
one after the other on a logarithmic grid that narrows, all tries of a round side by side.  The
likelihood is that of the innovations of the extended filter, which are the prediction errors that
the noise has to explain; :func:`own_noise` takes those of an estimator itself, which may have left
out a part of the plant that its noise must make up for.

Source: Mehra 1970, "On the identification of variances and adaptive Kalman filtering"; Ljung 1999,
"System identification", Sec. 7.4 (likelihood by innovations).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from estimators.interacting_models import InteractingModels
from estimators.scheduled_kalman import ScheduledKalman
from estimators.stochastic_plant import LIKELY
from workbench.filter_likelihoods import log_likelihoods_of_noise
from workbench.filter_passes import recording_filter
from workbench.plant import Plant
from workbench.recording import Recording

GROUPS = {"momentum": ("velocity_m_s", "velocity_rad_s"), "gas": ("pressure_pa", "mass_kg")}
REST = "rest"
SPANS = (100.0, 10.0, 3.0)  # factor to either side of a round's tries
TRIES = 7
STRETCH = 1000  # samples on which an estimator's own noise is searched


@dataclass(frozen=True)
class TunedNoise:
    """The likeliest process noise, by state, with the factor of each group on what it began with.

    ``log_likelihood`` is that of the noise, ``before`` of what it began with.
    """

    process_noise: Mapping[str, float]
    factors: Mapping[str, float]
    log_likelihood: float
    before: float


def tuned_noise(
    plant: Plant,
    recording: Recording,
    measurement_noise: Mapping[str, float],
    process_noise: Mapping[str, float],
    initial_deviation: Mapping[str, float] | None = None,
    say: Callable[[str], None] = lambda message: None,
) -> TunedNoise:
    """Process noise by likelihood, from ``process_noise`` on; states without noise keep none.

    Raises
    ------
    ArithmeticError
        If no noise of a round gives a finite likelihood.
    """
    found = recording_filter(
        plant,
        recording,
        measurement_noise=measurement_noise,
        process_noise=process_noise,
        initial_deviation=initial_deviation,
    )

    def likelihoods(several: np.ndarray) -> np.ndarray:
        return log_likelihoods_of_noise(found, recording, several)

    return _searched(plant, process_noise, likelihoods, say)


def suited(
    estimator: Any,
    commands: np.ndarray,
    measured: np.ndarray,
    say: Callable[[str], None] = lambda message: None,
) -> Any:
    """The estimator, with its :func:`own_noise` where it has left out a part of the plant.

    Of a longer recording the stretch counts in which the outputs move most.
    """
    if not isinstance(estimator, ScheduledKalman | InteractingModels):
        return estimator
    noise = np.array([estimator.measurement_noise[name] for name in estimator.plant.measured])
    moved = np.nansum((np.diff(measured, axis=1) / noise[:, None]) ** 2, axis=0)
    firsts = range(0, max(measured.shape[1] - STRETCH, 0) + 1, STRETCH // 2)
    first = max(firsts, key=lambda k: moved[k : k + STRETCH].sum())
    u, y = commands[:, first : first + STRETCH], measured[:, first : first + STRETCH]
    return estimator.retuned(own_noise(estimator, u, y, say).process_noise)


def own_noise(
    estimator: Any,
    commands: np.ndarray,
    measured: np.ndarray,
    say: Callable[[str], None] = lambda message: None,
) -> TunedNoise:
    """Process noise under which an estimator finds its own innovations likeliest, from its own on.

    For one that can be ``retuned`` and notes log-likelihoods; commands (n_u, n), outputs (n_y, n),
    NaN where not received.

    Raises
    ------
    ArithmeticError
        If it is lost with every noise of a round.
    """
    states = estimator.plant.model.states

    def likelihood(noise: np.ndarray) -> float:
        named = zip(states, map(float, noise), strict=True)
        other = estimator.retuned({n: q for n, q in named if q > 0.0})
        estimate, total = other.start(measured[:, 0]), 0.0
        for k in range(1, measured.shape[1]):
            try:
                estimate = other.update(estimate, commands[:, k - 1], measured[:, k])
            except (ArithmeticError, RuntimeError):
                return -inf
            total += estimate.notes[LIKELY]
        return total

    def likelihoods(several: np.ndarray) -> np.ndarray:
        return np.array([likelihood(noise) for noise in several])

    return _searched(estimator.plant, estimator.process_noise, likelihoods, say)


def _searched(
    plant: Plant,
    process_noise: Mapping[str, float],
    likelihoods: Callable[[np.ndarray], np.ndarray],
    say: Callable[[str], None],
) -> TunedNoise:
    """Group by group in narrowing rounds; ``likelihoods`` takes noise (m, n_x) and gives (m,)."""
    states = plant.model.states
    noise = np.array([process_noise.get(name, 0.0) for name in states])
    members = {group: _members(states, noise, group) for group in (*GROUPS, REST)}
    members = {group: rows for group, rows in members.items() if rows.any()}
    factors = dict.fromkeys(members, 1.0)
    before = best = float(likelihoods(noise[None])[0])
    for span in SPANS:
        for group, rows in members.items():
            tried = span ** np.linspace(-1.0, 1.0, TRIES)
            likely = likelihoods(np.where(rows, noise * tried[:, None], noise))
            if not np.isfinite(likely).any():
                raise ArithmeticError(f"{plant.name}: no process noise has a finite likelihood")
            k = int(np.nanargmax(np.where(np.isfinite(likely), likely, np.nan)))
            noise, best = np.where(rows, noise * tried[k], noise), float(likely[k])
            factors[group] *= float(tried[k])
            say(f"process noise of {group} times {factors[group]:.3g}: {best:.1f}")
    named = zip(states, map(float, noise), strict=True)
    return TunedNoise({n: q for n, q in named if q > 0.0}, factors, best, before)


def _members(states: tuple[str, ...], noise: np.ndarray, group: str) -> np.ndarray:
    """Which states belong to a group and have noise, shape (n_x,)."""
    quantities = [name.rpartition(".")[2] for name in states]
    if group == REST:
        known = {quantity for several in GROUPS.values() for quantity in several}
        inside = np.array([quantity not in known for quantity in quantities])
    else:
        inside = np.array([quantity in GROUPS[group] for quantity in quantities])
    return inside & (noise > 0.0)
