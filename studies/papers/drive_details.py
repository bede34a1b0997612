"""Study ``drive-details``: what paper 002's drive loses without one or the other detail.

S002-8   open loop with dead volumes of about zero beside the identified ones (Fig. 16), and RK4
         with 1 ms, with which the paper integrates (erratum E002-17)

and what the papers say without numbers: the valve's 100 Hz are negligible, the polytropic index n,
and LuGre friction that drifts where the elasto-plastic one holds.  All runs are the model's own:
the drive with the paper's values beside the drive with one thing changed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path

import numpy as np

from studies.figures.panels import Line, Panel, panels_figure
from studies.figures.style import BLACK, BLUE, GREEN, ORANGE, PAGE_IN, RED
from studies.papers.findings import Finding, outcome
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns
from workbench.effects import BristleFriction, Weight
from workbench.effects.bristle_friction import ElastoPlastic, LuGre
from workbench.plant import Plant
from workbench.plants.servo_drive import (
    AREA_M2,
    CENTRE_V,
    COMMAND,
    servo_drive,
)
from workbench.plants.vertical_cylinder import ATMOSPHERE_PA, PISTON_M, vertical_cylinder
from workbench.polytropic import with_polytropic_gas
from workbench.recording import Recording
from workbench.simulation import simulate

DT, AMPLITUDE_V, FREQUENCY_HZ, FROM_M = 1e-3, 0.8, 0.5, 0.030
LENGTH_S = 8.0  # longer runs drift apart in open loop
SIGNALS = ("slide.position_m", "slide.velocity_m_s", "chamber_a.pressure_pa",
           "chamber_b.pressure_pa")  # fmt: skip
NO_DEAD_VOLUME = {f"chamber_{side}.dead_volume_m3": 1e-7 for side in "ab"}
LAG_S = 1 / (2 * pi * 100.0)
OWN_ERROR_M, OWN_ERROR_PA = 0.25e-3, 0.092e5  # MAE of Table 7
MEAN_N, SWING_N, SHAKEN_HZ, SHAKEN_S = 15.0, 10.0, 20.0, 3.0
LAWS = {"elasto-plastic": ElastoPlastic(), "LuGre": LuGre()}
RK4_S = {1e-3: "1 ms", 1e-4: "0.1 ms"}
RK4_LENGTH_S = 0.5


@dataclass(frozen=True)
class Off:
    """Mean and largest deviation of the position, m, and mean one of the pressure in a, Pa."""

    mean_m: float
    worst_m: float
    mean_pa: float


def command(length_s: float) -> np.ndarray:
    """The paper's slow sine, as far as the strokes of its figure need it (physics.md 7)."""
    time_s = DT * np.arange(round(length_s / DT) + 1)
    return CENTRE_V + AMPLITUDE_V * np.sin(2 * pi * FREQUENCY_HZ * time_s)


def placed(plant: Plant) -> Plant:
    """The plant with its slide, and the gas around it, where the run begins."""
    parts = (
        replace(part, initial_position_m=FROM_M) if hasattr(part, "initial_position_m") else part
        for part in plant.parts
    )
    return replace(plant, parts=tuple(parts))


def variants() -> dict[str, Plant]:
    """The drive, and the drive with one thing changed each."""
    base = servo_drive()
    return {
        "as identified": base.lean(),
        "dead volumes about zero": base.with_values(NO_DEAD_VOLUME).lean(),
        "valve of 100 Hz": base.with_values({"valve_lag.time_constant_s": LAG_S}).lean(),
        "no heat": base.with_values({"wall_heat.coefficient_w_m2_k": 0.0}).lean(),
        **{
            f"polytropic, n = {n:g}": with_polytropic_gas(base, polytropic_index=n).lean()
            for n in (1.2, 1.35, 1.4)
        },
    }


def free_run(plant: Plant, length_s: float) -> np.ndarray:
    """Position, velocity and pressures, shape (4, n)."""
    recording = Recording("sine", DT, {COMMAND: command(length_s)})
    return simulate(placed(plant), recording).rows(SIGNALS)


def off(seen: np.ndarray, base: np.ndarray) -> Off:
    """Deviation of one run from another."""
    apart = np.abs(seen - base)
    return Off(float(apart[0].mean()), float(apart[0].max()), float(apart[2].mean()))


def relative_peaks(seen: np.ndarray, base: np.ndarray) -> dict[str, float]:
    """Largest deviation over the range that the signal has, of y, v, both pressures and force."""
    both = [np.vstack([run, AREA_M2 * (run[2] - run[3])]) for run in (seen, base)]
    peaks = np.abs(both[0] - both[1]).max(axis=1) / np.ptp(both[1], axis=1)
    names = ("position", "velocity", "pressure a", "pressure b", "force")
    return dict(zip(names, map(float, peaks), strict=True))


