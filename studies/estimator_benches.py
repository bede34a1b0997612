"""The estimators as the study of them builds them: plant, sensors, noise and disturbance."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.signal import lfilter

from estimators import ESTIMATORS
from estimators.augmentation import AugmentedPlant, Unknown, augmented
from estimators.scheduled_kalman import noise_for
from estimators.tuning import tuned_noise
from studies.estimator_truths import TrueRun
from workbench.effects.empirical_fillings import ConstantFlow
from workbench.plant import Plant
from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import OUTPUTS, servo_drive
from workbench.plants.soft_joint import PRESSURE, soft_joint
from workbench.recording import Recording

VELOCITY = "slide.velocity_m_s"
SENSORS = {  # noise and grid of physics.md section 2 together
    "slide.position_m": float(np.hypot(5e-6, 5e-6 / 12**0.5)),
    **dict.fromkeys(OUTPUTS[1:], float(np.hypot(500.0, 10e5 / 4096 / 12**0.5))),
    **dict.fromkeys(
        ("chamber_1.pressure_pa", "chamber_2.pressure_pa"),
        float(np.hypot(1e3, 16e5 / 4096 / 12**0.5)),
    ),
    "main_piston.position_m": float(np.hypot(20e-6, 30e-3 / 4096 / 12**0.5)),
    PRESSURE: float(np.hypot(1e3, 10e5 / 4096 / 12**0.5)),
}
CORNER_HZ, FORCE_N = 20.0, 1.0  # of the process disturbance, physics.md section 2
FLOW_KG_S = 0.005 * 25.7e-3
NUMERICAL = {VELOCITY: 2e-3, **dict.fromkeys(OUTPUTS[1:], 50.0)}  # two integrators differ
AT_REST = {  # deviations of a drive that stands at room temperature
    "slide.position_m": 2e-5,
    VELOCITY: 2e-3,
    **dict.fromkeys(OUTPUTS[1:], 2e3),
    "friction.deflection_m": 2e-5,
}
WARMTH_SHARE = 3e-3  # of a gas mass
LAGS_S = np.geomspace(3e-4, 3e-2, 41)  # of the filtered derivative, among which the best is taken


def disturbed_drive() -> AugmentedPlant:
    """The drive with the true process disturbance among its states: a force and two flows."""
    flows = [ConstantFlow(name=f"flow_{c[-1]}", chamber=c) for c in ("chamber_a", "chamber_b")]
    names = [flow.name for flow in flows]
    plant = servo_drive().with_effects(*flows).lean(keep=("constant_force", *names))
    tau_s = 1.0 / (2.0 * np.pi * CORNER_HZ)
    return augmented(
        plant,
        [
            Unknown("constant_force.force_n", FORCE_N, tau_s),
            *(Unknown(f"{name}.constant_kg_s", FLOW_KG_S, tau_s) for name in names),
        ],
    )


def consistent(name: str) -> Any:
    """An estimator that knows the disturbance's statistics, for the drive with all sensors."""
    plant = disturbed_drive()
    return made(name, plant, NUMERICAL | plant.process_noise, at_rest(plant))


def at_rest(plant: Plant) -> dict[str, float]:
    """Standard deviations at the start by state: gas at room temperature within 1 K."""
    found = {n: s for n, s in AT_REST.items() if n in plant.model.states}
    for state, value in zip(plant.model.states, plant.initial, strict=True):
        if state.endswith(".mass_kg"):
            found[state] = WARMTH_SHARE * float(value)
    return found


def made(
    name: str, plant: Plant, process_noise: Mapping[str, float], start: Mapping[str, float]
) -> Any:
    """An estimator for a plant with the sensors of physics.md section 2."""
    return ESTIMATORS[name](
        plant=plant,
        sample_time_s=1.0 / 400 if plant.name == "soft_joint" else 1e-3,
        measurement_noise={n: SENSORS[n] for n in plant.measured},
        process_noise=noise_for(ESTIMATORS[name], plant, process_noise),
        initial_deviation=start,
    )


BENCHES: dict[str, Callable[[], Plant]] = {
    "servo_drive": servo_drive,
    "gearbox": gearbox,
    "soft_joint": soft_joint,
}
BEGUN = {  # process noise from which the likelihood is searched, as a share of each scale
    "velocity_m_s": 0.3,
    "velocity_rad_s": 0.3,
    "pressure_pa": 0.3,
}


def tuned(plant: Plant, run: TrueRun, samples: int, say: Callable[[str], None]) -> dict[str, float]:
    """Process noise by likelihood on the first samples of a run."""
    states = zip(plant.model.states, plant.scale, strict=True)
    begun = {n: BEGUN.get(n.rpartition(".")[2], 0.0) * float(size) for n, size in states}
    noise = {n: SENSORS[n] for n in plant.measured}
    found = tuned_noise(plant, recorded(plant, run).part(0, samples), noise, begun, start(plant),
                        say)  # fmt: skip
    return dict(found.process_noise)


def start(plant: Plant) -> dict[str, float]:
    """Deviations at the start of a plant that stands: small in all that is not measured."""
    if plant.name == "servo_drive":
        return at_rest(plant)
    sizes = zip(plant.model.states, plant.scale, strict=True)
    return {name: SENSORS.get(name, 0.01 * float(size)) for name, size in sizes}


def recorded(plant: Plant, run: TrueRun) -> Recording:
    """A true run as a recording of a plant's signals."""
    rows = np.vstack([run.commands, run.measured])
    names = (*plant.model.commands, *plant.measured)
    return Recording("truth", run.sample_time_s, dict(zip(names, rows, strict=True)))


def derivative_rmse(runs: Sequence[TrueRun], row: int, velocity: str, first: int) -> float:
    """RMS error of the filtered derivative of a measured position, by the lag that is best for it.

    The difference behind a first-order lag, causal as the estimators are.
    """
    return min(_of_lag(runs, row, velocity, first, lag_s) for lag_s in LAGS_S)


def _of_lag(runs: Sequence[TrueRun], row: int, velocity: str, first: int, lag_s: float) -> float:
    errors = []
    for run in runs:
        dt = run.sample_time_s
        share = dt / (dt + lag_s)
        y = run.measured[row]
        found = lfilter([share / dt, -share / dt], [1.0, share - 1.0], y - y[0])
        errors.append((found - run.truth[velocity])[first:])
    return float(np.sqrt(np.mean(np.square(errors))))
