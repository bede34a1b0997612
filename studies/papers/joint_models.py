"""Study ``joint-models``: what of the actuator's model matters once it turns the papers' joint.

S000-7   steps over most of 17 to 95 deg: the full model beside the joint (paper 000, Fig. 14)
S000-8   linear area and fixed pressures in place of segment and tanh (Fig. 16)
S000-9   viscous friction alone (Fig. 18)
S001-4   steps of the voltage in open loop, by paper 001's model (Fig. 10)
S001-5   ramps of the voltage (Fig. 11)

Geometry, masses and gains are *chosen* (physics.md 2.2); what stands for the joint is told in
``studies/papers/joint_runs.py``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from studies.figures.panels import Line, Panel, panels_figure
from studies.figures.style import BLACK, BLUE, GREEN, ORANGE, PAGE_IN, RED
from studies.papers.findings import Finding, outcome
from studies.papers.joint_runs import (
    HARDWARE,
    PAPER_001,
    PLATEAU,
    PULSES_V,
    RAMPS_V_S,
    STEPS_DEG,
    VELOCITY,
    Pulse,
    Steps,
    at_low_angle,
    bend,
    joints,
    model,
    pulse,
    ramp,
    read,
    stepped,
)
from studies.papers.loops import DT, MODELS, VISCOUS_ONLY
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns

RANGE_DEG = 95.0 - 17.0
FULL, LINEAR, VISCOUS = MODELS
DRAWS = {Extent.QUICK: 3, Extent.FULL: 20}
HEAVIER = {**VISCOUS_ONLY, "link.mass_kg": 0.8}
Ramps = Mapping[float, tuple[np.ndarray, np.ndarray]]


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Steps, pulses, ramps; nothing is kept."""
    real, models = [], {}
    for k, joint in enumerate(joints(DRAWS[extent]), start=1):
        say(f"steps of drawn joint {k}")
        real.append(stepped(joint, HARDWARE, seed=k))
    for name, values in MODELS.items():
        say(f"steps of the {name}")
        models[name] = stepped(model(values))
    say("open loop")
    bare = model(PAPER_001)
    seen = {level: pulse(level, bare) for level in PULSES_V}
    pulses = {level: read(each) for level, each in seen.items()}
    drifts = {
        name: read(pulse(PULSES_V[0], model(values))).drift
        for name, values in (("as chosen", VISCOUS_ONLY), ("0.3 kg more", HEAVIER))
    }
    low = at_low_angle(bare)
    ramps = {rate: ramp(rate, low) for rate in RAMPS_V_S}
    tables = [_step_table(real, models), _pulse_table(pulses)]
    found = [*_findings(real, models), *_open_findings(pulses, drifts, ramps)]
    claims = [*_claims(real, models), *_open_claims(pulses, drifts, ramps)]
    speeds = {level: np.degrees(each[VELOCITY]) for level, each in seen.items()}
    figures = {"steps": _step_figure(real, models), "open_loop": _open_figure(speeds, ramps)}
    return outcome(found, claims, figures, tables)


def _rmse(real: list[Steps], models: Mapping[str, Steps], name: str) -> np.ndarray:
    return np.array([each.rmse(models[name]) for each in real])


def _step_table(real: list[Steps], models: Mapping[str, Steps]) -> str:
    rows = [
        (f"joint {k}", "-", "-", *(f"{u:.0f}" for u in each.unrest))
        for k, each in enumerate(real, start=1)
    ]
    for name, each in models.items():
        bar = 1e-5 * np.median([r.pressure_rmse(each) for r in real])
        rmse = f"{np.median(_rmse(real, models, name)):.2f}"
        rows.append((name, rmse, f"{bar:.2f}", *(f"{u:.0f}" for u in each.unrest)))
    rests = (f"deg/s at {degrees:g} deg" for degrees in STEPS_DEG)
    return columns(("steps", "RMSE deg, median", "pressures bar", *rests), rows)


