"""Recordings cut into short windows whose start states are free, and the model run on all at once.

Positions integrate: over a whole recording every small error of a flow or a force drifts away.
Over short windows forces and flows stay visible and drift is cut (diagnosis.md 1.1).  Two tenths
of a second are a few pressure time constants of a servo drive; where the slide sticks, longer
windows run across break-aways and are far from linear in anything (diagnosis.md 4.5).

What residuals are divided by is in :mod:`workbench.fitting.error_model`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from workbench.effect import Effect
from workbench.fitting.error_model import OUTLYING, ErrorModel, error_model
from workbench.fitting.window_cuts import (
    begun_s,
    causes_in_time,
    cut_inputs,
    cut_rows,
    evenly,
    in_time,
    received_windows,
    thinned,
    variances,
    window_firsts,
    window_starts,
)
from workbench.fitting.window_runs import WindowRuns
from workbench.plant import Plant
from workbench.recording import Recording

WINDOW_S = 0.2
MOST_WINDOWS = 1500  # five minutes: beyond, a fit learns little and takes long
UNSEEN_PENALTY = 1e3  # residual in standard deviations of a sample that could not be simulated
SAME_CLOCK = 1e-4  # relative difference of sample times that counts as none


class TooShortError(ValueError):
    """No piece of a recording is as long as one window."""


@dataclass(frozen=True)
class Windows:
    """Windows of equal length out of one or more recordings.

    Attributes
    ----------
    plant
        The plant as it is fitted to the recordings: with their inputs and outputs.
    recordings
        What was cut.
    firsts
        For each recording the first sample of each of its windows.
    length
        Samples per window, L.
    measured
        Recorded outputs, shape (n_y, n_windows, L), NaN where missing.
    noise
        Standard deviation of the noise of each output, shape (n_y,).
    scale
        What residuals are divided by, shape (n_y, n_windows).
    errors
        The error model that gave the scales.
    start, start_deviation
        Start states guessed from the recording and their standard deviations (n_x, n_windows).
        They are what the sensors show: a sensor that reads too much shifts the start with it.
    """

    plant: Plant
    recordings: tuple[Recording, ...]
    firsts: tuple[tuple[int, ...], ...]
    length: int
    measured: np.ndarray
    noise: np.ndarray
    scale: np.ndarray
    errors: ErrorModel
    start: np.ndarray
    start_deviation: np.ndarray

    def __len__(self) -> int:
        return self.measured.shape[1]

    @cached_property
    def weight(self) -> np.ndarray:
        """1 / scale where a sample was recorded, 0 where not; shape of ``measured``."""
        return np.where(np.isnan(self.measured), 0.0, 1.0 / self.scale[:, :, None])

    @property
    def correlation(self) -> np.ndarray:
        """Samples over which errors are correlated, shape (n_y, n_windows)."""
        noise = self.noise[:, None]
        plain = self.errors.scale(self.activity, noise, correlated=False)
        return (self.errors.scale(self.activity, noise) / plain) ** 2

    @property
    def count(self) -> int:
        """Number of recorded values."""
        return int(np.count_nonzero(self.weight))

    def rescaled(self, residual: np.ndarray) -> Windows:
        """The same windows with scales from weighted residuals (n_y, n_windows, L) of a model."""
        noise = self.noise[:, None]
        model = error_model(residual * self.scale[:, :, None], self.weight, self.activity, noise)
        plain = replace(self, scale=model.scale(self.activity, noise), errors=model)
        return plain.capped(residual * (self.scale / plain.scale)[:, :, None])

    @cached_property
    def activity(self) -> np.ndarray:
        """Standard deviation of each output within each window beyond noise, (n_y, n_windows).

        The same for all windows where positions alone are recorded: there is no quiet pressure in
        which a leak would show, and slow creeping is not to be weighed above full strokes.
        """
        variance = variances(self.measured)
        if position_alone(self.plant):
            variance = np.broadcast_to(variance.mean(axis=1, keepdims=True), variance.shape)
        return np.sqrt(np.maximum(variance - self.noise[:, None] ** 2, 0.0))

    def scaled_like(self, other: Windows) -> Windows:
        """The same windows with the error shares of others: a held-out recording's yardstick."""
        scale = other.errors.scale(self.activity, self.noise[:, None])
        return replace(self, scale=scale, errors=other.errors)

    def capped(self, residual: np.ndarray) -> Windows:
        """The same windows, those far worse than typical counting no more than others."""
        recorded = np.maximum((self.weight > 0).sum(axis=2), 1)
        size = self.scale * np.sqrt((residual**2).sum(axis=2) / recorded)
        expected = self.errors.scale(self.activity, self.noise[:, None], correlated=False)
        return replace(self, scale=self.scale * np.maximum(size / (OUTLYING * expected), 1.0))

    def part(self, most: int) -> tuple[Windows, np.ndarray]:
        """(so many of the windows, evenly chosen; their places among all).

        All of them where fewer than twice as many are there.
        """
        if len(self) < 2 * most:
            return self, np.arange(len(self))
        kept = evenly(len(self), most)
        firsts = thinned(self.firsts, most)
        columns = {k: getattr(self, k)[:, kept] for k in ("scale", "start", "start_deviation")}
        return replace(self, firsts=firsts, measured=self.measured[:, kept], **columns), kept

    def with_plant(self, plant: Plant) -> Windows:
        """The same windows for a plant with other effects; states it shares keep their start."""
        ours, theirs = list(plant.state_list), list(self.plant.state_list)
        start, deviation = window_starts(
            plant, self.recordings, self.firsts, self.noise, known=theirs
        )
        for row, name in enumerate(ours):
            if name in theirs:
                start[row] = self.start[theirs.index(name)]
                deviation[row] = self.start_deviation[theirs.index(name)]
        return replace(self, plant=plant, start=start, start_deviation=deviation)

    def simulated(self, plants: Iterable[Plant], starts: np.ndarray) -> np.ndarray:
        """Outputs of each plant over all windows, shape (n_plants, n_y, n_windows, L).

        ``plants`` differ from the windows' plant in values only; ``starts`` has shape
        (n_plants, n_x, n_windows) or (n_x, n_windows).
        """
        plants = list(plants)
        if not plants:
            return np.zeros((0, *self.measured.shape))
        starts = np.broadcast_to(starts, (len(plants), *self.start.shape))
        u, d = map(np.hstack, zip(*self._inputs_of(plants), strict=True))
        p = np.hstack([np.tile(plant.nominal[2][:, None], len(self)) for plant in plants])
        x0 = np.hstack(list(starts)) if starts.shape[1] else np.zeros((0, p.shape[1]))
        y = self._runs.outputs(x0, u, d, p)
        n_y, n = len(self.plant.measured), len(self)
        sent = y.reshape(n_y, len(plants), n, self.length).transpose(1, 0, 2, 3)
        dt, begun = self.recordings[0].sample_time_s, begun_s(self.recordings, self.firsts)
        found = [
            received_windows(plant, one, begun, dt) for plant, one in zip(plants, sent, strict=True)
        ]
        return np.array(found)

    def ends(self, plant: Plant, starts: np.ndarray) -> np.ndarray:
        """States of a plant one sample after each window, from and in the shape of ``starts``."""
        u, d = self._inputs(plant)
        return self._runs.ends(starts, u, d, np.tile(plant.nominal[2][:, None], len(self)))

    def residuals(self, plants: Iterable[Plant], starts: np.ndarray) -> np.ndarray:
        """Weighted residuals, measured minus simulated, shape (n_plants, n_y, n_windows, L)."""
        error = np.nan_to_num(self.measured) - self.simulated(plants, starts)
        weighted = np.where(self.weight > 0, error * self.weight, 0.0)
        return np.nan_to_num(
            weighted, nan=UNSEEN_PENALTY, posinf=UNSEEN_PENALTY, neginf=-UNSEEN_PENALTY
        )

    @cached_property
    def _runs(self) -> WindowRuns:
        return WindowRuns(self.plant.model, self.recordings[0].sample_time_s, self.length)

    def __getstate__(self) -> dict[str, Any]:
        """All but what runs them, which is built again: a model does not travel."""
        return {key: value for key, value in self.__dict__.items() if key != "_runs"}

    def _inputs_of(self, plants: Iterable[Plant]) -> list[tuple[np.ndarray, np.ndarray]]:
        """:meth:`_inputs` of each plant; those with the same causes in time share theirs."""
        found: dict[tuple[Effect, ...], tuple[np.ndarray, np.ndarray]] = {}
        keys = []
        for plant in plants:
            keys.append(causes_in_time(plant))
            if keys[-1] not in found:
                found[keys[-1]] = self._inputs(plant)
        return [found[key] for key in keys]

    def _inputs(self, plant: Plant) -> tuple[np.ndarray, np.ndarray]:
        """Commands and measured inputs of all windows side by side, (n_u, n L) and (n_d, n L)."""
        if causes_in_time(plant):
            return cut_inputs(plant, self.recordings, self.firsts, self.length)
        return self._plain_inputs

    @cached_property
    def _plain_inputs(self) -> tuple[np.ndarray, np.ndarray]:
        """Those of a plant without any cause in time."""
        effects = tuple(effect for effect in self.plant.effects if not in_time(effect))
        plain = replace(self.plant, effects=effects)
        return cut_inputs(plain, self.recordings, self.firsts, self.length)


