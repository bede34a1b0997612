"""The modes of a plant for people and for other programs: a table, and plain numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from linearize.analysis import ModeReport, analyse, analyse_all, prediction_error
from linearize.modes import HybridModel, Mode

TRIED_V, TRIED_S = 0.02, 0.1  # change of the command and horizon of the error against the plant


def table(hybrid: HybridModel) -> str:
    """One line per mode: command, poles, swing, ranks, drift, and error against the plant."""
    head = (
        f"{'mode':<28}{'command':>9}{'Hz':>7}{'damping':>9}{'contr':>7}{'obs':>5}"
        f"{'drift 1/s':>11}{'error %':>9}  poles 1/s"
    )
    lines = [head]
    for mode, report in zip(hybrid.modes, analyse_all(hybrid), strict=True):
        poles = "  ".join(_pole(value) for value in report.poles if value.imag >= 0.0)
        n = len(mode.state_names)
        lines.append(
            f"{mode.name:<28}{mode.command[0]:>9.3f}{report.frequency_hz:>7.2f}"
            f"{report.damping:>9.2f}{f'{report.controllable}/{n}':>7}{f'{report.observable}/{n}':>5}"
            f"{report.drift:>11.2f}{100.0 * error_share(hybrid, mode):>9.2f}  {poles}"
        )
    return "\n".join(lines)


def left_out(hybrid: HybridModel) -> str:
    """What the design model does without, one line each."""
    items = hybrid.model.left_out
    return "\n".join(f"{item.what}: {item.instead} ({item.reason})" for item in items)


def error_share(hybrid: HybridModel, mode: Mode) -> float:
    """Largest error against the plant over 0.1 s after a small step, over the state's scale."""
    change = np.full(len(mode.command_names), TRIED_V)
    errors = prediction_error(hybrid.model, mode, change, horizon_s=TRIED_S)
    return float((errors / mode.scale).max())


def document(hybrid: HybridModel) -> list[dict[str, Any]]:
    """Every mode as plain lists and numbers, for JSON."""
    return [
        {
            "name": mode.name,
            "states": list(mode.state_names),
            "commands": list(mode.command_names),
            "outputs": list(mode.output_names),
            **{key: getattr(mode, key).tolist() for key in ("A", "B", "C", "D")},
            **{key: getattr(mode, key).tolist() for key in ("state", "command", "output", "drift")},
            "scale": mode.scale.tolist(),
            **_reported(analyse(mode)),
            "error_share": error_share(hybrid, mode),
        }
        for mode in hybrid.modes
    ]


def _reported(report: ModeReport) -> dict[str, Any]:
    return {
        "poles": [[float(value.real), float(value.imag)] for value in report.poles],
        "frequency_hz": report.frequency_hz,
        "damping": report.damping,
        "controllability": report.controllability.tolist(),
        "observability": report.observability.tolist(),
        "controllable": report.controllable,
        "observable": report.observable,
    }


def _pole(value: complex) -> str:
    return f"{value.real:.3g}" if value.imag < 1e-6 else f"{value.real:.3g}±{value.imag:.3g}i"
