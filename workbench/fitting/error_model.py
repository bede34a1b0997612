"""What residuals are divided by: sensor noise, and the typical error of the model itself.

Residuals are divided by a *scale* per output and window.  Sensor noise alone is a poor one: with a
5 um position sensor a 1 mm error of a model outweighs every pressure, and a stroke outweighs the
quiet second in which a leak shows.  So the scale is

    scale^2 = tau (quiet^2 + (rho activity)^2)

with the activity the standard deviation of the output within the window, quiet and rho the typical
errors of the model where the output rests (at least the noise) and as a share of the activity where
it moves, and tau the correlation time of those errors in samples: 10 000 correlated samples are
worth a few hundred, and counted in full they would push every parameter out of its prior.  It is
told by (sum e)^2 / sum e^2 of a window, which is tau times the square of a normal number.  Windows
far worse than that (a break-away at the wrong instant) count no more than one three times worse.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

ACTIVE = 5.0  # noise deviations of an output that moves within a window
MEDIAN = 0.4549  # of the square of a standard normal number
FEW = 20  # errors of a window, beyond which they are as good as infinitely many
CHANCE = 4.7  # two deviations of the median of one such number, over that median
OUTLYING = 3.0  # windows worse than this many typical errors count no more than one that is


@dataclass(frozen=True)
class ErrorModel:
    """Typical errors of a model: see the module's docstring.  Every field has shape (n_y, 1)."""

    quiet: np.ndarray
    share: np.ndarray
    quiet_samples: np.ndarray
    moving_samples: np.ndarray

    def scale(self, activity: np.ndarray, noise: np.ndarray, correlated: bool = True) -> np.ndarray:
        """What residuals are to be divided by, shape (n_y, n_windows)."""
        size = np.sqrt(self.quiet**2 + (self.share * activity) ** 2)
        samples = np.where(activity > ACTIVE * noise, self.moving_samples, self.quiet_samples)
        return size * np.sqrt(samples) if correlated else size


def error_model(
    error: np.ndarray, weight: np.ndarray, activity: np.ndarray, noise: np.ndarray
) -> ErrorModel:
    """The error model of what a simulation got wrong.

    ``error`` (n_y, n_windows, L) in SI with 0 where nothing was recorded, ``weight`` 0 there too;
    ``activity`` (n_y, n_windows) and ``noise`` (n_y, 1).
    """
    recorded = np.maximum((weight > 0).sum(axis=2), 1)
    squares = (error**2).sum(axis=2)
    size = np.sqrt(squares / recorded)
    ratios = error.sum(axis=2) ** 2 / np.maximum(squares, 1e-300)
    seen, moving = (weight > 0).any(axis=2), activity > ACTIVE * noise
    rests, moves = seen & ~moving, seen & moving
    quiet = np.maximum(_median_where(rests, size), noise)
    beyond = np.sqrt(np.maximum(size**2 - quiet**2, 0.0))
    return ErrorModel(
        quiet,
        _median_where(moves, beyond / np.maximum(activity, noise)),
        _correlated(rests, ratios, recorded),
        _correlated(moves, ratios, recorded),
    )


def _correlated(chosen: np.ndarray, ratios: np.ndarray, recorded: np.ndarray) -> np.ndarray:
    """Correlation times in samples, shape (n, 1): the median of the ratios tells 0.455 of them.

    Errors are white unless they show otherwise by more than chance, which a median of few windows
    has much of: taken as it is it would tell too much of white ones.
    """
    found = _median_where(chosen, ratios / _excess_of_few(recorded)) / MEDIAN
    windows = np.maximum(chosen.sum(axis=1, keepdims=True), 1)
    most = np.where(chosen, recorded, 1).max(axis=1, keepdims=True)
    return np.clip(np.where(found > 1.0 + CHANCE / np.sqrt(windows), found, 1.0), 1.0, most)


def _excess_of_few(recorded: np.ndarray) -> np.ndarray:
    """Median of the ratio of so many white errors over that of very many, of the same shape.

    The share of their squares along one direction of n is a Beta(1/2, (n - 1)/2) number.
    """
    found = np.ones(recorded.shape)
    few = recorded < FEW
    if few.any():
        from scipy.special import betaincinv  # slow to load, and only slow sensors ask for it

        n = np.maximum(recorded[few], 2)
        median = np.where(recorded[few] == 1, 1.0, n * betaincinv(0.5, (n - 1) / 2, 0.5))
        found[few] = median / MEDIAN
    return found


def _median_where(chosen: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Median of the chosen values of each row, 0 where none is, shape (n, 1)."""
    rows = [np.median(v[c]) if c.any() else 0.0 for v, c in zip(values, chosen, strict=True)]
    return np.array(rows)[:, None]
