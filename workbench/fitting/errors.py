"""Errors of a fit in units: what a person reads beside the weighted ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from workbench.fitting.gauss_newton import Fit
from workbench.units import public_name


@dataclass(frozen=True)
class SignalError:
    """Error of one output over windows: RMSE in SI, fit percent and noise."""

    rmse: float
    fit_percent: float
    noise: float

    @property
    def chi2_per_sample(self) -> float:
        """chi2/n = (RMSE / noise)^2: one where nothing but noise is left."""
        return (self.rmse / self.noise) ** 2


Errors = Mapping[str, Mapping[str, SignalError]]


def signal_errors(fit: Fit) -> dict[str, SignalError]:
    """RMSE and fit percent of each output over all windows, by public name.

    Fit percent is MATLAB's 100 (1 - |y - yhat| / |y - mean(y)|), over windows with free start.
    """
    windows = fit.windows
    error = fit.residual * windows.scale[:, :, None]
    found = {}
    for k, name in enumerate(windows.plant.measured):
        seen = np.isfinite(windows.measured[k])
        values, e = windows.measured[k][seen], error[k][seen]
        spread = float(np.linalg.norm(values - values.mean()))
        percent = 100.0 * (1.0 - float(np.linalg.norm(e)) / spread) if spread else float("nan")
        rmse = float(np.sqrt(np.mean(e**2)))
        found[public_name(name)] = SignalError(rmse, percent, float(windows.noise[k]))
    return found


def per_sample(fit: Fit | None) -> float:
    """Mean squared error in noise deviations, nothing capped; NaN without a fit."""
    if fit is None:
        return float("nan")
    windows = fit.windows
    error = fit.residual * windows.scale[:, :, None] / windows.noise[:, None, None]
    return float((error**2).sum() / windows.count)


def plain_ratio(before: Fit | None, after: Fit | None) -> float:
    """Squared error after over before, nothing capped: geometric mean over outputs, NaN without."""
    if before is None or after is None:
        return float("nan")
    old, new = signal_errors(before), signal_errors(after)
    ratios = [new[name].rmse / max(old[name].rmse, 1e-300) for name in old]
    return float(np.exp(2.0 * np.mean(np.log(np.maximum(ratios, 1e-12)))))


def errors_of(train: Fit, validation: Fit | None) -> Errors:
    """Errors in units of a fit and of its validation."""
    found = {"train": signal_errors(train)}
    return {**found, "validation": signal_errors(validation)} if validation else found
