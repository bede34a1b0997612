"""Study ``rig-loops``: the papers' rig under a PID, and what a simpler model loses there.

S000-5   sines of several frequencies (paper 000, Fig. 12; frequencies not printed)
S000-6   steps of the position (Fig. 13)
S000-8   linear area and fixed pressures in place of segment and tanh (Fig. 15)
S000-9   viscous friction alone (Fig. 17)
S001-3   a sine within 5 %, derivatives taken over several samples (paper 001, Fig. 8)

The rig is ``studies/truth`` with its small differences; the papers print no gains (*chosen*).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from studies.figures.panels import Line, Panel, panels_figure
from studies.figures.style import BLACK, BLUE, GREEN, ORANGE, PAGE_IN, RED
from studies.papers.findings import Finding, outcome
from studies.papers.loops import DT, MODELS
from studies.papers.rig_loop_runs import (
    AMPLITUDE_M,
    COMPARED,
    COMPARED_S,
    FIRM,
    HARD,
    MIDDLE_M,
    OVER,
    POSITION,
    SECONDS_BY_HZ,
    Run,
    compared,
    sine,
)
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns
from workbench.recording import Recording

GOAL = 0.05
SEEDS = {Extent.QUICK: (1,), Extent.FULL: (1, 2, 3, 4, 5)}
FULL, LINEAR, VISCOUS = MODELS


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Track sines, compare models; nothing is kept."""
    tracked = {}
    for hz in SECONDS_BY_HZ:
        say(f"sine of {hz:g} Hz")
        tracked[hz] = sine(hz, FIRM)
    say("derivative over several samples")
    spans = {
        "low pass of 3 ms": sine(1.0, HARD),
        f"over {OVER} samples": sine(1.0, replace(HARD, over=OVER, filter_s=0.0)),
        "one sample": sine(1.0, replace(HARD, filter_s=0.0)),
    }
    loops = []
    for seed in SEEDS[extent]:
        say(f"rig {seed} and models under the same loops")
        loops.append(compared(seed))
    rmse = {
        (name, model): float(np.mean([_rmse_m(each[name], model) for each in loops]))
        for name in COMPARED
        for model in MODELS
    }
    tables = [_sine_table(tracked), _model_table(rmse), _step_table(loops[0]["step"])]
    found = [*_findings(tracked, spans), *_findings_of_models(rmse, loops[0])]
    claims = [*_claims(tracked, spans), *_claims_of_models(rmse, loops[0])]
    figures = {"sines": _sine_figure(tracked), "models": _model_figure(loops[0])}
    return outcome(found, claims, figures, tables)


def _rmse_m(runs: Mapping[str, Run], model: str) -> float:
    return float(np.sqrt(np.mean((runs[model].position - runs["rig"].position) ** 2)))


def _share(error: np.ndarray) -> float:
    return float(np.abs(error).max() / AMPLITUDE_M)


def _noise_v(seen: Recording) -> float:
    """Standard deviation of the command's differences from sample to sample."""
    return float(np.diff(seen["valve.command_v"])[1000:].std())


def _sine_table(tracked: Mapping[float, tuple[Recording, np.ndarray]]) -> str:
    rows = [
        (f"{hz:g} Hz", f"{1e3 * np.sqrt(np.mean(e**2)):.2f}", f"{_share(e):.1%}")
        for hz, (_, e) in tracked.items()
    ]
    return columns(("sine of 30 mm", "RMSE mm", "largest, of the amplitude"), rows)


def _model_table(rmse: Mapping[tuple[str, str], float]) -> str:
    rows = [(name, *(f"{1e3 * rmse[name, model]:.2f}" for model in MODELS)) for name in COMPARED]
    return columns(("RMSE against the rig, mm", *MODELS), rows)


def _step_table(runs: Mapping[str, Run]) -> str:
    rows = []
    for name, each in runs.items():
        s = each.step
        rows.append(
            (
                name,
                f"{1e3 * s['first']:.0f}",
                f"{1e3 * s['rise']:.0f}",
                f"{s['overshoot']:.1%}",
                f"{s['final']:.1%}",
                f"{1e3 * each.unrest:.2f}",
            )
        )
    head = ("step of 50 mm", "first motion ms", "rise ms", "overshoot", "final error", "rest mm/s")
    return columns(head, rows)


