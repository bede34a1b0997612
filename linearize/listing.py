"""The modes of a plant for people and for other programs: a table, and plain numbers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from linearize.analysis import ModeReport, analyse, analyse_all, prediction_error
from linearize.cuts import Level, Region
from linearize.modes import HybridModel, Mode
from linearize.reduction import LeftOut
from linearize.regions import Validity
from linearize.rest import Rest, rest_of


@dataclass(frozen=True)
class Trial:
    """A step of the commands, how long the mode follows it beside the plant, and the sampling."""

    change: float
    horizon_s: float
    sample_time_s: float


TRIALS = {  # by unit of the command
    "_v": Trial(0.02, 0.1, 1e-3),
    "_kg_s": Trial(1e-4, 2e-3, 1e-4),
    "pwm": Trial(0.002, 0.1, 1e-3),
}
UNDRIVEN = Trial(0.0, 2e-3, 1e-4)  # a switched valve, and no command


def table(hybrid: HybridModel) -> str:
    """One line per mode: command, poles, swing, ranks, drift, rest, and error against the plant.

    Behind each rank stands the least singular value over the largest.  ``drift`` is the largest
    rate at the point over its state's scale, ``rest`` how far off the point the plant can rest in
    the region, in scales.
    """
    wide = max(28, *(len(mode.name) + 1 for mode in hybrid.modes))
    head = (
        f"{'mode':<{wide}}{'command':>9}{'Hz':>7}{'damping':>9}{'controllable':>15}"
        f"{'observable':>15}{'drift 1/s':>11}{'rest':>7}{'error %':>9}  poles 1/s"
    )
    lines = [head]
    for mode, report in zip(hybrid.modes, analyse_all(hybrid), strict=True):
        poles = "  ".join(map(_pole, _upper(report.poles)))
        reach = _ranked(report.controllable, report.controllability)
        see = _ranked(report.observable, report.observability)
        found = rest_of(hybrid, mode)
        rest = "none" if found is None else f"{found.away:.2f}" if found.away > 1e-6 else "here"
        lines.append(
            f"{mode.name:<{wide}}{_first(mode.command):>9}{report.frequency_hz:>7.2f}"
            f"{report.damping:>9.2f}{reach:>15}{see:>15}{report.drift:>11.2f}{rest:>7}"
            f"{100.0 * error_share(hybrid, mode):>9.2f}  {poles}"
        )
    return "\n".join(lines)


def _ranked(rank: int, values: np.ndarray) -> str:
    return f"{rank}/{len(values)} {values.min(initial=1.0):8.1e}"


def left_out(hybrid: HybridModel) -> str:
    """What the design model does without, one line each."""
    return _told(hybrid.model.left_out)


def no_modes(hybrid: HybridModel) -> str:
    """Which combinations of regions are no modes, one line each."""
    return _told(hybrid.no_modes)


def jumps(hybrid: HybridModel) -> str:
    """What changes at once between modes, one line each."""
    return "\n".join(
        f"{jump.state} is multiplied by {jump.ratio:.4g} where {jump.signal} rises to {jump.at:g}"
        for jump in hybrid.jumps
    )


def _told(items: Iterable[LeftOut]) -> str:
    return "\n".join(f"{item.what}: {item.instead} ({item.reason})" for item in items)


def error_share(hybrid: HybridModel, mode: Mode) -> float:
    """Largest error against the plant after a small step, over the state's scale."""
    trial = trial_of(mode)
    change = np.full(len(mode.command_names), trial.change)
    errors = prediction_error(
        hybrid.model,
        mode,
        change,
        horizon_s=trial.horizon_s,
        sample_time_s=trial.sample_time_s,
    )
    return float((errors / mode.scale).max())


def trial_of(mode: Mode) -> Trial:
    """What the error of a mode is measured with."""
    units = (
        unit for unit in TRIALS if mode.command_names[:1] and mode.command_names[0].endswith(unit)
    )
    return TRIALS.get(next(units, ""), UNDRIVEN)


def document(hybrid: HybridModel, regions: Iterable[Validity] = ()) -> list[dict[str, Any]]:
    """Every mode as plain lists and numbers, for JSON; with its region where that is known."""
    known = {each.name: each for each in regions}
    return [
        {
            "name": mode.name,
            "region": {name: _region(region) for name, region in mode.box.items()},
            "guards": [{"weights": {**g.weights}, "offset": g.offset} for g in mode.guards],
            "states": list(mode.state_names),
            "commands": list(mode.command_names),
            "outputs": list(mode.output_names),
            **{key: getattr(mode, key).tolist() for key in ("A", "B", "C", "D")},
            **{key: getattr(mode, key).tolist() for key in ("state", "command", "output", "drift")},
            "scale": mode.scale.tolist(),
            **_reported(analyse(mode)),
            "rest": _rested(rest_of(hybrid, mode)),
            "error_share": error_share(hybrid, mode),
            "validity": _valid(known.get(mode.name)),
        }
        for mode in hybrid.modes
    ]


def _rested(rest: Rest | None) -> dict[str, Any] | None:
    """State of the design model at rest and how far off the point; none where there is no rest."""
    return None if rest is None else {"state": rest.state.tolist(), "away": rest.away}


def _valid(found: Validity | None) -> dict[str, Any] | None:
    return None if found is None else {k: v for k, v in vars(found).items() if k != "name"}


def _region(region: Region) -> dict[str, Any]:
    """An interval with its ends, none where it is open, or a level; both with their point."""
    if isinstance(region, Level):
        return {"label": region.label, "level": region.point}
    ends = {"lower": region.lower, "upper": region.upper}
    finite = {key: end if isfinite(end) else None for key, end in ends.items()}
    return {"label": region.label, **finite, "point": region.point}


def _reported(report: ModeReport) -> dict[str, Any]:
    return {
        "poles": [[float(value.real), float(value.imag)] for value in report.poles],
        "frequency_hz": report.frequency_hz,
        "damping": report.damping,
        "controllability": report.controllability.tolist(),
        "observability": report.observability.tolist(),
        "controllable": report.controllable,
        "observable": report.observable,
        "observable_from": {**report.seen_from},
        "drift_per_s": report.drift,
    }


def _first(command: np.ndarray) -> str:
    return f"{command[0]:.4g}" if len(command) else "-"


def _upper(poles: np.ndarray) -> np.ndarray:
    """Poles without the conjugate half; what rounding leaves of a zero is zero."""
    shown = np.where(np.abs(poles) < 1e-9 * np.abs(poles).max(initial=0.0), 0.0, poles)
    return shown[shown.imag >= 0.0]


def _pole(value: complex) -> str:
    return f"{value.real:.3g}" if value.imag < 1e-6 else f"{value.real:.3g}±{value.imag:.3g}i"
