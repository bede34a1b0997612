"""What a person looks at before a fit: time, sensors, rest, units; then the gate of a fit.

The gate asks for excitation, saturation, contradiction with the rig, and identifiability.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from studies.text import percent, shown
from workbench.comparison.course import course_of
from workbench.consistency import examined, in_common
from workbench.consistency.findings import Weight
from workbench.fitting.identifiability import identifiability
from workbench.reading.formats import table_of
from workbench.reading.grid import LONGEST_STEP
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.saturation import saturated
from workbench.units import public_name, scale

UNEVEN = 0.1  # of a sample: more jitter than this is worth a look
CLIPPED = 0.01  # share of the samples at the very end of a range
LEAST_USE = 0.1  # of a command's range: less says little of the valve
SATURATED = 0.2  # share of the samples at a limit of a command


class Mark(Enum):
    """How a finding is to be taken."""

    GOOD = "good"
    LOOK = "look"
    STOP = "stop"


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at, what was seen, and how to take it."""

    what: str
    seen: str
    mark: Mark = Mark.GOOD


def findings_of(
    rig: Rig, path: Path, recording: Recording, told: Sequence[str]
) -> tuple[Finding, ...]:
    """Plausibility of a recording; ``told`` are the warnings of its reading."""
    found = [*_time(rig, path, recording), *_sensors(rig, recording), *_rest(rig, recording)]
    found += [Finding("reading", each.removeprefix(f"{path}: "), Mark.LOOK) for each in told]
    if not told:
        found.append(Finding("units", "every channel is in the range of its unit"))
    return tuple(found)


def column_names(rig: Rig, path: Path) -> tuple[str, ...]:
    """The columns of a file, by name or else by number."""
    table = table_of(path, rig.reader)
    return tuple(table.names) or tuple(map(str, range(1, table.n_columns + 1)))


def _time(rig: Rig, path: Path, recording: Recording) -> Iterator[Finding]:
    dt, n = recording.sample_time_s, len(recording)
    yield Finding("length", f"{dt * (n - 1):.5g} s, {n} samples of {1e3 * dt:.4g} ms")
    clock = rig.reader.time
    if clock.step_s is None:
        table = table_of(path, rig.reader)
        column = table.find(clock.column or "time", "time")
        (stamps,) = table.load([column])
        steps = np.diff(scale(clock.unit, "time_s").to_si(stamps)) / dt
        jitter = float(np.std(steps[steps < LONGEST_STEP * np.median(steps)]))
        mark = Mark.LOOK if jitter > UNEVEN else Mark.GOOD
        yield Finding("jitter", f"{percent(jitter, 2)} of a sample", mark)
    gaps = len(recording.starts) - 1
    holes = sum(int(np.sum(~np.isfinite(each))) for each in recording.channels.values())
    mark = Mark.LOOK if gaps or holes else Mark.GOOD
    yield Finding("gaps", f"{gaps} in the time, {holes} missing samples", mark)


def _sensors(rig: Rig, recording: Recording) -> Iterator[Finding]:
    """Outputs that sit at the end of their range."""
    clipped = []
    for name in rig.fit_for(recording).measured:
        values = recording[name]
        seen = np.isfinite(values)
        if not seen.any():
            continue
        share = float(saturated(name, values).sum() / seen.sum())
        if share > CLIPPED:
            clipped.append(f"{public_name(name)} {percent(share)} of the time at its end")
    if clipped:
        yield Finding("clipping", "; ".join(clipped), Mark.LOOK)
    else:
        yield Finding("clipping", "no output sits at the end of its range")


def _rest(rig: Rig, recording: Recording) -> Iterator[Finding]:
    """Where the commands stand while nothing moves, against the plant's own centre."""
    plant = rig.fit_for(recording)
    places = course_of(plant, recording).places
    if not places:
        return
    still = np.all([place.moving == 0.0 for place in places], axis=0)
    if not still.any():
        yield Finding("offset at rest", "it never rests", Mark.LOOK)
        return
    told = [f"at rest {percent(float(still.mean()))} of the time"]
    for signal in plant.commands:
        rest = float(np.median(recording[signal.name][still]))
        told.append(
            f"{public_name(signal.name)} there {shown(rest, signal.name)}"
            f" (the plant's centre {shown(signal.nominal, signal.name)})"
        )
    yield Finding("offset at rest", ", ".join(told))


def gate_of(rig: Rig, train: Sequence[Recording]) -> tuple[Finding, ...]:
    """The gate before a fit."""
    found = [each for recording in train for each in _excitation(rig, recording)]
    for recording in train:
        for each in examined(rig, recording):
            mark = Mark.STOP if each.weight is Weight.REFUSED else Mark.LOOK
            found.append(Finding("fits the rig", str(each), mark))
    if not any(each.what == "fits the rig" for each in found):
        found.append(Finding("fits the rig", "no recording contradicts it"))
    alike, left_out = in_common(rig.plant, train)
    found += (Finding("fits the rig", str(each), Mark.LOOK) for each in left_out)
    known = identifiability(rig, alike)
    informed = len(known.names) - len(known.flat)
    seen = f"{informed} of {len(known.names)} uncertain parameters; rank {known.rank}"
    if known.flat:
        seen += f"; these keep their prior: {', '.join(map(public_name, known.flat))}"
    found.append(Finding("identifiability", seen, Mark.GOOD if informed else Mark.STOP))
    return tuple(found)


def _excitation(rig: Rig, recording: Recording) -> Iterator[Finding]:
    for signal in rig.fit_for(recording).commands:
        name, values = public_name(signal.name), recording[signal.name]
        span, room = float(np.ptp(values)), signal.upper - signal.lower
        if not np.isfinite(room) or not room:
            continue
        used = span / room
        at_limit = float(np.mean((values <= signal.lower) | (values >= signal.upper)))
        what = f"{recording.name}: {name} uses {percent(used)} of its range"
        mark = Mark.GOOD if used > LEAST_USE else Mark.LOOK
        yield Finding("excitation", what, mark)
        mark = Mark.LOOK if at_limit > SATURATED and not signal.levels else Mark.GOOD
        seen = f"{recording.name}: {name} {percent(at_limit)} at a limit"
        yield Finding("saturation", seen, mark)
