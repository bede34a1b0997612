"""The soft joint of paper 004 on records: its two models, and how the paper fits them.

First principles are fitted by kappa and the discharge coefficients of filling and venting, bounded,
from several starts (SLSQP and Nelder-Mead on the mean square of a free run, as in the paper); the
parametric model by its time constant alone.

Source: paper 004, Figs. 7 and 8; S004-3 and S004-4 of physics.md 5.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from studies.truth.soft_joint_event import EventRecord, event_records
from workbench.called import called
from workbench.model import run_of
from workbench.plant import Plant
from workbench.plants.soft_joint import (
    COMMAND,
    COMPRESSIBILITY,
    MOLAR_MASS_KG_MOL,
    PRESSURE,
    soft_joint,
)
from workbench.plants.soft_joint_parametric import soft_joint_parametric
from workbench.recording import Recording
from workbench.whole_file import whole_file

PSI_PA = 6894.757
SAMPLE_TIME_S = 1.0 / 400
SUPPLY, VOLUME, TAU = "supply.pressure_pa", "bellows.volume_m3", "valve.time_constant_s"
KAPPA, C, ASYMMETRY = (
    "bellows.heat_capacity_ratio",
    "valve.discharge_coefficient",
    "valve.discharge_asymmetry",
)
KAPPA_BOUNDS, C_BOUNDS, TAU_BOUNDS = (1.05, 1.67), (0.3, 1.0), (0.01, 0.5)
TRAINING, JUDGED = 1, 3  # seeds
FITTED_S = 30.0  # of the record that models are fitted on
AFTER_S = 4.0  # of the event's mark on a free run


@dataclass(frozen=True)
class Data:
    """Two records of one bellows: to fit on, and to judge all on.

    event    first and last sample of the event in the second one
    """

    training: Recording
    judged: Recording
    event: tuple[int, int]

    @property
    def nominal(self) -> np.ndarray:
        """True outside the event and what follows it, shape (n,)."""
        away = np.ones(len(self.judged), dtype=bool)
        first, last = self.event
        away[first : last + round(AFTER_S / SAMPLE_TIME_S)] = False
        return away


@dataclass(frozen=True)
class Fitted:
    """One start of a search and where it ended: kappa, C of filling and of venting."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    rmse_psi: float

    @property
    def values(self) -> dict[str, float]:
        """The end as parameters of the plant."""
        return values_of(*self.end)


def recorded(duration_s: float, file: Path) -> Data:
    """Both records, the second of so many seconds; the truth takes minutes, so they are kept."""
    names = ("training", "judged")
    if not file.exists():
        batches = {FITTED_S: [TRAINING]}
        batches[duration_s] = [*batches.get(duration_s, []), JUDGED]
        made = [r for length, seeds in batches.items() for r in event_records(length, seeds)]
        columns = {
            f"{name} {key}": value
            for name, record in zip(names, made, strict=True)
            for key, value in {**record.table, "event": np.array(record.event)}.items()
        }
        file.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(file) as unfinished, unfinished.open("wb") as opened:
            np.savez(opened, **columns)
    with np.load(file) as kept:
        records = [
            EventRecord(
                {k.split(" ", 1)[1]: kept[k] for k in kept if k.startswith(f"{name} ")},
                tuple(kept[f"{name} event"].tolist()),
            )
            for name in names
        ]
    channels = [recording(r.table, n) for r, n in zip(records, names, strict=True)]
    return Data(*channels, records[-1].event)


def recording(table: Mapping[str, np.ndarray], name: str) -> Recording:
    """A table of the truth in SI units and the plant's signals."""
    channels = {
        COMMAND: table["command"],
        PRESSURE: 1e5 * table["pressure_bar"],
        SUPPLY: 1e5 * table["supply_bar"],
    }
    return Recording(name, SAMPLE_TIME_S, channels, source="studies/truth")


def first_principles(as_printed: bool = False) -> Plant:
    """The model of flows; as printed it lacks the molar mass, erratum E004-1."""
    plant = soft_joint().lean()
    if not as_printed:
        return plant
    larger = COMPRESSIBILITY / MOLAR_MASS_KG_MOL  # R T in place of Z R T / M: so much slower
    return plant.with_values({VOLUME: larger * plant.values[VOLUME]})


def parametric() -> Plant:
    """The model of one time constant, with the area map."""
    return soft_joint_parametric().lean()


class FreeRun:
    """Free runs of a plant over a record, from its first pressure, with other values."""

    def __init__(self, plant: Plant, recording: Recording) -> None:
        self.plant, self.recording, model = plant, recording, plant.model
        self._run = run_of(model.compiled_block(SAMPLE_TIME_S), len(recording) - 1)
        self._x0 = plant.initial
        self._x0[model.states.index(PRESSURE)] = recording[PRESSURE][0]
        self._row = model.states.index(PRESSURE)

    def __call__(self, values: Mapping[str, float] | None = None) -> np.ndarray:
        """Pressure at every sample, shape (n,)."""
        plant = self.plant
        p = plant.nominal[2].copy()
        for name, value in (values or {}).items():
            p[plant.model.parameters.index(name)] = value
        u, none = self.recording[COMMAND][None, :-1], np.zeros((0, len(self.recording) - 1))
        (later,) = called(self._run, self._x0, u, none, p)
        return np.hstack([self._x0[self._row], later[self._row]])

    def rmse_psi(self, values: Mapping[str, float] | None = None) -> float:
        """Root mean square of the free run less the record."""
        return float(np.sqrt(np.mean((self(values) - self.recording[PRESSURE]) ** 2))) / PSI_PA


def values_of(kappa: float, filling: float, venting: float) -> dict[str, float]:
    """Parameters of the plant for kappa and the two coefficients."""
    mean = (filling + venting) / 2.0
    return {KAPPA: kappa, C: mean, ASYMMETRY: (filling - venting) / (filling + venting)}


def several_starts(plant: Plant, recording: Recording, method: str, number: int) -> list[Fitted]:
    """Bounded searches for kappa, C of filling and of venting, best first.

    ``method`` is scipy's name of the search; the random starts are always the same.
    """
    run, rng = FreeRun(plant, recording), np.random.default_rng(4)
    bounds = np.array([KAPPA_BOUNDS, C_BOUNDS, C_BOUNDS])

    def squared(found: np.ndarray) -> float:
        return run.rmse_psi(values_of(*np.clip(found, *bounds.T))) ** 2

    found = []
    for _ in range(number):
        start = rng.uniform(*bounds.T)
        ended = minimize(squared, start, method=method, bounds=bounds.tolist())
        end = np.clip(ended.x, *bounds.T)
        error_psi = float(np.sqrt(squared(end)))
        found.append(Fitted(tuple(start.tolist()), tuple(end.tolist()), error_psi))
    return sorted(found, key=lambda each: each.rmse_psi)


def fitted_tau(plant: Plant, recording: Recording) -> float:
    """The one time constant whose free run is nearest to the record."""
    run = FreeRun(plant, recording)
    found = minimize_scalar(
        lambda tau: run.rmse_psi({TAU: tau}), bounds=TAU_BOUNDS, method="bounded"
    )
    return float(found.x)
