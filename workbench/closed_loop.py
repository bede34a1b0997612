"""The closed loop: a sampled controller, seen through sensors, on the continuous plant.

The clock is explicit.  y[k] is measured at t[k], the estimate and the command are worked out from
it, and u[k] acts from t[k] to t[k+1].  The plant moves in finer steps than the controller, so that
what happens between two commands is in the record.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np

from workbench.arrivals import Arrivals
from workbench.called import prepared
from workbench.contracts import Controller, Estimator
from workbench.plant import Plant, Signal
from workbench.recording import Recording


@dataclass(frozen=True, kw_only=True)
class Hardware:
    """Sensors and converter between the plant and the computer.

    Attributes
    ----------
    noise
        Standard deviation by output.
    resolution
        Smallest difference that a sensor shows, by output.
    converter_bits
        Of the command, over its range.
    """

    noise: Mapping[str, float] = field(default_factory=dict)
    resolution: Mapping[str, float] = field(default_factory=dict)
    converter_bits: int = 12

    def measured(self, plant: Plant, outputs: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """What the computer reads of the outputs, shape (n_y,); ``normal`` is unit noise."""
        noise = np.array([self.noise.get(name, 0.0) for name in plant.measured])
        grid = np.array([self.resolution.get(name, 0.0) for name in plant.measured])
        seen = outputs + noise * normal
        coarse = grid > 0.0
        seen[coarse] = np.round(seen[coarse] / grid[coarse]) * grid[coarse]
        return seen

    def sent(self, plant: Plant, command: np.ndarray) -> np.ndarray:
        """What the valves get of a command: within its range, on the converter's grid.

        A switched command takes the nearest of its levels.
        """
        pairs = zip(plant.commands, command, strict=True)
        return np.array([self._converted(signal, float(value)) for signal, value in pairs])

    def _converted(self, signal: Signal, value: float) -> float:
        if signal.levels:
            return min(signal.levels, key=lambda level: abs(level - value))
        step = (signal.upper - signal.lower) / (2**self.converter_bits - 1)
        limited = np.clip(value, signal.lower, signal.upper)
        return signal.lower + np.round((limited - signal.lower) / step) * step


@dataclass(frozen=True)
class LoopRecord:
    """One run in closed loop, on the plant's clock, n samples.

    Attributes
    ----------
    recording
        References, commands, states and true outputs of the plant by name.
    measured
        What the computer read, shape (n_y, n); held between its samples.
    estimates
        By state name, shape (n,); held between samples.
    control_time_s, estimate_time_s
        Wall time of each controller step and each estimator update, shape (n_ticks,).
    notes
        What controller and estimator noted, by name, NaN where nothing, shape (n_ticks,).
    fallback
        Where the controller noted that it had no answer of its own and fell back, (n_ticks,).
    """

    recording: Recording
    measured: np.ndarray
    estimates: Mapping[str, np.ndarray]
    control_time_s: np.ndarray
    estimate_time_s: np.ndarray
    notes: Mapping[str, np.ndarray]
    fallback: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=bool))


def close_loop(
    plant: Plant,
    controller: Controller,
    estimator: Estimator,
    reference: Mapping[str, np.ndarray],
    *,
    afterwards: Mapping[str, np.ndarray] | None = None,
    initial: np.ndarray | None = None,
    hardware: Hardware | None = None,
    sample_time_s: float = 1e-3,
    seed: int = 0,
) -> LoopRecord:
    """The plant under a controller that sees it through an estimator.

    Parameters
    ----------
    reference
        By name, one value per sample of the plant, shape (n,).
    afterwards
        How it would go on, for controllers with a preview, by name, any number of samples; after
        the last one it stands still.
    initial
        State of the plant at the start, shape (n_x,), its own initial state by default.
    sample_time_s
        Of the plant; the controller's must be a whole multiple, the estimator's the same as that.

    Raises
    ------
    ValueError
        If the sample times do not fit.
    ArithmeticError
        If the plant's state is no longer finite.
    """
    every = _ticks(controller, estimator, sample_time_s)
    hardware = hardware or Hardware()
    n = len(next(iter(reference.values())))
    wanted = _wanted(reference, afterwards or {})
    preview = every * np.arange(controller.preview)
    normal = np.random.default_rng(seed).standard_normal((n, len(plant.measured)))
    plant_step = _Plant(plant, sample_time_s, n)
    x = np.array(plant.initial if initial is None else initial, dtype=float)
    command, estimate, ticks, rows = controller.start(), None, [], []
    for k in range(n):
        y = plant_step.outputs(x)
        read = plant_step.received(y, k)
        if k % every == 0:
            seen = hardware.measured(plant, read, normal[k])
            begun = perf_counter()
            estimate = estimator.start(seen) if estimate is None else estimate
            estimate = estimator.update(estimate, command.value, seen)
            known = perf_counter()
            coming = k + round(estimate.ahead_s / sample_time_s) + preview
            looked = wanted[:, np.clip(coming, 0, wanted.shape[1] - 1)]
            command = controller.step(command, looked, estimate)
            done = perf_counter()
            command = replace(command, value=hardware.sent(plant, command.value))
            noted = {**estimate.notes, **command.notes}
            own = command.notes.get("fallback", 0.0)  # an estimator may note one too
            ticks.append((done - known, known - begun, noted, own))
        rows.append((command.value, x, y, seen, estimate.state))
        x = plant_step(x, command.value, k)
    return _record(plant, reference, sample_time_s, rows, ticks, estimate.names)


def _wanted(
    reference: Mapping[str, np.ndarray], afterwards: Mapping[str, np.ndarray]
) -> np.ndarray:
    """The reference and how it goes on after it, a row for each name."""
    return np.array([np.append(row, afterwards.get(name, ())) for name, row in reference.items()])


def _ticks(controller: Controller, estimator: Estimator, sample_time_s: float) -> int:
    """Samples of the plant per sample of the controller."""
    every = round(controller.sample_time_s / sample_time_s)
    if abs(every * sample_time_s - controller.sample_time_s) > 1e-9 or every < 1:
        raise ValueError(
            f"a controller every {controller.sample_time_s:g} s: no multiple of {sample_time_s:g} s"
        )
    if abs(estimator.sample_time_s - controller.sample_time_s) > 1e-9:
        raise ValueError(
            f"the estimator runs every {estimator.sample_time_s:g} s, "
            f"the controller every {controller.sample_time_s:g} s"
        )
    return every


class _Plant:
    """The plant's step on arrays, with the causes in time on its commands and outputs."""

    def __init__(self, plant: Plant, sample_time_s: float, n: int) -> None:
        self.name, self.sample_time_s = plant.name, sample_time_s
        model, (u, d, p) = plant.model, plant.nominal
        self.down = Arrivals(plant.members, model.commands, n, sample_time_s, before=u)
        self.received = Arrivals(plant.members, model.measured, n, sample_time_s)
        self.step, self.f = prepared(model.compiled_step(sample_time_s)), prepared(model.f)
        self.u, self.d, self.p = (np.array(each, dtype=float) for each in (u, d, p))

    def outputs(self, x: np.ndarray) -> np.ndarray:
        return self.f(x, self.u, self.d, self.p)[1]

    def __call__(self, x: np.ndarray, command: np.ndarray, k: int) -> np.ndarray:
        (x,) = self.step(x, self.down(command, k), self.d, self.p)
        if not np.isfinite(x).all():
            at_s = (k + 1) * self.sample_time_s
            raise ArithmeticError(f"{self.name}: the closed loop is not finite at {at_s:.4g} s")
        return x


def _record(
    plant: Plant,
    reference: Mapping[str, np.ndarray],
    sample_time_s: float,
    rows: list,
    ticks: list,
    names: Iterable[str],
) -> LoopRecord:
    model = plant.model
    u, x, y, seen, state = (np.array(column).T for column in zip(*rows, strict=True))
    values = np.vstack([u, x, y])
    channels = dict(zip((*model.commands, *model.states, *model.measured), values, strict=True))
    channels |= {f"reference.{name}": row for name, row in reference.items()}
    noted = {key for tick in ticks for key in tick[2]}
    return LoopRecord(
        recording=Recording(plant.name, sample_time_s, channels, source="closed loop"),
        measured=seen,
        estimates=dict(zip(names, state, strict=True)),
        control_time_s=np.array([tick[0] for tick in ticks]),
        estimate_time_s=np.array([tick[1] for tick in ticks]),
        notes={key: np.array([tick[2].get(key, np.nan) for tick in ticks]) for key in noted},
        fallback=np.array([tick[3] > 0.0 for tick in ticks]),
    )