def _findings(
    tracked: Mapping[float, tuple[Recording, np.ndarray]],
    spans: Mapping[str, tuple[Recording, np.ndarray]],
) -> Iterator[Finding]:
    told = ", ".join(f"{1e3 * np.sqrt(np.mean(e**2)):.1f}" for _, e in tracked.values())
    yield Finding("S000-5", "RMSE at 0.25, 0.5, 1, 2, 3 Hz", "only a figure", f"{told} mm")
    why = "gains and bore are chosen; without feedforward the lag of the PID grows with the speed"
    yield Finding("S001-3", "largest error at 0.25 Hz", "5 % (goal)",
                  f"{_share(tracked[0.25][1]):.1%}", why)  # fmt: skip
    noise = {name: _noise_v(seen) for name, (seen, _) in spans.items()}
    told = ", ".join(f"{1e3 * noise[name]:.0f}" for name in spans)
    yield Finding("S001-3", "noise of the command: low pass, 8 samples, one", "-", f"{told} mV")


def _findings_of_models(
    rmse: Mapping[tuple[str, str], float], loops: Mapping[str, Mapping[str, Run]]
) -> Iterator[Finding]:
    steps = loops["step"]
    rig = steps["rig"].step
    told = f"{1e3 * rig['first']:.0f}, {1e3 * rig['rise']:.0f} ms, {rig['overshoot']:.1%}"
    why = "the models have the nominal values, this rig's valve and friction are drawn"
    what = "step of 50 mm: first motion, rise, overshoot"
    yield Finding("S000-6", what, "only a figure", told, why)
    why = (
        "bore, masses and gains are chosen, and which motion was compared is not printed; as in "
        "the paper the better model does not have the smaller error on the rig (E000-9)"
    )
    row_of = {FULL: "S000-8", LINEAR: "S000-8", VISCOUS: "S000-9"}
    for model, printed in ((FULL, "1.3 mm"), (LINEAR, "1.2 mm"), (VISCOUS, "1.2 mm")):
        told = f"{1e3 * rmse['1 Hz', model]:.1f} mm"
        yield Finding(row_of[model], f"RMSE, {model}", printed, told, why)
    low, high = (f([rmse[name, LINEAR] for name in COMPARED]) for f in (min, max))
    yield Finding("S000-8", "other motions and gains", "0.5 mm at best, 4 to 8 mm",
                  f"{1e3 * low:.1f} to {1e3 * high:.1f} mm")  # fmt: skip
    early = steps["rig"].step["first"] - steps[VISCOUS].step["first"]
    yield Finding("S000-9", "viscous: motion too early by", "10 ms", f"{1e3 * early:.0f} ms")
    why = "on the rig's 1 kg viscous friction alone damps the loop well; on the joint it does not"
    told = f"{1e3 * steps[VISCOUS].unrest:.2f} mm/s, rig {1e3 * steps['rig'].unrest:.2f}"
    yield Finding("S000-9", "viscous: speed after the step", "never rests", told, why)


def _claims(
    tracked: Mapping[float, tuple[Recording, np.ndarray]],
    spans: Mapping[str, tuple[Recording, np.ndarray]],
) -> Iterator[Claim]:
    shares = {hz: _share(error) for hz, (_, error) in tracked.items()}
    claim = "S001-3: a sine of 0.25 Hz stays within 5 %"
    yield Claim(claim, f"{shares[0.25]:.1%}", shares[0.25] < GOAL)
    claim = "S000-5: the error grows with every frequency, and 1 Hz is beyond 5 %"
    told = ", ".join(f"{share:.0%}" for share in shares.values())
    grows = list(shares.values()) == sorted(shares.values())
    yield Claim(claim, told, grows and shares[1.0] > GOAL)
    _, b, c = (_noise_v(seen) for seen, _ in spans.values())
    x, y, _ = (float(np.sqrt(np.mean(e**2))) for _, e in spans.values())
    claim = "S001-3: a difference over 8 samples quiets the command and tracks as a low pass does"
    told = f"{1e3 * c:.0f} to {1e3 * b:.0f} mV, RMSE {1e3 * y:.2f} and {1e3 * x:.2f} mm"
    yield Claim(claim, told, b < 0.5 * c and abs(y / x - 1.0) < 0.1)


