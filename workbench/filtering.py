"""Kalman filtering and smoothing as functions of matrices.

Source: Särkkä 2013, "Bayesian filtering and smoothing", algorithms 5.4 and 8.2.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

import numpy as np

from workbench.parts import Supply
from workbench.plant import Plant

TEMPERATURE, MASS, PRESSURE = "temperature_k", "mass_kg", "pressure_pa"


def predict(
    state: np.ndarray, covariance: np.ndarray, F: np.ndarray, Q: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """State and covariance one sample later: F x, F P F' + Q."""
    return F @ state, F @ covariance @ F.T + Q


def correct(
    state: np.ndarray,
    covariance: np.ndarray,
    innovation: np.ndarray,
    H: np.ndarray,
    R: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """State and covariance after a measurement; NaN in ``innovation`` (n_y,) was not received.

    K = P H' (H P H' + R)^-1; the covariance in Joseph form, which stays symmetric.
    """
    received = np.isfinite(innovation)
    H, R, innovation = H[received], R[np.ix_(received, received)], innovation[received]
    K = np.linalg.solve(H @ covariance @ H.T + R, H @ covariance).T
    rest = np.eye(len(state)) - K @ H
    return state + K @ innovation, rest @ covariance @ rest.T + K @ R @ K.T


def smoothed(
    states: np.ndarray, covariances: np.ndarray, F: np.ndarray, said: np.ndarray, left: np.ndarray
) -> np.ndarray:
    """Smoothed states (n, n_x) from the filtered ones.

    The Rauch-Tung-Striebel smoother in the adjoint form of Bryson and Frazier, which inverts no
    covariance: a state without noise, or one that friction holds, does no harm.

    ``F[k]`` leads from sample k to k + 1; ``said`` = H' S^-1 e and ``left`` = I - K H belong to
    the measurement of sample k.

    Source: Bierman 1973, "Fixed interval smoothing with discrete measurements".
    """
    onward = F[: len(states) - 1]
    told, back = _times(_turned(onward), said[1:]), _turned(left[1:] @ onward)
    adjoint = np.zeros(states.shape)
    for k in range(len(states) - 1, 0, -1):
        adjoint[k - 1] = told[k - 1] + back[k - 1] @ adjoint[k]
    return states + _times(covariances, adjoint)


def smoothed_covariances(
    covariances: np.ndarray, F: np.ndarray, weights: np.ndarray, left: np.ndarray
) -> np.ndarray:
    """Covariances (n, n_x, n_x) of the states of :func:`smoothed` behind the best gain.

    P - P I P, with I the information of later samples; ``weights`` = H' S^-1 H at each.
    :func:`smoothed_covariances_behind` gives those of other gains.
    """
    return covariances - covariances @ _information(F, weights, left) @ covariances


def smoothed_covariances_behind(
    gains: np.ndarray,
    covariances: np.ndarray,
    F: np.ndarray,
    weights: np.ndarray,
    left: np.ndarray,
    Q: np.ndarray,
) -> np.ndarray:
    """Covariances (n, n_x, n_x) of the states of :func:`smoothed` behind any gain.

    A state that no measurement corrects, as a bristle, has a gain of 0, which is not the best one:
    innovations are then not white, and P - P I P may come out below zero.  With the error e that
    the filter leaves at a sample, the adjoint is I e + n, n from the noise of later samples, and

        (1 - P I) P (1 - P I)' + P N P,     N the covariance of n.

    ``gains`` = [K, H' S^-1], (n, n_x, 2 n_y), in units of the noise of the outputs; ``Q`` is what
    a state gains in a step, half of it before.
    """
    onward = F[: len(covariances) - 1]
    information = _information(F, weights, left)
    K, seen = np.split(gains[1:], 2, axis=2)
    told = weights[1:] + _turned(left[1:]) @ information[1:] @ left[1:]
    read = seen - _turned(left[1:]) @ information[1:] @ K
    gained = onward @ (Q / 2.0) @ _turned(onward) + Q / 2.0
    noise = _summed(told @ gained @ _turned(told) + read @ _turned(read), onward, left)
    rest = np.eye(len(Q)) - covariances @ information
    return rest @ covariances @ _turned(rest) + covariances @ noise @ covariances


def _information(F: np.ndarray, weights: np.ndarray, left: np.ndarray) -> np.ndarray:
    """What later samples tell of the error at each, (n, n_x, n_x)."""
    return _summed(weights[1:], F[: len(weights) - 1], left)


def _summed(own: np.ndarray, onward: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Squares ``own`` (n - 1, n_x, n_x) of samples 1 to n - 1, led back to each sample and summed.

    S[k - 1] = F' (own[k] + L' S[k] L) F, nothing behind the last.
    """
    told, ahead = _turned(onward) @ own @ onward, left[1:] @ onward
    back, found = _turned(ahead), np.zeros(left.shape)
    for k in range(len(onward) - 1, -1, -1):
        found[k] = told[k] + back[k] @ found[k + 1] @ ahead[k]
    return found


def _turned(matrices: np.ndarray) -> np.ndarray:
    """Every matrix transposed."""
    return matrices.transpose(0, 2, 1)


def _times(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Every matrix times its vector, (n, n_x)."""
    return (matrices @ vectors[:, :, None])[:, :, 0]


def consistent_start(plant: Plant, known: Mapping[str, float]) -> np.ndarray:
    """The plant's initial state with the known states set, shape (n_x,).

    A chamber whose pressure is not known begins no higher than the highest supply.  Gas masses
    follow, so that each chamber keeps its initial temperature at the new pressure and volume.
    Names that are no states, and values that are not finite, are passed over.
    """
    model, (u, d, p) = plant.model, plant.nominal
    x = plant.initial
    parts = {part.name for part in plant.parts}
    owners = (name.rpartition(".") for name in model.states)
    chambers = [owner for owner, _, what in owners if what == MASS and owner in parts]
    temperatures = model.quantities(*(f"{c}.{TEMPERATURE}" for c in chambers))
    before = temperatures(x, u, d, p).full().ravel()
    pressures = [model.states.index(f"{chamber}.{PRESSURE}") for chamber in chambers]
    x[pressures] = np.minimum(x[pressures], _highest_supply_pa(plant))
    for i, name in enumerate(model.states):
        if np.isfinite(known.get(name, np.nan)):
            x[i] = known[name]
    after = temperatures(x, u, d, p).full().ravel()
    for chamber, was, now in zip(chambers, before, after, strict=True):
        x[model.states.index(f"{chamber}.{MASS}")] *= now / was
    return x


def _highest_supply_pa(plant: Plant) -> float:
    """The highest pressure of a supply; no bound where there is none."""
    supplies = [part.name for part in plant.parts if isinstance(part, Supply)]
    return max((plant.values[f"{name}.{PRESSURE}"] for name in supplies), default=inf)
