"""Ways in which a rig file misreads a recording, each with the recording as it would be then.

Exchanged columns, a unit that is off by a factor, gauge pressures read as absolute ones or the
other way round, and a position or command that counts the other way.  Which of them apply follows
from the channels' units and from the plant's signals; a reading whose numbers could not be is left
out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from workbench.effects.forces import EndStops
from workbench.plant import Plant
from workbench.reading.plausible import BEYOND, LIMITS, VACUUM_PA
from workbench.recording import Recording
from workbench.units import STANDARD_ATMOSPHERE_PA, suffix

TEN, THOUSAND = "ten times", "a thousand times"
FACTORS = {
    # suffix: by how much a wrong unit makes a channel too small or too large, in words
    "pa": {
        10.0: TEN,
        1e3: f"{THOUSAND} (kPa for Pa)",
        1e5: "100 000 times (bar for Pa)",
        14.504: "14.5 times (bar for psi)",
        6.895: "6.9 times (kPa for psi)",
    },
    "m": {
        10.0: f"{TEN} (cm for mm)",
        100.0: "100 times (m for cm)",
        1e3: f"{THOUSAND} (m for mm)",
        25.4: "25.4 times (inches)",
    },
    "m_s": {10.0: TEN, 1e3: f"{THOUSAND} (m/s for mm/s)"},
    "rad": {10.0: TEN, 57.296: "57.3 times (rad for deg)"},
    "n": {10.0: TEN, 1e3: f"{THOUSAND} (kN for N)"},
    "": {10.0: TEN, 100.0: "100 times (a fraction for %)", 1e3: THOUSAND},
}
ANY = {10.0: TEN, 1e3: THOUSAND}
TURNED = ("position_m", "angle_rad", "velocity_m_s", "force_n")

Rows = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Misreading:
    """One way: the channels it concerns, in words, what helps, and the channels read aright."""

    channels: tuple[str, ...]
    what: str
    remedy: str
    righted: Rows

    def undone(self, recording: Recording) -> Recording:
        """The recording without it."""
        return replace(recording, channels={**recording.channels, **self.righted})


def misreadings(plant: Plant, recording: Recording) -> list[Misreading]:
    """All that the plant's channels allow and that give numbers that can be.

    Of two that explain a recording equally well the first is named: one that keeps a switched
    command at its levels comes before one that makes it ten times smaller.
    """
    inputs = tuple(signal.name for signal in (*plant.commands, *plant.measured_inputs))
    names = (*inputs, *plant.measured)
    rows = {name: recording[name] for name in names}
    groups = _groups(plant, rows)
    found = [
        *_exchanged(rows),
        *_turned(plant, rows),
        *_scaled(groups, rows),
        *_offset(groups, rows),
    ]
    limits = {s.name: (s.lower, s.upper) for s in plant.commands}
    return [each for each in found if all(_can_be(*row, limits) for row in each.righted.items())]


def _exchanged(rows: Rows) -> Iterator[Misreading]:
    for one, other in combinations(rows, 2):
        if suffix(one) == suffix(other):
            yield Misreading(
                (one, other),
                "look exchanged",
                "their columns the other way round in [recording.channels]",
                {one: rows[other], other: rows[one]},
            )


def _groups(plant: Plant, rows: Rows) -> list[tuple[str, ...]]:
    """Channels that one mistake may concern: each alone, all measured pressures, all pressures."""
    pressures = [name for name in rows if suffix(name) == "pa"]
    outputs = [name for name in pressures if name in plant.measured]
    together = {tuple(group) for group in (pressures, outputs) if len(group) > 1}
    return [*((name,) for name in rows), *sorted(together)]


def _scaled(groups: list[tuple[str, ...]], rows: Rows) -> Iterator[Misreading]:
    for names in groups:
        look = "looks" if len(names) == 1 else "look"
        for factor, words in FACTORS.get(suffix(names[0]), ANY).items():
            small, large = ({n: k * rows[n] for n in names} for k in (factor, 1.0 / factor))
            remedy = "another unit in [recording.channels]"
            yield Misreading(names, f"{look} {words} too small", remedy, small)
            yield Misreading(names, f"{look} {words} too large", remedy, large)


def _offset(groups: list[tuple[str, ...]], rows: Rows) -> Iterator[Misreading]:
    for names in groups:
        if suffix(names[0]) != "pa":
            continue
        look = "looks" if len(names) == 1 else "look"
        atmosphere = STANDARD_ATMOSPHERE_PA
        above, below = ({n: rows[n] + k * atmosphere for n in names} for k in (1.0, -1.0))
        gauge, absolute = "a gauge unit such as bar_gauge", "an absolute unit such as bar"
        yield Misreading(names, f"{look} one atmosphere too small", gauge, above)
        yield Misreading(names, f"{look} one atmosphere too large", absolute, below)


def _turned(plant: Plant, rows: Rows) -> Iterator[Misreading]:
    for name in rows:
        if name.endswith(TURNED):
            yield from (
                Misreading((name,), "seems to count the other way", "the other sign", {name: row})
                for row in _mirrored(plant, name, rows[name])
            )
    for signal in plant.commands:
        both = min(signal.levels) + max(signal.levels) if signal.levels else 2.0 * signal.nominal
        yield Misreading(
            (signal.name,),
            "seems to act the other way",
            f"{both:g} minus the recorded command, or the hoses exchanged",
            {signal.name: both - rows[signal.name]},
        )


def _mirrored(plant: Plant, name: str, values: np.ndarray) -> Iterator[np.ndarray]:
    """About zero, and about the middle of the stroke where there is one."""
    yield -values
    body = name.rpartition(".")[0]
    for stops in (e for e in plant.effects if isinstance(e, EndStops) and e.body == body):
        if name.endswith("position_m") and stops.lower_m + stops.upper_m:
            yield float(stops.lower_m + stops.upper_m) - values


def _can_be(name: str, values: np.ndarray, limits: Mapping[str, tuple[float, float]]) -> bool:
    """Whether these numbers could be this channel at all."""
    size, least = float(np.nanmax(np.abs(values))), float(np.nanmin(values))
    if name in limits and np.isfinite(limits[name]).all():
        return size <= BEYOND * max(map(abs, limits[name]))
    low, high = LIMITS.get(suffix(name), (0.0, np.inf))
    return low <= size <= high and (suffix(name) != "pa" or least > VACUUM_PA)