def _claims_of_models(
    rmse: Mapping[tuple[str, str], float], loops: Mapping[str, Mapping[str, Run]]
) -> Iterator[Claim]:
    sines = [[rmse[name, model] for model in MODELS] for name in ("0.5 Hz", "1 Hz")]
    claim = "S000-8, S000-9: on sines the rig does not tell the models apart: RMSE within 0.5 mm"
    apart = max(max(row) - min(row) for row in sines)
    yield Claim(claim, f"{1e3 * apart:.2f} mm", apart < 0.5e-3)
    steps = loops["step"]
    rises = np.array([steps[model].step["rise"] for model in MODELS])
    apart = float(np.ptp(rises) / rises.mean())
    claim = "S000-6: the step does not tell them apart either: they rise alike, within 5 %"
    told = f"{apart:.1%}, {1e3 * rises.mean():.0f} ms, rig {1e3 * steps['rig'].step['rise']:.0f}"
    yield Claim(claim, told, apart < 0.05)
    first = {name: each.step["first"] for name, each in steps.items()}
    told = ", ".join(f"{name} {1e3 * t:.0f} ms" for name, t in first.items())
    claim = "S000-9: without dry friction the motion starts earlier than with it, and than the rig"
    early = first[VISCOUS] < first[FULL] and first[VISCOUS] < first["rig"]
    yield Claim(claim, told, early)


def _sine_figure(tracked: Mapping[float, tuple[Recording, np.ndarray]]):
    left = []
    for hz, style, colour in ((0.5, "-", BLUE), (1.0, "--", RED), (3.0, "-.", GREEN)):
        seen, _ = tracked[hz]
        phase = hz * seen.time_s
        last = phase >= phase[-1] - 1.0
        left.append(Line(phase[last] - phase[last][0], 1e3 * seen[POSITION][last], f"{hz:g} Hz",
                         style, colour))  # fmt: skip
    phase = np.linspace(0, 1, 100)
    wanted = 1e3 * (MIDDLE_M + AMPLITUDE_M * np.sin(2 * np.pi * phase))
    left.append(Line(phase, wanted, "reference", ":", BLACK))
    shares = 100 * np.array([_share(error) for _, error in tracked.values()])
    right = Panel(
        "frequency (Hz)",
        "largest error (% of amplitude)",
        [Line(np.array(list(tracked)), shares, "", "o", BLACK)],
        levels={"goal of paper 001": 100 * GOAL},
        x_range=(0.0, 3.2),
        y_range=(0.0, 35.0),
    )
    panel = Panel("part of the period (-)", "position (mm)", left)
    return panels_figure([[panel, right]], PAGE_IN, 2.8, legend_columns=5)


def _model_figure(loops: Mapping[str, Mapping[str, Run]]):
    looks = {"rig": ("-", BLACK), FULL: ("--", BLUE), LINEAR: ("-.", ORANGE), VISCOUS: (":", RED)}
    time_s = DT * np.arange(round(COMPARED_S / DT))

    def lines(name: str, less: np.ndarray | float = 0.0) -> list[Line]:
        return [
            Line(time_s, 1e3 * (each.position - less), model, *looks[model])
            for model, each in loops[name].items()
        ]

    step = Panel("time (s)", "position (mm)", lines("step"), "step of 50 mm", x_range=(0.25, 0.8))
    wanted = loops["1 Hz"]["rig"].reference
    error = Panel("time (s)", "error (mm)", lines("1 Hz", wanted), "sine of 1 Hz")
    return panels_figure([[step, error]], PAGE_IN, 2.8, legend_columns=4)


STUDY = Study(
    name="rig-loops",
    question="how does the papers' rig follow sines and steps, and which model tells it?",
    source="paper 000 Figs. 12, 13, 15, 17; paper 001 Fig. 8",
    run=run,
    rows=("S000-5", "S000-6", "S000-8", "S000-9", "S001-3"),
    plants=("crr_rig",),
    seeds="of the rigs 1, of the full extent 1 to 5",
)