def position_alone(plant: Plant) -> bool:
    """True for a plant that moves, of which nothing but positions is recorded."""
    ends = ("position_m", "angle_rad")
    return bool(plant.state_list) and all(name.endswith(ends) for name in plant.measured)


def cut_windows(
    plant: Plant,
    recordings: Iterable[Recording],
    noise: Mapping[str, float],
    window_s: float = WINDOW_S,
    most: int = MOST_WINDOWS,
) -> Windows:
    """Cut recordings into windows, never across a gap; an incomplete last window is left out.

    Where there are more than ``most``, every so many-th is kept, evenly over the recordings.

    Raises
    ------
    TooShortError
        If no recording holds a whole window.
    ValueError
        If their sample times differ.
    """
    recordings = tuple(recordings)
    one_clock(recordings)
    length = max(round(window_s / recordings[0].sample_time_s), 2)
    firsts = thinned(tuple(window_firsts(recording, length) for recording in recordings), most)
    if not any(firsts):
        names = ", ".join(recording.name for recording in recordings)
        raise TooShortError(f"{names}: no piece is as long as one window of {window_s:g} s")
    measured = np.concatenate(
        [
            cut_rows(recording.rows(plant.measured), own, length)
            for recording, own in zip(recordings, firsts, strict=True)
        ],
        axis=1,
    )
    sigma = np.array([noise[name] for name in plant.measured])
    start, deviation = window_starts(plant, recordings, firsts, sigma)
    scale = np.tile(sigma[:, None], (1, measured.shape[1]))
    one = np.ones((len(sigma), 1))
    errors = ErrorModel(sigma[:, None], 0.0 * one, one, one)
    return Windows(
        plant, recordings, firsts, length, measured, sigma, scale, errors, start, deviation
    )


def one_clock(recordings: Iterable[Recording]) -> None:
    """Refuse recordings of different sample times: windows share one simulation."""
    first, *others = recordings = tuple(recordings)
    slowest_s = max(each.sample_time_s for each in recordings)  # a finer one would be made up
    for other in others:
        if abs(other.sample_time_s - first.sample_time_s) > SAME_CLOCK * first.sample_time_s:
            raise ValueError(
                f"{other.name} has a sample every {1e3 * other.sample_time_s:g} ms and "
                f"{first.name} every {1e3 * first.sample_time_s:g} ms; expected the same: set "
                f'resample = "{1e3 * slowest_s:g} ms" in [recording]'
            )