def _pulse_table(pulses: Mapping[float, Pulse]) -> str:
    rows = [
        (f"{level:g} V", f"{p.peak:.0f}", str(p.swings), f"{p.settled_s:.2f}", f"{p.drift:.1f}")
        for level, p in pulses.items()
    ]
    head = ("paper 001's model", "peak deg/s", "swings", "settled s", "drift deg/s")
    return columns(head, rows)


def _findings(real: list[Steps], models: Mapping[str, Steps]) -> Iterator[Finding]:
    why = (
        "the joint is the model itself, drawn and with what the model lacks; the paper's had its "
        "own geometry and masses"
    )
    full = float(np.median(_rmse(real, models, FULL)))
    told = f"{full:.1f} deg, {full / RANGE_DEG:.1%}"
    yield Finding("S000-7", "RMSE, full model", "2.6 deg, < 3.5 % of 78 deg", told, why)
    for row, name, printed in (
        ("S000-8", LINEAR, "more oscillation"),
        ("S000-9", VISCOUS, "heavily oscillatory"),
    ):
        rmse = float(np.median(_rmse(real, models, name)))
        told = f"RMSE {rmse:.1f} deg, speed {models[name].unrest.max():.0f} deg/s"
        yield Finding(row, name, printed, told)
    joints_s = ", ".join(f"{each.unrest.max():.0f}" for each in real)
    why = "with a valve of 100 Hz the chosen gains leave some drawn joints little margin at 60 deg"
    told = f"{models[FULL].unrest.max():.0f} deg/s, joints {joints_s}"
    yield Finding("S000-7", "full model, largest speed at rest", "holds a position", told, why)


def _open_findings(
    pulses: Mapping[float, Pulse], drifts: Mapping[str, float], ramps: Ramps
) -> Iterator[Finding]:
    first, last = pulses[PULSES_V[0]], pulses[PULSES_V[-1]]
    told = f"{first.settled_s:.2f} s at {PULSES_V[0]:g} V, {last.settled_s:.2f} at {PULSES_V[-1]:g}"
    yield Finding("S001-4", "settling of the speed", "grows with the voltage", told,
                  "counted to within 5 deg/s, which the paper does not say")  # fmt: skip
    why = (
        "a shut valve holds the arm; with holes that never close the pressure on the rod's area "
        "carries the chosen link nearly, and a heavier one sinks"
    )
    told = ", ".join(f"{name} {drift:.1f} deg/s" for name, drift in drifts.items())
    yield Finding("S001-4", "drift by gravity", "seen", told, why)
    told = ", ".join(f"{bend(*each):+.2f}" for each in ramps.values())
    rates = ", ".join(f"{rate:g}" for rate in ramps)
    yield Finding("S001-5", f"bend of the speed at {rates} V/s", "curvature", told,
                  "part of a parabola over the straight part at the end of the range")  # fmt: skip


def _claims(real: list[Steps], models: Mapping[str, Steps]) -> Iterator[Claim]:
    by = {name: _rmse(real, models, name) for name in MODELS}
    told = f"{np.median(by[FULL]):.2f} deg, worst {by[FULL].max():.2f}"
    claim = "S000-7: the full model is within 3.5 % of the range of every drawn joint"
    yield Claim(claim, told, by[FULL].max() < 0.035 * RANGE_DEG)
    told = f"{np.median(by[VISCOUS]):.2f} deg against {np.median(by[FULL]):.2f}"
    claim = "S000-9: with viscous friction alone it is worse at every one"
    yield Claim(claim, told, (by[VISCOUS] > by[FULL]).all())
    worst = float(models[VISCOUS].unrest.max())
    joint = float(np.median([each.unrest.max() for each in real]))
    told = f"{worst:.0f} deg/s, full {models[FULL].unrest.max():.0f}, joints {joint:.0f}"
    claim = "S000-9: it oscillates where full model and median joint rest: ten times their speed"
    yield Claim(claim, told, worst > 10 * max(models[FULL].unrest.max(), joint))
    linear, full = (float(models[name].unrest.mean()) for name in (LINEAR, FULL))
    claim = "S000-8: linear area and fixed pressures oscillate more than the full model"
    yield Claim(claim, f"{linear:.1f} against {full:.1f} deg/s, mean of plateaus", linear > full)
    bar = [
        1e-5 * float(np.median([each.pressure_rmse(models[name]) for each in real]))
        for name in MODELS
    ]
    claim = "the full model also has the best pressures, in the median over drawn joints"
    told = ", ".join(f"{each:.2f}" for each in bar)
    yield Claim(claim, f"{told} bar", min(bar[1:]) > bar[0])


