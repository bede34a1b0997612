"""What each plant besides drive and gearbox is to follow, through which sensors, how closely.

Noise of the sensors by physics.md section 2.  The bounds are those that the designs must hold on
drawn plants: the rig within 5 % of the amplitude up to 1 Hz, which the papers' PID holds to 0.3 Hz;
the arm at 2 rad/s and 1 Hz, for which paper 001 needs two sets of gains; the leg's foot on an
ellipse; and the soft joint's pressure in steps of 1 bar.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from math import pi, radians, tau

import numpy as np

from linearize.axes import joint_axes, travel_axis
from studies.scenarios import AFTER_S, LATE_S
from workbench.leg import Leg
from workbench.plant import Plant
from workbench.plants.soft_joint import ATMOSPHERE_PA
from workbench.plants.soft_joint import PRESSURE as BELLOWS

TICK_S = 1e-3
PLACE_NOISE_M, ANGLE_NOISE_RAD, PRESSURE_NOISE_PA, BELLOWS_NOISE_PA = (
    5e-5,
    radians(0.05),
    500.0,
    1e3,
)
RIG_AMPLITUDE_M, RIG_SHARE = 0.03, 0.05
ARM_MIDDLE_RAD, ARM_AMPLITUDE_RAD, ARM_RMSE_RAD = radians(56.0), radians(34.0), radians(1.5)
ELLIPSE_M, ELLIPSE_HZ, FOOT_RMSE_M = (0.1, 0.06), 0.5, 6e-3
STEP_PA, BAND, STEPS = 1e5, 0.05, 4
STEP, STEP_BEGINS_S, STEP_LASTS_S = "step", 0.1, 1.6
RIG_STEP_M, RIG_FINAL_M, ARM_STEP_RAD, ARM_FINAL_RAD = 0.05, 1e-3, radians(30.0), radians(1.0)
WITHIN = {"m": 0.2e-3, "rad": radians(0.2)}  # of its target a step is settled, by unit


@dataclass(frozen=True)
class Task:
    """One run: references by output, shape (n,) each, judged from a time on.

    It begins at rest where ``start`` says, at the beginning of the reference by default.  ``asked``
    says by figure of a run what it may be at most, where that does not depend on the run.
    ``afterwards`` is how the references would go on after the run, shape (m,) each.
    """

    name: str
    reference: Mapping[str, np.ndarray]
    judged_s: float
    asked: Mapping[str, float] = field(default_factory=dict)
    start: Mapping[str, float] = field(default_factory=dict)
    afterwards: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def begin(self) -> dict[str, float]:
        """Where the run begins, by output."""
        return {name: float(row[0]) for name, row in self.reference.items()} | dict(self.start)

    @property
    def ends_at_rest(self) -> bool:
        """True where all references stand still at the end."""
        late = -round(LATE_S / TICK_S)
        return all(bool(np.ptp(row[late:]) == 0.0) for row in self.reference.values())


@dataclass(frozen=True, kw_only=True)
class Bench:
    """How a plant is controlled on the bench.

    Attributes
    ----------
    best
        The design that is to hold on drawn plants, by its name in the list of controllers.
    tasks
        Those of a plant.
    noise, process
        Standard deviation of each output, and what each state gains per root of a second.
    lines
        Figure of a run by the line of a specification that asks for it.
    sample_time_s
        Of the plant.
    """

    best: str
    tasks: Callable[[Plant], Iterator[Task]]
    noise: Callable[[Plant], Mapping[str, float]]
    process: Callable[[Plant], Mapping[str, float]]
    lines: Mapping[str, str]
    sample_time_s: float = TICK_S


def rig_tasks(plant: Plant) -> Iterator[Task]:
    """Sines of 30 mm about the middle of the stroke, judged after half a period; 50 mm at once."""
    axis = travel_axis(plant)
    middle_m = sum(axis.ends) / 2.0
    for hz in (0.25, 0.5, 1.0):
        n, time_s = _clock(1.5 / hz)
        wanted = middle_m + RIG_AMPLITUDE_M * np.sin(tau * hz * time_s)
        asked = {"largest_error_m": RIG_SHARE * RIG_AMPLITUDE_M}
        yield _moving(f"{hz:g}-hz", {axis.position: wanted}, n, 0.5 / hz, asked)
    yield _stepped(axis.position, middle_m, RIG_STEP_M, {"final_error_m": RIG_FINAL_M})


def arm_tasks(plant: Plant) -> Iterator[Task]:
    """22 to 90 degrees, two periods from the lower end, judged in the second; 30 at once."""
    axis = travel_axis(plant)
    for name, rate_rad_s in (("2-rad-s", 2.0), ("1-hz", tau)):
        n, time_s = _clock(2.0 * tau / rate_rad_s)
        swing = np.sin(rate_rad_s * time_s - pi / 2.0)
        wanted = ARM_MIDDLE_RAD + ARM_AMPLITUDE_RAD * swing
        asked = {"rmse_rad": ARM_RMSE_RAD}
        yield _moving(name, {axis.position: wanted}, n, tau / rate_rad_s, asked)
    asked = {"final_error_rad": ARM_FINAL_RAD}
    yield _stepped(axis.position, ARM_MIDDLE_RAD, ARM_STEP_RAD, asked)


def leg_tasks(plant: Plant) -> Iterator[Task]:
    """The foot from where it stands along an upright ellipse, two periods, judged in the second."""
    leg = leg_of(plant)
    start_m = [float(x) for x in leg.geometry.foot_m(leg_angles_rad(plant))]
    n, time_s = _clock(2.0 / ELLIPSE_HZ)
    turned = tau * ELLIPSE_HZ * time_s
    wide_m, high_m = ELLIPSE_M
    across = start_m[1] + wide_m / 2.0 * (np.cos(turned) - 1.0)
    up = start_m[2] + high_m / 2.0 * np.sin(turned)
    foot = np.column_stack([np.full(len(turned), start_m[0]), across, up])
    angles = np.array([leg.geometry.angles_rad(place) for place in foot]).T
    names = (f"{joint}.angle_rad" for joint in leg.joints)
    reference = dict(zip(names, angles, strict=True))
    yield _moving("ellipse", reference, n, 1.0 / ELLIPSE_HZ, {"rmse_m": FOOT_RMSE_M})


def vessel_tasks(plant: Plant) -> Iterator[Task]:
    """Steps of 1 bar up and down; the name says from and to, in bar over the atmosphere."""
    n = round(0.6 / 5e-4)
    ways = [(k, k + 1) for k in range(STEPS)] + [(k, k - 1) for k in range(STEPS, 0, -1)]
    for begin, end in ways:
        pressures = np.full(n, ATMOSPHERE_PA + end * STEP_PA)
        asked, start = {"overshoot_pa": BAND * STEP_PA}, ATMOSPHERE_PA + begin * STEP_PA
        yield Task(f"{begin}-{end}", {BELLOWS: pressures}, 0.0, asked, {BELLOWS: start})


def _clock(lasts_s: float) -> tuple[int, np.ndarray]:
    """Samples of a run, and its time in s, shape (n + m,), which goes on after its end."""
    n = round(lasts_s / TICK_S)
    return n, TICK_S * np.arange(n + round(AFTER_S / TICK_S))


def _stepped(name: str, middle: float, size: float, asked: Mapping[str, float]) -> Task:
    """A step about the middle, judged from when it begins."""
    time_s = TICK_S * np.arange(round(STEP_LASTS_S / TICK_S))
    wanted = middle - size / 2.0 + size * (time_s >= STEP_BEGINS_S)
    return Task(STEP, {name: wanted}, STEP_BEGINS_S, asked)


def _moving(
    name: str,
    wanted: Mapping[str, np.ndarray],
    n: int,
    judged_s: float,
    asked: Mapping[str, float],
) -> Task:
    """The first n samples of references that go on moving, shape (n + m,) each."""
    run, after = (
        {key: row[part] for key, row in wanted.items()} for part in (slice(n), slice(n, None))
    )
    return Task(name, run, judged_s, asked, afterwards=after)


def leg_of(plant: Plant) -> Leg:
    """The rigid body of a leg."""
    return next(part for part in plant.parts if isinstance(part, Leg))


def leg_angles_rad(plant: Plant) -> list[float]:
    """Where its joints begin."""
    initial = dict(zip(plant.model.states, plant.initial, strict=True))
    return [float(initial[f"{joint}.angle_rad"]) for joint in leg_of(plant).joints]


def cylinder_noise(plant: Plant) -> dict[str, float]:
    """Of places or angles and pressures, by output."""
    sizes = {"_m": PLACE_NOISE_M, "_rad": ANGLE_NOISE_RAD, "_pa": PRESSURE_NOISE_PA}
    return {
        name: next(size for end, size in sizes.items() if name.endswith(end))
        for name in plant.measured
    }


def rod_process(plant: Plant) -> dict[str, float]:
    """Chosen: what drawn friction and flow do to a rod."""
    axis = travel_axis(plant)
    return {axis.velocity: 0.1, **dict.fromkeys(axis.pressures, 1e3)}


def joint_process(plant: Plant) -> dict[str, float]:
    """Chosen: less flow loses the joints of drawn plants, more speed makes their commands noisy."""
    axes = joint_axes(plant)
    flows = dict.fromkeys((name for axis in axes for name in axis.pressures), 2e4)
    return {**{axis.velocity: 1.0 for axis in axes}, **flows}


FOLLOWING_LINES = {
    "tracking_error": "rmse",
    "largest_error": "largest_error",
    "air": "air_kg",
    "switches": "switches",
}
STEP_LINES = {
    "rise_time": "rise_s",
    "settling_time": "settling_s",
    "overshoot": "overshoot",
    "final_error": "final_error",
    "limit_cycle": "limit_cycle",
    "air": "air_kg",
    "switches": "switches",
}
WITH_UNIT = ("rmse", "largest_error", "overshoot", "final_error", "limit_cycle")


def _lines(unit: str, *lines: Mapping[str, str]) -> dict[str, str]:
    """Figures by line, those of what is followed in its unit."""
    every = {name: figure for each in lines for name, figure in each.items()}
    return {n: f"{f}_{unit}" if f in WITH_UNIT else f for n, f in every.items()}


BENCHES: dict[str, Bench] = {
    "crr_rig": Bench(
        best="axis-lq",
        tasks=rig_tasks,
        noise=cylinder_noise,
        process=rod_process,
        lines=_lines("m", STEP_LINES, FOLLOWING_LINES),
    ),
    "crr_arm": Bench(
        best="axis-lq",
        tasks=arm_tasks,
        noise=cylinder_noise,
        process=joint_process,
        lines=_lines("rad", STEP_LINES, FOLLOWING_LINES),
    ),
    "crr_leg": Bench(
        best="joint-lq",
        tasks=leg_tasks,
        noise=cylinder_noise,
        process=joint_process,
        lines=_lines("m", FOLLOWING_LINES),
    ),
    "soft_joint": Bench(
        best="pressure",
        tasks=vessel_tasks,
        noise=lambda plant: {BELLOWS: BELLOWS_NOISE_PA},
        process=lambda plant: {BELLOWS: 1e5},
        lines=_lines("pa", STEP_LINES),
        sample_time_s=5e-4,
    ),
}
"""The benches by plant."""
