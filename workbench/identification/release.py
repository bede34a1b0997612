"""One release of a full tank into a locked chamber: pressures before, and the common one after.

What the tank has lost and what the chamber has gained are each the difference of two readings of
one sensor, so that the offset of neither counts.  P_2 is read in a flat window well behind the
release and carried back to it as an exponential: what is lost by then has leaked, not cooled, and
a leak takes the same share of the gas in every second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.identification.result import unfit
from workbench.parts import Chamber
from workbench.recording import Recording

TANK_CHANNEL = "supply.pressure_pa"
FLAT_S = (20.0, 30.0)  # behind the release
LEAST_RISE = 0.05  # of the pressure of the tank
SAME = 0.01  # of the pressure: the tank has emptied into the chamber
GAUGE_ERROR = 1e-3  # of a pressure sensor's span of 10 bar: its share in the deviation
SPAN_PA = 10e5
MOST_LEAK_PER_S = 5e-3
EARLY_S = 0.5  # how well is known from when on it leaks: tank and chamber meet within a second
MOST_DRIFT_PA_S = 1e3  # before the release; more is still to come than a sensor is in error
SURELY, LIKELY = 4.0, 2.0  # standard errors of a drift


@dataclass(frozen=True)
class Release:
    """One release: pressures in Pa, times in s behind the start of the recording.

    Attributes
    ----------
    tank_pa, before_pa
        Tank and chamber before the release.
    tank_after_pa, after_pa
        Tank and chamber behind it, carried back to it, each by its own sensor.
    leak_per_s
        The share of the common pressure that goes in a second of the flat window.
    deviation
        Of the ratio of fallen to risen, relative.
    """

    chamber: str
    opened_s: float
    window_s: tuple[float, float]
    tank_pa: float
    before_pa: float
    tank_after_pa: float
    after_pa: float
    leak_per_s: float
    deviation: float

    @property
    def fallen_pa(self) -> float:
        """What the tank has lost."""
        return self.tank_pa - self.tank_after_pa

    @property
    def risen_pa(self) -> float:
        """What the chamber has gained."""
        return self.after_pa - self.before_pa


@dataclass(frozen=True)
class _Flat:
    """The flat window: both carried back to the release, and how the two fall and differ."""

    tank_pa: float
    chamber_pa: float
    leak_per_s: float
    error_pa: float
    apart_pa: float


def release(chamber: Chamber, recording: Recording) -> Release:
    """The release that a recording holds, checked.

    Raises
    ------
    InputError
        If there is none, tank or chamber is not at rest before it, or the two do not end at one
        pressure that stands.
    """
    pressure, tank = recording[f"{chamber.name}.pressure_pa"], recording[TANK_CHANNEL]
    time_s = recording.time_s
    first = max(round(0.1 / recording.sample_time_s), 3)
    begun = _begun(chamber, recording, first)
    before = slice(0, begun - first)
    parts = (("the tank", tank), (chamber.name, pressure))
    drifts_pa_s = [_drift(recording, name, channel[before]) for name, channel in parts]
    opened_s = float(time_s[begun])
    flat = _flat(recording, opened_s, tank, pressure)
    tank_pa, before_pa = (float(np.mean(channel[before])) for _, channel in parts)
    changes_pa = tank_pa - flat.tank_pa, flat.chamber_pa - before_pa
    return Release(
        chamber=chamber.name,
        opened_s=opened_s,
        window_s=(opened_s + FLAT_S[0], opened_s + FLAT_S[1]),
        tank_pa=tank_pa,
        before_pa=before_pa,
        tank_after_pa=flat.tank_pa,
        after_pa=flat.chamber_pa,
        leak_per_s=flat.leak_per_s,
        deviation=_deviation(flat, *changes_pa, drifts_pa_s),
    )


def _begun(chamber: Chamber, recording: Recording, first: int) -> int:
    """The sample of the release."""
    pressure, tank = recording[f"{chamber.name}.pressure_pa"], recording[TANK_CHANNEL]
    expected = "a full tank let into the chamber once, 0.2 s or more after the start"
    rise_pa = float(np.max(pressure) - np.mean(pressure[:first]))
    if rise_pa < LEAST_RISE * float(np.mean(tank[:first])):
        what = f"is no reservoir test: {chamber.name} rises by {rise_pa / 1e5:.2g} bar only"
        raise unfit(recording, what, expected)
    begun = int(np.flatnonzero(pressure > np.mean(pressure[:first]) + 0.05 * rise_pa)[0])
    if begun < 2 * first:
        begins_s = recording.time_s[begun]
        what = f"is no reservoir test: it begins {begins_s:.2g} s before the release"
        raise unfit(recording, what, expected)
    return begun


def _drift(recording: Recording, name: str, pressure: np.ndarray) -> float:
    """What a pressure that should stand before the release likely changes by in a second.

    Gas that filling has warmed cools by about as much again within the next second or two, and
    that would count as gas that went over.
    """
    time_s = recording.sample_time_s * np.arange(len(pressure))
    (slope, _), covariance = np.polyfit(time_s, pressure, 1, cov=True)
    size, error = abs(float(slope)), float(np.sqrt(covariance[0, 0]))
    if size > max(SURELY * error, MOST_DRIFT_PA_S):
        way = "falls" if slope < 0 else "rises"
        what = f"{name} {way} by {size / 1e5:.2g} bar/s before the release: it is not at rest yet"
        most = f"{MOST_DRIFT_PA_S / 1e5:g} bar/s at most"
        expected = f"{most}: all tight, and the tank filled 20 s or more before"
        raise unfit(recording, what, expected)
    return size if size > LIKELY * error else 0.0


def _flat(recording: Recording, opened_s: float, tank: np.ndarray, chamber: np.ndarray) -> _Flat:
    """Tank and chamber in the flat window.

    What has leaked is that of their mean, in one piece for both: the share of an offset is none.
    """
    time_s = recording.time_s - opened_s
    if time_s[-1] < FLAT_S[1]:
        what = f"ends {time_s[-1]:.3g} s after the release"
        raise unfit(recording, what, f"{FLAT_S[1]:g} s: the gas must come to room temperature")
    inside = (time_s >= FLAT_S[0]) & (time_s <= FLAT_S[1])
    ends_pa = [float(np.mean(channel[inside])) for channel in (tank, chamber)]
    apart_pa, level_pa = abs(ends_pa[0] - ends_pa[1]), float(np.mean(ends_pa))
    if apart_pa > SAME * level_pa:
        what = f"is no reservoir test: tank and chamber end {apart_pa / 1e5:.2g} bar apart"
        raise unfit(recording, what, "the tap left open until both have one pressure")
    common = np.log(0.5 * (tank + chamber)[inside])
    (slope, level), covariance = np.polyfit(time_s[inside], common, 1, cov=True)
    if abs(slope) > MOST_LEAK_PER_S:
        way = "lose" if slope < 0 else "gain"
        what = f"tank and chamber {way} {abs(slope):.2%} of their pressure in a second of the flat "
        what += f"window, {FLAT_S[0]:g} s to {FLAT_S[1]:g} s after the release"
        raise unfit(recording, what, f"tight fittings and seals: {MOST_LEAK_PER_S:.1%} at most")
    lost_pa = float(np.exp(level)) - level_pa
    error_pa = level_pa * float(np.hypot(np.sqrt(covariance[1, 1]), slope * EARLY_S))
    return _Flat(ends_pa[0] + lost_pa, ends_pa[1] + lost_pa, -float(slope), error_pa, apart_pa)


def _deviation(flat: _Flat, fallen_pa: float, risen_pa: float, drifts_pa_s: list[float]) -> float:
    """Relative deviation of fallen over risen.

    Each of the four readings has the error of its sensor, and those before the release what they
    drift by in a second.  An error of the leak enters both changes.  By what the sensors disagree
    at one pressure, one may be an offset, which does not count, or a gain, which does.
    """
    reading_pa = GAUGE_ERROR * SPAN_PA / np.sqrt(12.0)
    changes_pa = np.array([fallen_pa, risen_pa])
    readings = np.hypot(np.sqrt(2.0) * reading_pa, drifts_pa_s) / changes_pa
    leaked = flat.error_pa * float(np.sum(1.0 / changes_pa))
    return float(np.linalg.norm([*readings, leaked, flat.apart_pa / flat.chamber_pa]))
