"""The sizes of a recording in which the terms of an empirical law count."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from workbench.effects.empirical import EmpiricalForce, ScaledForce
from workbench.effects.empirical_fillings import EmpiricalFilling
from workbench.fitting.starts import bridged, slope
from workbench.recording import Recording

SMALLEST = 1e-6  # of any size, in SI


def recorded_speed(recording: Recording, body: str) -> np.ndarray | None:
    """The speed of a body in m/s, (n,), from its position where it was not recorded itself."""
    carried = recording.channels
    position, speed = (f"{body}.{what}" for what in ("position_m", "velocity_m_s"))
    if speed in carried and np.isfinite(carried[speed]).any():
        return carried[speed]
    if position not in carried or not np.isfinite(carried[position]).any():
        return None
    whole = bridged(carried[position], recording.starts)
    return slope(whole, recording.sample_time_s, recording.starts)


def scales(
    laws: Iterable[EmpiricalForce | EmpiricalFilling], recordings: Sequence[Recording]
) -> dict[str, float]:
    """Full names and values in SI of the sizes of the terms that these recordings show."""
    found: dict[str, float] = {}
    shown: dict[tuple[str, ...], dict[str, float]] = {}
    for law in laws:
        pressing = law.chambers if isinstance(law, ScaledForce) else ()
        pressing = (law.chamber,) if isinstance(law, EmpiricalFilling) else pressing
        key = (getattr(law, "body", None) or "", *pressing)
        if key not in shown:
            shown[key] = _moved(key[0], recordings) | _pressed(pressing, recordings)
        known = law.parameters()
        found |= {f"{law.name}.{size}": v for size, v in shown[key].items() if size in known}
    return found


def _moved(body: str, recordings: Sequence[Recording]) -> dict[str, float]:
    """Middle and length of the recorded stroke of a body, and its largest speed."""
    places = [
        r.channels[name]
        for r in recordings
        if (name := f"{body}.position_m") in r.channels and np.isfinite(r.channels[name]).any()
    ]
    speeds = [s for r in recordings if (s := recorded_speed(r, body)) is not None]
    found = {}
    if places:
        low, high = min(map(np.nanmin, places)), max(map(np.nanmax, places))
        found["middle_m"] = float(low + high) / 2.0
        found["stroke_m"] = max(float(high - low), SMALLEST)
    if speeds:
        found["speed_m_s"] = max(float(np.nanmax(np.abs(s))) for s in speeds) or SMALLEST
    return found


def _pressed(across: Sequence[str], recordings: Sequence[Recording]) -> dict[str, float]:
    """Largest recorded pressure, or difference of two that are both recorded.

    Two sensors that are never read at once differ by what lies between their samples.
    """
    names = [f"{part}.pressure_pa" for part in across]
    recorded = [
        [bridged(r.channels[n], r.starts) for n in names if n in r.channels] for r in recordings
    ]
    rows = [each[0] - each[1] if len(each) > 1 else each[0] for each in recorded if each]
    largest = [float(np.nanmax(np.abs(row))) for row in rows if np.isfinite(row).any()]
    return {"pressure_pa": max(*largest, 1.0)} if largest else {}
