"""One thermal decay as recorded: the gas of a plugged chamber from the stop of its piston on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from workbench.fitting.noise import measured_noise
from workbench.identification.held_gas import (
    STILL_M,
    geometry,
    held_position_m,
    kept_share,
    plugged,
    position_channel,
    pressed_chamber,
)
from workbench.identification.result import unfit
from workbench.parts import Chamber
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.vessel import Vessel

LATER_S = 0.02  # after the stop: sensors and the piston have come to rest
LEAST_NOISE = 10.0  # noise deviations that the pressure must decay by
MOST_HEATED = 2.0  # temperature behind the stop over that of the wall, or the inverse
MOST_LOST = 0.3  # of the gas: more is no leak of a plugged chamber


@dataclass(frozen=True)
class Decay:
    """One decay: the pressure from the stop on, and the vessel it happens in.

    ``kept`` is the gas that is there at the end over that before the push, both at the temperature
    of the wall; 1 where no piston moves.
    """

    recording: Recording
    vessel: Plant
    channel: str
    noise: float
    kept: float

    @property
    def chamber(self) -> str:
        """The name of the chamber."""
        return self.channel.partition(".")[0]

    def larger_by(self, volume_m3: float) -> Decay:
        """The same decay in a larger volume."""
        name = f"{self.chamber}.volume_m3"
        larger = {name: self.vessel.values[name] + volume_m3}
        return replace(self, vessel=self.vessel.with_values(larger))


def check_plugged(decay: Decay) -> None:
    """Refuse what a valve fills or empties: that comes to rest like an exponential too.

    The gas of a plugged chamber stays there, and its pressure falls or rises by its temperature
    alone.
    """
    measured = decay.recording[decay.channel]
    n = max(len(measured) // 20, 1)
    first, last = float(measured[0]), float(measured[-n:].mean())
    if abs(decay.kept - 1.0) > MOST_LOST:
        what = f"{decay.kept:.0%} of the gas before the push is there at the end"
    elif not 1.0 / MOST_HEATED < first / last < MOST_HEATED:
        what = f"{first / 1e5:.2g} bar that come to {last / 1e5:.2g} bar are more than heat does"
    else:
        return
    expected = "both ports of the chamber plugged, so that its gas stays"
    raise unfit(decay.recording, f"is no thermal decay: {what}", expected)


def thermal_decay(plant: Plant, recording: Recording) -> Decay:
    """The part of a recording after the push, checked."""
    chamber = pressed_chamber(plant, recording)
    channel = f"{chamber.name}.pressure_pa"
    noise = measured_noise([recording], [channel])[channel]
    held_m = held_position_m(chamber, recording)
    volume, surface = geometry(plant, chamber, held_m)
    rest = recording.part(_stopped(chamber, recording, held_m), len(recording))
    pressure = rest[channel] if len(rest) else np.zeros(1)
    n = max(len(rest) // 20, 1)
    fallen_pa = abs(float(np.mean(pressure[:n]) - np.mean(pressure[-n:])))
    if len(rest) < 50 or fallen_pa < LEAST_NOISE * noise:
        what = f"is no thermal decay: {chamber.name} moves by {fallen_pa / 1e5:.2g} bar after it"
        expected = f"a decay of at least {LEAST_NOISE * noise / 1e5:.2g} bar, logged to its end"
        raise unfit(recording, what, expected)
    kept = kept_share(plant, chamber, recording, volume, float(np.mean(pressure[-n:])))
    return Decay(rest, plugged(plant, chamber, volume, surface), channel, noise, kept)


def _stopped(chamber: Chamber | Vessel, recording: Recording, held_m: float) -> int:
    """The sample at which a pushed piston and its sensors have come to rest; 0 of a vessel."""
    if isinstance(chamber, Vessel):
        return 0
    moving = np.flatnonzero(np.abs(recording[position_channel(chamber)] - held_m) > STILL_M)
    expected = "a piston pushed quickly and then held, both ports of its chamber plugged"
    if not len(moving):
        raise unfit(recording, "is no thermal decay: the piston never moves", expected)
    return int(moving[-1]) + 1 + round(LATER_S / recording.sample_time_s)


def start_state(decay: Decay, pressure_pa: float, end_pa: float) -> np.ndarray:
    """Vessel state at a pressure, with the mass of gas that is at wall temperature at the end."""
    vessel, volume = decay.vessel, next(p for p in decay.vessel.parts if hasattr(p, "volume_m3"))
    x = vessel.initial.copy()
    states = list(vessel.state_list)
    x[states.index(decay.channel)] = pressure_pa
    mass = f"{volume.name}.mass_kg"
    if mass in states:
        x[states.index(mass)] = volume.mass_at(end_pa, volume.volume_m3)
    return x
