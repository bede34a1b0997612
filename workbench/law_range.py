"""Where the empirical laws of a rig were seen, and what leaves that range.

A law is a description of what was recorded.  A square that fits up to 0.3 m/s says nothing of
1 m/s, so a simulation or a recording that goes there is worth a warning.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable

import numpy as np

from workbench.effects.empirical import EmpiricalForce
from workbench.law_scales import recorded_speed
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.rig_laws import Ranges, laws_of
from workbench.units import display_scale, display_unit, public_name

MARGIN = 0.02  # of a range: noise alone goes that far beyond it


def seen_in(plant: Plant, recordings: Iterable[Recording]) -> dict[str, tuple[float, float]]:
    """Range in SI of each recorded output, and of the speeds and commands that drive a law.

    ``plant`` has the laws in it.  A speed that was not recorded is the slope of the position.
    """
    found: dict[str, tuple[float, float]] = {}
    for recording in recordings:
        for name, values in _followed(plant, recording).items():
            low, high = found.get(name, (np.inf, -np.inf))
            found[name] = (
                min(low, float(np.nanmin(values))),
                max(high, float(np.nanmax(values))),
            )
    return found


def _followed(plant: Plant, recording: Recording) -> dict[str, np.ndarray]:
    """What has a range, sample by sample: outputs, then what drives a law, as far as recorded."""
    carried, laws = recording.channels, laws_of(plant)
    places = [f"{law.body}.position_m" for law in laws if isinstance(law, EmpiricalForce)]
    moved = {getattr(law, "body", None): None for law in laws}
    sent = [getattr(law, "command", None) for law in laws]
    speeds = [f"{body}.velocity_m_s" for body in moved]
    wanted = (*plant.measured, *plant.optional_outputs, *places, *speeds, *filter(None, sent))
    rows = {n: carried[n] for n in wanted if n in carried and np.isfinite(carried[n]).any()}
    for body in filter(None, moved):
        values = recorded_speed(recording, body)
        if values is not None:
            rows.setdefault(f"{body}.velocity_m_s", values)
    return rows


def beyond(plant: Plant, seen: Ranges, recording: Recording) -> tuple[str, ...]:
    """What of a recording or simulation lies outside the ranges, in words."""
    if not laws_of(plant):
        return ()
    said = []
    for name, values in _followed(plant, recording).items():
        if name not in seen:
            continue
        low, high = seen[name]
        room = MARGIN * (high - low)
        outside = float(np.mean((values < low - room) | (values > high + room)))
        if outside > 0.0:
            ends = f"{_plain(np.nanmin(values), name)} to {_plain(np.nanmax(values), name)}"
            said.append(
                f"{public_name(name)} runs from {ends} {display_unit(name)} in {recording.name}; "
                f"the empirical law was seen from {_plain(low, name)} to {_plain(high, name)} "
                f"{display_unit(name)} only ({outside:.1%} of the time is beyond)"
            )
    return tuple(said)


def warn_beyond(rig: Rig, recording: Recording) -> None:
    """Warn of what leaves the range in which the rig's empirical laws were seen."""
    for said in beyond(rig.plant, rig.seen, recording):
        warnings.warn(said, stacklevel=2)


def ranges_text(seen: Ranges) -> str:
    """Ranges in one line: ``slide.position 31 to 251 mm, ...``."""
    return ", ".join(
        f"{public_name(name)} {_plain(low, name)} to {_plain(high, name)} {display_unit(name)}"
        for name, (low, high) in seen.items()
    )


def _plain(value: float, name: str) -> str:
    return f"{display_scale(name).from_si(float(value)):.3g}"
