"""Published results that a position controller of the servo drive is measured against.

Each is run on the whole plant with its stiction, noise and 12-bit command, in study ``controllers``
a sample late (:func:`late`).  The plant's parameters are drawn from their uncertainty; design and
estimator keep the nominal ones, and know the payload within 20 %.  Errors are of the true position.

Source: Y. Zhu and E. J. Barth, "Accurate sub-millimeter servo-pneumatic tracking using model
reference adaptive control", 2010; G. M. Bone and S. Ning, "Experimental comparison of position
tracking control algorithms for pneumatic cylinder actuators", IEEE/ASME Trans. Mechatronics, 2007.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from controllers.design_file import design
from linearize.axes import stroke_m
from linearize.standard import POSITION
from studies.checking import apart, drawn
from studies.closed_loop_check import run, standard_estimator
from studies.closed_loop_metrics import Metrics, measure
from studies.scenarios import SAMPLE_TIME_S, Scenario
from workbench.closed_loop import LoopRecord
from workbench.contracts import Controller, Estimator
from workbench.plant import Plant
from workbench.plants.servo_drive import servo_drive
from workbench.rig import Rig, default_rig

MASS = "slide.mass_kg"
PAYLOADS_KG = (2.2, 5.8, 10.0)
PAYLOAD_KG = 5.8  # of studies that vary something else
KNOWN_WITHIN = 0.2
LATE_S = 1e-3  # of the commands, a sample: what is measured now acts from the next on; chosen
CYCLE_M = 0.1e-3  # motion at rest that counts as a limit cycle
FIRST_SEED = 1001  # of draws that no design was tuned on

FINAL, CYCLE, RISE, HALF, ONE, LARGE = (
    "60 mm step: final error (mm)",
    "60 mm step: motion at rest (mm)",
    "60 mm step: rise (ms)",
    "60 mm at 0.5 Hz: largest error (mm)",
    "60 mm at 1 Hz: largest error (mm)",
    "70 mm at 0.5 Hz: RMSE (mm)",
)
LIMITS = {FINAL: 0.05, CYCLE: 1e3 * CYCLE_M, RISE: 200.0, HALF: 0.7, ONE: 1.2, LARGE: 0.4}
"""Zhu and Barth, but for the motion at rest (no limit cycle) and the last, Bone and Ning's."""


@dataclass(frozen=True)
class Draw:
    """The plant that moves, and what design and estimator take it for."""

    payload_kg: float
    number: int
    plant: Plant
    believed: Plant


def draws(number: int, payloads_kg: tuple[float, ...] = PAYLOADS_KG) -> Iterator[Draw]:
    """The same draws at every call; those of one number differ in nothing but the payload."""
    for k in range(number):
        yield from _of(k, payloads_kg)


def draw_of(number: int, payload_kg: float) -> Draw:
    """The draw of one number that :func:`draws` gives, without those before it."""
    return next(_of(number, (payload_kg,)))


def _of(number: int, payloads_kg: tuple[float, ...]) -> Iterator[Draw]:
    rig = default_rig(servo_drive())
    rng = np.random.default_rng(FIRST_SEED + number)
    factor = rng.uniform(1.0 - KNOWN_WITHIN, 1.0 + KNOWN_WITHIN)
    found = drawn(_weighed(rig), rng)
    for kg in payloads_kg:
        believed = rig.plant.with_values({MASS: kg * factor})
        yield Draw(kg, number, found.with_values({MASS: kg}), believed)


def late(draw: Draw, delay_s: float = LATE_S) -> Draw:
    """The same draw with commands that come late, which design and estimator know."""
    delay = {"command_delay.delay_s": delay_s}
    plant, believed = (each.with_values(delay) for each in (draw.plant, draw.believed))
    return replace(draw, plant=plant, believed=believed)


def told_apart(draw: Draw) -> str:
    """What sets the plant of a draw apart but its payload, in standard deviations."""
    loaded = default_rig(servo_drive().with_values({MASS: draw.payload_kg}))
    return apart(loaded, draw.plant)


def figures_of(rows: Sequence[Mapping[str, float | None]], mark: str) -> np.ndarray:
    """One figure of all draws, (n_draws,); infinite where a draw has none."""
    return np.array([np.inf if row[mark] is None else row[mark] for row in rows], dtype=float)


def medians(rows: Sequence[Mapping[str, float | None]], marks: Iterable[str]) -> dict[str, float]:
    """Of every figure over the draws; infinite where most have none."""
    return {mark: float(np.median(figures_of(rows, mark))) for mark in marks}


def _weighed(rig: Rig) -> Rig:
    """The rig whose mass is not drawn, since the payload says it."""
    return replace(rig, fixed=rig.fixed | {MASS})


def step(plant: Plant) -> Scenario:
    """60 mm after 0.1 s, watched for 1.5 s."""
    time_s = SAMPLE_TIME_S * np.arange(1600)
    start_m = stroke_m(plant) / 2.0 - 0.03
    return Scenario("step", start_m + 0.06 * (time_s >= 0.1), 0.1, 0.1)


def sine(plant: Plant, frequency_hz: float, amplitude_m: float) -> Scenario:
    """Two periods about the middle, judged in the second."""
    n = round(2.0 / frequency_hz / SAMPLE_TIME_S)
    swing = np.sin(2.0 * np.pi * frequency_hz * SAMPLE_TIME_S * np.arange(n))
    middle_m = stroke_m(plant) / 2.0
    return Scenario("sine", middle_m + amplitude_m * swing, 0.0, 1.0 / frequency_hz)


@dataclass(frozen=True)
class Closed:
    """One design with one estimator on the plant that moves, to be run in any scenario."""

    plant: Plant
    controller: Controller
    estimator: Estimator
    seed: int

    def record(self, scenario: Scenario) -> LoopRecord:
        return run(self.plant, self.controller, self.estimator, scenario, self.seed)

    def metrics(self, scenario: Scenario) -> Metrics:
        return measure(self.plant, self.record(scenario), scenario, "", "")


def measured(draw: Draw, method: str, numbers: Mapping[str, Any]) -> dict[str, float]:
    """Every yardstick's number by its name; NaN where the loop does not stay finite.

    ``numbers`` are those of the design that differ from the method's own.
    """
    controller = design(method, draw.believed, numbers).controller
    estimator = standard_estimator("ekf", draw.believed, controller.sample_time_s)
    truth, found = draw.plant.lean(), {}
    loop = Closed(truth, controller, estimator, draw.number)

    def errors_m(scenario: Scenario) -> np.ndarray:
        moved = loop.record(scenario).recording[POSITION] - scenario.reference_m
        return moved[round(scenario.judged_s / SAMPLE_TIME_S) :]

    try:
        one = loop.metrics(step(truth))
        found |= {FINAL: 1e3 * one.final_error_m, CYCLE: 1e3 * one.limit_cycle_m}
        found |= {RISE: 1e3 * one.rise_s}
        found[HALF] = 1e3 * float(abs(errors_m(sine(truth, 0.5, 0.06))).max())
        found[ONE] = 1e3 * float(abs(errors_m(sine(truth, 1.0, 0.06))).max())
        found[LARGE] = 1e3 * float(np.sqrt(np.mean(errors_m(sine(truth, 0.5, 0.07)) ** 2)))
    except ArithmeticError:
        return dict.fromkeys(LIMITS, float("nan"))
    return found