def _open_claims(
    pulses: Mapping[float, Pulse], drifts: Mapping[str, float], ramps: Ramps
) -> Iterator[Claim]:
    settled = [each.settled_s for each in pulses.values()]
    told = ", ".join(f"{each:.2f}" for each in settled)
    claim = "S001-4: stable and underdamped, and settling grows with the voltage"
    swings = min(each.swings for each in pulses.values())
    yield Claim(claim, f"{told} s, {swings} swings and more",
                swings >= 2 and bool((np.diff(settled) > 0).all()))  # fmt: skip
    told = f"{drifts['0.3 kg more']:.1f} deg/s, as chosen {drifts['as chosen']:.1f}"
    claim = "S001-4: behind a pulse a link of 0.8 kg sinks by 2 deg/s and more"
    yield Claim(claim, told, drifts["0.3 kg more"] < -2.0)
    bends = [bend(*each) for each in ramps.values()]
    told = ", ".join(f"{each:+.2f}" for each in bends)
    claim = "S001-5: the speed bends over the voltage, the same way on every ramp, by a tenth"
    yield Claim(claim, told, max(bends) < -0.1)


def _step_figure(real: list[Steps], models: Mapping[str, Steps]):
    time_s = DT * np.arange(len(STEPS_DEG) * PLATEAU)
    wanted = Line(time_s, np.repeat(STEPS_DEG, PLATEAU), "reference", ":", BLACK)
    looks = {FULL: ("-", BLUE), LINEAR: ("--", ORANGE), VISCOUS: ("-", RED)}
    panels = []
    for name, (style, colour) in looks.items():
        lines = [Line(time_s, each.angle, "drawn joints", "-", "0.6", 0.6) for each in real]
        lines += [wanted, Line(time_s, models[name].angle, name, style, colour)]
        panels.append(Panel("time (s)", "joint angle (deg)", lines, y_range=(15.0, 100.0)))
    return panels_figure([panels], PAGE_IN, 2.6, legend_columns=5)


def _open_figure(speeds: Mapping[float, np.ndarray], ramps: Ramps):
    styles = ("-", "--", "-.", ":")
    pulses = [
        Line(DT * np.arange(len(each)), each, f"{level:g} V", style, colour)
        for (level, each), style, colour in zip(
            speeds.items(), styles, (BLUE, GREEN, ORANGE, RED), strict=True
        )
    ]
    left = Panel("time (s)", "joint speed (deg/s)", pulses, x_range=(0.0, 0.9))
    curves = [
        Line(volts, speed, f"{rate:g} V/s", style, colour)
        for (rate, (volts, speed)), style, colour in zip(
            ramps.items(), styles, (BLUE, ORANGE, RED), strict=False
        )
    ]
    right = Panel("command beyond the offset (V)", "joint speed (deg/s)", curves)
    return panels_figure([[left, right]], PAGE_IN, 2.7, legend_columns=7)


STUDY = Study(
    name="joint-models",
    question="what of the actuator's model matters once it turns a joint?",
    source="paper 000 Figs. 14, 16, 18; paper 001 Figs. 10, 11",
    run=run,
    rows=("S000-7", "S000-8", "S000-9", "S001-4", "S001-5"),
    plants=("crr_arm",),
    seeds="of the joints 7, of the noise the number of the joint",
)
