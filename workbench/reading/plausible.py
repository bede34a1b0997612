"""Whether numbers can be what a rig file says they are: units, stuck and saturated sensors."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from workbench.errors import InputError, Message, listed
from workbench.fitting.unknowns import nominal_unknowns
from workbench.plant import Plant
from workbench.reading.table import RecordingWarning
from workbench.recording import Recording
from workbench.rig import AMBIENT, Rig
from workbench.saturation import LIVELY, saturated
from workbench.spelled_units import is_gauge, spelled
from workbench.units import display_unit, public_name, scale, si_unit, suffix

LIMITS = {
    # suffix: what the largest size of a value must reach, and may not pass, in SI
    "pa": (5e4, 4e6),
    "m": (0.0, 20.0),
    "m_s": (0.0, 200.0),
    "rad": (0.0, 30.0),
    "n": (0.0, 1e6),
    "k": (100.0, 2e3),
}
USUAL = {
    # suffix: the range of an ordinary largest value in SI, and the units in which people log it
    "pa": (9e4, 3e6, ("bar", "kPa", "psi", "mbar", "MPa", "Pa")),
    "m": (1e-3, 3.0, ("mm", "cm", "um", "m")),
    "m_s": (1e-2, 10.0, ("mm/s", "m/s")),
    "rad": (1e-2, 12.0, ("deg", "rad", "mrad")),
    "v": (1e-2, 12.0, ("mV", "V")),
    "n": (0.1, 2e4, ("N", "kN", "mN")),
    "k": (230.0, 600.0, ("K", "degC")),
}
LEAST_GAUGE_PA = 1e3  # a gauge pressure that never gets this far is no recording of a pressure
VACUUM_PA = 1e3  # an absolute pressure below this is one that counts from ambient
SUPPLY = "supply.pressure_pa"
ROOM = 0.25  # a chamber goes that far below ambient and above supply, as shares of each
BEYOND = 1.5  # of the range of a command: more cannot be that command
CLIPPED = 0.02  # of that range, beyond which a command is no longer what the plant takes
RUN = 50  # equal values in a row that make a sensor suspect, where it usually changes


def cannot_be(
    name: str, raw: np.ndarray, si: np.ndarray, unit: str, plant: Plant, file: str
) -> Message | None:
    """What makes these values impossible in their unit, with the unit they look like."""
    low, high = float(np.nanmin(si)), float(np.nanmax(si))
    size, kind = max(abs(low), abs(high)), public_name(name)
    least, most = LIMITS.get(suffix(name), (0.0, np.inf))
    for signal in plant.commands:
        if signal.name == name and signal.levels:
            return _no_level(kind, raw, si, signal.levels, file)
        if signal.name == name and np.isfinite(signal.upper):
            most = BEYOND * max(abs(signal.upper), abs(signal.lower))
    if is_gauge(unit):
        low = VACUUM_PA  # below ambient is no wonder
        least, size = LEAST_GAUGE_PA, float(np.nanmax(np.abs(raw))) * scale(unit, name).factor
    if not least <= size <= most:
        seen = f"values between {np.nanmin(raw):.4g} and {np.nanmax(raw):.4g}"
        others, tenfold = _looks_like(name, raw, unit), _ten_times(name, si, unit, plant)
        if tenfold and not _is_ten_times(others, unit, name):
            look = " or ".join((f"ten times {tenfold}", *others))
            expected = f"another unit than '{unit}', or another gain of the sensor"
            return Message(f"{seen} look {look}", kind, expected, file=file)
        hint = f" look like {' or '.join(others)}" if others else " cannot be"
        return Message(seen + hint, kind, f"another unit than '{unit}'", file=file)
    if si_unit(name) == "Pa" and low < VACUUM_PA:
        what = f"an absolute pressure of {low / 1e5:.3g} bar cannot be"
        return Message(what, kind, f"'{spelled(unit)}_gauge' if it counts from ambient", file=file)
    return None


def _no_level(
    kind: str, raw: np.ndarray, si: np.ndarray, levels: Sequence[float], file: str
) -> Message | None:
    """What a switched command cannot be: anything between or beyond its levels."""
    off = np.isfinite(si) & ~np.isclose(si[:, None], levels, atol=1e-6).any(axis=1)
    if not off.any():
        return None
    first = int(off.argmax())
    what = f"is {raw[first]:.4g} in sample {first + 1}"
    more = f", and none of its levels in {off.sum()} samples" if off.sum() > 1 else ""
    return Message(what + more, kind, " or ".join(f"{level:g}" for level in levels), file=file)


def _ten_times(name: str, si: np.ndarray, unit: str, plant: Plant) -> str:
    """Whether a pressure is ``too large`` or ``too small`` by ten for this supply and ambient."""
    if si_unit(name) != "Pa" or not {SUPPLY, AMBIENT} <= plant.values.keys():
        return ""
    base_pa = plant.values[AMBIENT] if is_gauge(unit) else 0.0  # where a sensor reads 0
    lowest_pa = (1.0 - ROOM) * plant.values[AMBIENT]
    highest_pa = (1.0 + ROOM) * plant.values[SUPPLY]
    for factor, words in ((0.1, "too large"), (10.0, "too small")):
        low_pa, high_pa = (factor * (end(si) - base_pa) for end in (np.nanmin, np.nanmax))
        there = max(-low_pa, high_pa) >= LEAST_GAUGE_PA  # ambient alone is no pressure on a gauge
        if there and lowest_pa <= base_pa + low_pa and base_pa + high_pa <= highest_pa:
            return words
    return ""


def _is_ten_times(others: Sequence[str], unit: str, name: str) -> bool:
    """Whether one of the other units is ten times this one, which then says it all."""
    ratios = [scale(other, name).factor / scale(unit, name).factor for other in others]
    return bool(np.isclose(ratios, 10.0).any() or np.isclose(ratios, 0.1).any())


def _looks_like(name: str, raw: np.ndarray, unit: str) -> list[str]:
    """The usual units in which these values would be ordinary."""
    smallest, largest, units = USUAL.get(suffix(name), (0.0, 0.0, ()))
    size = float(np.nanmax(np.abs(raw)))
    others = (other for other in units if other != unit)
    return [u for u in others if smallest <= abs(scale(u, name).to_si(size)) <= largest]


def warn_of_sensors(channels: Mapping[str, np.ndarray], outputs: set[str], file: str) -> None:
    """Warn of sensors that stand still, or sit at the end of their range, for a while."""
    for name in outputs & channels.keys():
        values = channels[name]
        at_ends = saturated(name, values)
        said = [saturation_text(name, values, at_ends)] if at_ends.any() else []
        stretch = stuck_stretch(np.where(at_ends, np.nan, values))
        if stretch is not None:
            first, length = stretch
            at_end = values[first] in (np.nanmin(values), np.nanmax(values))
            said += [
                f"{'saturated' if at_end else 'stuck'} at {_shown(name, values[first])} for "
                f"{length} samples from sample {first + 1} on"
            ]
        for each in said:
            text = f"{file}: {public_name(name)}: {each}"
            warnings.warn(text, RecordingWarning, stacklevel=3)


def warn_of_commands(channels: Mapping[str, np.ndarray], plant: Plant, file: str) -> None:
    """Warn of commands beyond their range: the plant takes them as its end."""
    for signal in plant.commands:
        values = channels.get(signal.name)
        room = CLIPPED * (signal.upper - signal.lower)
        if values is None or signal.levels or not np.isfinite(room):
            continue
        outside = (values > signal.upper + room) | (values < signal.lower - room)
        if not outside.any():
            continue
        low, high = (_shown(signal.name, end) for end in (signal.lower, signal.upper))
        count, first = int(outside.sum()), int(outside.argmax()) + 1
        far = _shown(signal.name, values[outside][np.argmax(np.abs(values[outside]))])
        text = f"goes to {far}, beyond {low} to {high}, in {count} samples from sample {first} on"
        said = f"{file}: {public_name(signal.name)}: {text}; the plant takes the end of its range"
        warnings.warn(said, RecordingWarning, stacklevel=3)


def saturation_text(name: str, values: np.ndarray, at_ends: np.ndarray) -> str:
    """At which values a sensor is saturated, and in which share of the samples."""
    ends = " and ".join(_shown(name, end) for end in np.unique(values[at_ends]))
    count, seen = int(at_ends.sum()), int(np.isfinite(values).sum())
    first = int(at_ends.argmax()) + 1
    return f"saturated at {ends} in {count} samples ({count / seen:.1%}) from sample {first} on"


def _shown(name: str, value: float) -> str:
    return f"{scale(display_unit(name), name).from_si(value):.5g} {display_unit(name)}".rstrip()


def stuck_stretch(values: np.ndarray) -> tuple[int, int] | None:
    """First sample and length of the longest stretch that is equal to the last bit, (n,).

    Samples are held against the next one there is.  None where it is short, or where the channel
    often stands still.
    """
    there, same = _repeats(values)
    length, first = _longest_run(same)
    rest = np.delete(same, slice(first, first + length)) if length else same
    if length < RUN or not len(rest) or rest.mean() > LIVELY:
        return None
    return _span(there, first, length)


def still_stretch(values: np.ndarray) -> tuple[int, int]:
    """The same of any channel: a coarse sensor stands still between its steps, (0, 1) at least."""
    there, same = _repeats(values)
    length, first = _longest_run(same)
    return _span(there, first, length) if length else (0, 1)


def _span(there: np.ndarray, first: int, length: int) -> tuple[int, int]:
    """First sample and length of a run of repeats among the samples that there are."""
    return int(there[first]), int(there[first + length] - there[first]) + 1


def _repeats(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Samples that there are, and whether the next one of each is equal to the last bit."""
    there = np.flatnonzero(np.isfinite(values))
    return there, np.diff(values[there]) == 0


def _longest_run(same: np.ndarray) -> tuple[int, int]:
    """Length and first index of the longest run of True."""
    edges = np.diff(np.concatenate([[0], same.astype(int), [0]]))
    first, last = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    if not len(first):
        return 0, 0
    longest = int(np.argmax(last - first))
    return int(last[longest] - first[longest]), int(first[longest])


def enough_samples(rig: Rig, recordings: Sequence[Recording], only: Sequence[str] = ()) -> None:
    """Refuse to fit more parameters than there are samples: those named, or all that are free.

    Raises
    ------
    InputError
        Naming the recordings, with both numbers.
    """
    plant = rig.plant
    added = rig.added_to(plant)
    free = only or nominal_unknowns(plant, rig.deviations, rig.held, added).names
    samples = sum(map(len, recordings))
    if samples < len(free):
        what = f"{samples} samples are fewer than the {len(free)} parameters of {plant.name}"
        sources = listed(each.source or each.name for each in recordings)
        raise InputError(Message(what, expected="a longer recording to fit", file=sources))
