"""Estimators side by side on recordings of a rig, and where the truth is known.

On the recording itself no state is known, so what counts is how well the plant, started from an
estimate, foretells the outputs.  Under the recorded inputs the rig's own plant is then simulated,
with the recording's sensor noise: there every state is known, with nothing hidden, with an effect
hidden of which the estimators know nothing, and with data that lack something: holes, slow sensors,
outliers, an output that is late.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from estimators import ESTIMATORS
from estimators.observed import Observed, observed
from estimators.scheduled_kalman import noise_for
from estimators.tuning import TunedNoise, suited, tuned_noise
from studies.estimated import Estimated, EstimatedRecording
from studies.estimating_disturbed import disturbed
from studies.estimator_runs import (
    Followed,
    fed,
    follow,
    foretold,
    rmse,
    whiteness,
)
from workbench.effect import Kind
from workbench.errors import InputError, Message, listed, nearest
from workbench.fitting.noise_source import recorded_noise
from workbench.fitting.starts import guessed_states
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.simulation import simulate

USUAL = ("ekf", "ukf", "imm", "mhe")
LONGEST_S = 3.0  # of a recording
HORIZONS_S = (0.001, 0.01, 0.05, 0.1)
ASKED = 500  # innovations and starts of a prediction in a run
SHARES = {"velocity_m_s": 0.1, "velocity_rad_s": 0.1, "pressure_pa": 0.01}  # of a state's scale
AMONG_HIDDEN = ("constant_force", "chamber_leak")  # the first that a plant may lack


def estimate_rig(
    rig: Rig,
    recordings: Sequence[Recording],
    names: Iterable[str] = USUAL,
    hide: str = "",
    say: Callable[[str], None] = lambda message: None,
) -> tuple[EstimatedRecording, ...]:
    """The named estimators on the first seconds of each recording; see the module.

    ``hide`` is the public name of the effect that the simulation hides.

    Raises
    ------
    InputError
        If there is no such estimator or effect, or the plant has no states.
    ArithmeticError
        If every estimator is lost.
    """
    names = tuple(names)
    for name in names:
        if name not in ESTIMATORS:
            known, told = f"one of {listed(ESTIMATORS)}", name or "an empty name"
            raise InputError(Message("is no estimator", told, known, nearest(name, ESTIMATORS)))
    return tuple(_Bench(rig, each, hide, say).compared(names) for each in recordings)


@dataclass(frozen=True)
class _Bench:
    """One recording with the plant as it is told to estimators."""

    rig: Rig
    whole: Recording
    hide: str
    say: Callable[[str], None]

    def compared(self, names: tuple[str, ...]) -> EstimatedRecording:
        """All estimators, one after the other."""
        hidden = self.hidden  # what is wrong with it is said before any work
        self.say(f"{self.recording.name}: process noise by likelihood")
        tuned = self.tuned
        rows, lost = [], {}
        for name in names:
            try:
                rows.append(self._row(name))
            except ArithmeticError as error:
                lost[name] = str(error)
        if not rows:
            told = "; ".join(f"{name} {why}" for name, why in lost.items())
            raise ArithmeticError(f"{self.recording.name}: no estimator held: {told}")
        return EstimatedRecording(
            self.recording.name,
            self.plant.measured,
            self.recording.sample_time_s,
            self.noise,
            tuned,
            hidden,
            self.simulated,
            self.observed,
            tuple(rows),
            lost,
        )

    def _row(self, name: str) -> Estimated:
        self.say(f"{self.recording.name}: {name}")
        estimator, every = self._made(name), max(len(self.recording) // ASKED, 1)
        dt = self.recording.sample_time_s
        plant, u, y = fed(self.plant, self.recording)
        found = follow(estimator, u, y, every)
        steps = {k: k * dt for k in (max(round(h / dt), 1) for h in HORIZONS_S)}
        starts = np.arange(len(self.recording) // 10, len(self.recording), every)
        ahead = foretold(found, plant, u, y, dt, steps, starts)
        asked = found.received > 0
        simulated = follow(estimator, u, self._seen(self.simulated), 0)
        hidden = follow(estimator, u, self._seen(self.simulated_hidden), 0)
        return Estimated(
            name=name,
            horizons={steps[k]: error for k, error in ahead.items()},
            nis=float(found.nis[asked].sum() / found.received[asked].sum()),
            coloured=whiteness(found.innovations) if every == 1 else self._coloured(estimator),
            median_s=float(np.median(found.took_s)),
            p99_s=float(np.percentile(found.took_s, 99)),
            state_rmse=self._state_rmse(simulated, self.simulated),
            hidden_rmse=self._state_rmse(hidden, self.simulated_hidden),
            disturbed=self._disturbed(estimator, u),
            simulated=simulated,
        )

    def _coloured(self, estimator: Any) -> np.ndarray:
        """Whiteness needs neighbouring samples: those of the first part of the recording."""
        _, u, y = fed(self.plant, self.recording.part(0, 2 * ASKED))
        return whiteness(follow(estimator, u, y, 1).innovations[:, ASKED:])

    def _state_rmse(self, found: Followed, truth: Recording) -> dict[str, float]:
        return {name: rmse(found.state(name) - truth[name]) for name in found.names}

    def _disturbed(self, estimator: Any, u: np.ndarray) -> dict[str, np.ndarray]:
        """RMS error of each output of the simulation, (n_y,), by what the data lack."""
        seen, truth = self._seen(self.simulated), self.simulated.rows(self.plant.measured)
        noise = np.array([self.noise[name] for name in self.plant.measured])
        return disturbed(estimator, u, seen, truth, noise, self.recording.sample_time_s)

    def _made(self, name: str) -> Any:
        plant = self.plant.with_inputs_commanded()
        states, size = plant.model.states, self.deviations
        noise = noise_for(ESTIMATORS[name], plant, self.tuned.process_noise)
        estimator = ESTIMATORS[name](
            plant=plant,
            sample_time_s=self.recording.sample_time_s,
            measurement_noise=self.noise,
            process_noise=noise,
            initial_deviation=dict(zip(states, size, strict=True)),
        )
        _, u, y = fed(self.plant, self.recording)
        return suited(estimator, u, y, self.say)

    @cached_property
    def observed(self) -> Observed:
        """How well the outputs determine the states along the simulation."""
        _, u, _ = fed(self.plant, self.recording)
        states = self.simulated.rows(self.plant.model.states)
        return observed(self._made("ekf").filter, states, u)

    @cached_property
    def recording(self) -> Recording:
        """The first piece, no longer than the comparison takes."""
        first = self.whole.pieces[0]
        return first.part(0, min(len(first), round(LONGEST_S / first.sample_time_s)))

    @cached_property
    def plant(self) -> Plant:
        """The rig's plant for the outputs of the recording, lean."""
        plant = self.rig.fit_for(self.whole).lean()
        if not plant.model.states:
            raise InputError(
                Message("has no states to estimate", plant.name, "a plant with states")
            )
        return plant

    @cached_property
    def noise(self) -> dict[str, float]:
        """Sensor noise by output."""
        found = recorded_noise(self.whole, self.plant.measured)
        return {name: each.value for name, each in found.items()}

    @cached_property
    def deviations(self) -> np.ndarray:
        """Standard deviations of the states at the start, (n_x,)."""
        return guessed_states(self.plant, self.recording)[1, :, 0]

    @cached_property
    def tuned(self) -> TunedNoise:
        """Process noise by likelihood, from a share of each scale on."""
        plant = self.plant
        shares = [SHARES.get(name.rpartition(".")[2], 0.0) for name in plant.model.states]
        begun = dict(zip(plant.model.states, shares * plant.scale, strict=True))
        start = dict(zip(plant.model.states, self.deviations, strict=True))
        return tuned_noise(plant, self.recording, self.noise, begun, start, self.say)

    @cached_property
    def start(self) -> np.ndarray:
        return guessed_states(self.plant, self.recording)[0, :, 0]

    @cached_property
    def simulated(self) -> Recording:
        """The plant under the recorded inputs, without noise."""
        return simulate(self.plant, self.recording, self.start)

    @cached_property
    def simulated_hidden(self) -> Recording:
        """The same with an effect that the estimators do not know."""
        whole = self.rig.fit_for(self.whole)
        strength = whole.candidates[self.hidden].strength
        plant = whole.with_values({strength: whole.parameters[strength].typical}).lean()
        known = dict(zip(self.plant.model.states, self.start, strict=True))
        names = plant.model.states
        start = [known.get(n, v) for n, v in zip(names, plant.initial, strict=True)]
        return simulate(plant, self.recording, np.array(start))

    @cached_property
    def hidden(self) -> str:
        """Public name of the effect that is hidden, with its place."""
        plant = self.rig.fit_for(self.whole)
        absent = [
            name
            for name, each in plant.candidates.items()
            if each.cause.kind is Kind.EFFECT
            and plant.values[each.strength] == plant.parameters[each.strength].null
            and plant.ready_for(each)
        ]
        if self.hide and self.hide not in absent:
            near = nearest(self.hide, absent)
            raise InputError(Message("is not absent in the rig", self.hide, listed(absent), near))
        usual = (n for key in AMONG_HIDDEN for n in absent if n.partition("@")[0] == key)
        return self.hide or next(usual, absent[0])

    def _seen(self, truth: Recording) -> np.ndarray:
        """Outputs with sensor noise, (n_y, n), always the same; missing where the recording is."""
        rng = np.random.default_rng(0)
        y = truth.rows(self.plant.measured)
        size = np.array([self.noise[name] for name in self.plant.measured])
        seen = y + size[:, None] * rng.standard_normal(y.shape)
        seen[~np.isfinite(self.recording.rows(self.plant.measured))] = np.nan
        return seen
