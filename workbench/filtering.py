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
    states: np.ndarray,
    covariances: np.ndarray,
    F: np.ndarray,
    said: np.ndarray,
    weights: np.ndarray,
    left: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Smoothed states (n, n_x) and covariances (n, n_x, n_x) from the filtered ones.

    The Rauch-Tung-Striebel smoother in the adjoint form of Bryson and Frazier, which inverts no
    covariance: a state without noise, or one that friction holds, does no harm.

    ``F[k]`` leads from sample k to k + 1; ``said`` = H' S^-1 e, ``weights`` = H' S^-1 H and
    ``left`` = I - K H belong to the measurement of sample k.

    The covariances hold behind the best gain; :func:`smoothed_covariances` gives those of others.

    Source: Bierman 1973, "Fixed interval smoothing with discrete measurements".
    """
    smooth, P = states.copy(), covariances.copy()
    adjoint, information = np.zeros(states.shape[1]), np.zeros(covariances.shape[1:])
    for k in range(len(states) - 1, -1, -1):
        smooth[k] += covariances[k] @ adjoint
        P[k] -= covariances[k] @ information @ covariances[k]
        if k:
            adjoint = F[k - 1].T @ (said[k] + left[k].T @ adjoint)
            information = F[k - 1].T @ (weights[k] + left[k].T @ information @ left[k]) @ F[k - 1]
    return smooth, P


def smoothed_covariances(
    covariances: np.ndarray,
    F: np.ndarray,
    weights: np.ndarray,
    left: np.ndarray,
    gains: np.ndarray,
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
    unit, (n_x, columns) = np.eye(len(Q)), gains.shape[1:]
    information, N, found = np.zeros((n_x, n_x)), np.zeros((n_x, n_x)), []
    for k in range(len(covariances) - 1, -1, -1):
        P = covariances[k]
        rest = unit - P @ information
        found.append(rest @ P @ rest.T + P @ N @ P)
        if k:
            K, seen = np.split(gains[k], [columns // 2], axis=1)
            step, told = F[k - 1], weights[k] + left[k].T @ information @ left[k]
            read = seen - left[k].T @ information @ K
            gained = step @ (Q / 2.0) @ step.T + Q / 2.0
            N = told @ gained @ told.T + read @ read.T + left[k].T @ N @ left[k]
            N, information = step.T @ N @ step, step.T @ told @ step
    return np.array(found[::-1])


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