def runge_kutta(plant: Plant, step_s: float) -> np.ndarray:
    """Position by the classical method with a fixed step, shape (n,); nan from where it fails."""
    start = placed(plant)
    f, p = start.model.f, start.nominal[2]
    volts = CENTRE_V + AMPLITUDE_V  # a constant command: the piston slides on after the start
    x, rows = start.initial, []
    at = start.model.states.index(SIGNALS[0])
    for _ in range(round(RK4_LENGTH_S / step_s)):
        rows.append(x[at])
        slopes = []
        for share in (0.0, 0.5, 0.5, 1.0):
            moved = x + share * step_s * slopes[-1] if slopes else x
            slopes.append(f(moved, volts, [], p)[0].full().ravel())
        x = x + step_s / 6 * (slopes[0] + 2 * slopes[1] + 2 * slopes[2] + slopes[3])
        if not np.isfinite(x).all():
            break
    every = round(DT / step_s)
    found = np.full(round(RK4_LENGTH_S / DT), np.nan)
    kept = np.array(rows)[::every]
    found[: len(kept)] = kept
    return found


def shaken(law: ElastoPlastic | LuGre) -> np.ndarray:
    """Motion in m of a body under 15 +- 10 N at 20 Hz, below its break-away, shape (n,)."""
    friction = next(e for e in servo_drive().effects if isinstance(e, BristleFriction))
    bare = vertical_cylinder()
    weight = next(e for e in bare.effects if isinstance(e, Weight))
    rubbing = replace(friction, body="rod", chambers=(), plasticity=law)
    plant = bare.without("friction", weight.name).with_effects(rubbing).lean()
    time_s = DT * np.arange(round(SHAKEN_S / DT))
    force_n = MEAN_N + SWING_N * np.sin(2 * pi * SHAKEN_HZ * time_s)
    pressure_pa = ATMOSPHERE_PA + force_n / (pi / 4 * PISTON_M**2)
    seen = simulate(plant, Recording("shaken", DT, {"chamber.pressure_pa": pressure_pa}))
    position = seen["rod.position_m"]
    return position - position[0]


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Free runs of all variants, two integrators, two laws of friction; nothing is kept."""
    say("the drive with one thing changed each")
    plants = variants()
    runs = {name: free_run(plant, LENGTH_S) for name, plant in plants.items()}
    base = runs["as identified"]
    apart = {name: off(seen, base) for name, seen in runs.items() if seen is not base}
    peaks = relative_peaks(runs["dead volumes about zero"], base)
    say("the classical Runge-Kutta method")
    steps = {name: runge_kutta(plants["as identified"], s) for s, name in RK4_S.items()}
    say("a body shaken below its break-away")
    drift = {name: shaken(law) for name, law in LAWS.items()}
    table = columns(
        ("changed", "position MAE mm", "worst mm", "pressure a MAE bar"),
        [
            (name, f"{1e3 * o.mean_m:.2f}", f"{1e3 * o.worst_m:.2f}", f"{1e-5 * o.mean_pa:.3f}")
            for name, o in apart.items()
        ],
    )
    found = _findings(peaks, apart, drift, steps)
    claims = _claims(peaks, apart, drift, steps)
    figures = {"details": _figure(runs, drift)}
    return outcome(found, claims, figures, [table])


def _drifted(moved: np.ndarray) -> float:
    """Motion from the first period to the last, at the same phase, m."""
    period = round(1 / SHAKEN_HZ / DT)
    return float(moved[-period:].mean() - moved[period : 2 * period].mean())


def _findings(
    peaks: Mapping[str, float],
    apart: Mapping[str, Off],
    drift: Mapping[str, np.ndarray],
    steps: Mapping[str, np.ndarray],
) -> Iterator[Finding]:
    printed = {"position": "6 %", "velocity": "20 %", "pressure a": "80 %", "pressure b": "80 %",
               "force": "80 %"}  # fmt: skip
    why = (
        "over the range of each signal; the paper does not say what it divides by, and its input "
        "is not printed"
    )
    for name, share in peaks.items():
        yield Finding("S002-8", f"no dead volume, {name}", printed[name], f"{share:.0%}", why)
    fine, coarse = steps["0.1 ms"], steps["1 ms"]
    why = "the bristle's eigenvalue is beyond what the method bears at this step (E002-17)"
    yield Finding("S002-8", "RK4 with 1 ms, as in the paper", "used", _astray(coarse, fine), why)
    o = apart["valve of 100 Hz"]
    why = "a lag of first order; the paper's own error is 0.25 mm and 0.092 bar"
    told = f"{1e3 * o.mean_m:.2f} mm, {1e-5 * o.mean_pa:.3f} bar"
    yield Finding("worth adding", "valve of 100 Hz", "negligible", told, why)
    o = apart["polytropic, n = 1.35"]
    yield Finding("worth adding", "n = 1.35 in place of the full balance", "-",
                  f"{1e3 * o.mean_m:.2f} mm, {1e-5 * o.mean_pa:.3f} bar")  # fmt: skip
    told = ", ".join(f"{name} {1e6 * _drifted(each):.3f} um" for name, each in drift.items())
    yield Finding("worth adding", "drift in 3 s under 15 +- 10 N", "LuGre drifts", told)


def _astray(coarse: np.ndarray, fine: np.ndarray) -> str:
    if not np.isfinite(coarse).all():
        return f"not finite from {DT * int(np.argmax(~np.isfinite(coarse))):.3f} s on"
    return f"{1e3 * np.abs(coarse - fine).max():.1f} mm off in {RK4_LENGTH_S:g} s"


def _claims(
    peaks: Mapping[str, float],
    apart: Mapping[str, Off],
    drift: Mapping[str, np.ndarray],
    steps: Mapping[str, np.ndarray],
) -> Iterator[Claim]:
    told = ", ".join(f"{name} {share:.0%}" for name, share in peaks.items())
    claim = "S002-8: without dead volume pressures and force suffer most, position least"
    ordered = min(peaks["pressure a"], peaks["pressure b"], peaks["force"]) > peaks["position"]
    yield Claim(claim, told, ordered and peaks["position"] < 0.1)
    fine, coarse = steps["0.1 ms"], steps["1 ms"]
    wrong = not np.isfinite(coarse).all() or np.abs(coarse - fine).max() > 1e-3
    claim = "S002-8: RK4 with 1 ms does not integrate the drive: a millimetre off, or not finite"
    yield Claim(claim, _astray(coarse, fine), wrong)
    o = apart["valve of 100 Hz"]
    claim = "the valve's 100 Hz cost less pressure than a tenth of the paper's own error"
    yield Claim(claim, f"{1e-5 * o.mean_pa:.4f} bar", o.mean_pa < 0.1 * OWN_ERROR_PA)
    claim = "but more position than the paper's error: they show in an open loop"
    yield Claim(claim, f"{1e3 * o.mean_m:.2f} mm", o.mean_m > OWN_ERROR_M)
    errors = {n: apart[f"polytropic, n = {n:g}"].mean_m for n in (1.2, 1.35, 1.4)}
    told = ", ".join(f"{1e3 * each:.2f} mm at {n:g}" for n, each in errors.items())
    claim = "the index n hardly matters: all of 1.2 to 1.4 are within 0.5 mm of one another"
    yield Claim(claim, told, max(errors.values()) - min(errors.values()) < 0.5e-3)
    pressures = [apart[f"polytropic, n = {n:g}"].mean_pa for n in (1.2, 1.35)]
    told = ", ".join(f"{1e-5 * each:.3f}" for each in pressures)
    claim = "in pressure the printed n = 1.35 is nearer to the full balance than 1.2"
    yield Claim(claim, f"{told} bar", pressures[1] < pressures[0])
    creep, hold = (_drifted(drift[name]) for name in ("LuGre", "elasto-plastic"))
    claim = "LuGre drifts by half a millimetre and more where the elasto-plastic law holds to 1 um"
    told = f"{1e3 * creep:.2f} mm and {1e6 * hold:.2g} um"
    yield Claim(claim, told, creep > 0.5e-3 and abs(hold) < 1e-6)


def _figure(runs: Mapping[str, np.ndarray], drift: Mapping[str, np.ndarray]):
    base = runs["as identified"]
    time_s = DT * np.arange(base.shape[1])
    looks = {
        "dead volumes about zero": ("-", RED),
        "valve of 100 Hz": ("--", BLUE),
        "polytropic, n = 1.35": ("-.", GREEN),
        "no heat": (":", ORANGE),
    }
    off_mm, off_bar = (
        [Line(time_s, scale * (runs[n][k] - base[k]), n, *look) for n, look in looks.items()]
        for k, scale in ((0, 1e3), (2, 1e-5))
    )
    moved_s = DT * np.arange(len(drift["LuGre"]))
    shaken_um = [
        Line(moved_s, 1e6 * drift[name], name, style, colour)
        for name, style, colour in (("LuGre", "-", BLACK), ("elasto-plastic", "-", "0.6"))
    ]
    panels = [
        Panel("time (s)", "change of position (mm)", off_mm),
        Panel("time (s)", "change of pressure a (bar)", off_bar),
        Panel("time (s)", r"motion when shaken ($\mu$m)", shaken_um),
    ]
    return panels_figure([panels], PAGE_IN, 2.7, legend_columns=3)


STUDY = Study(
    name="drive-details",
    question="what does the drive lose without dead volume, valve lag, full gas or presliding?",
    source="paper 002 Fig. 16; physics.md 5, worth adding",
    run=run,
    rows=("S002-8",),
    plants=("servo_drive",),
)
