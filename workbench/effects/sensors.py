"""What may be wrong with the sensors of a plant, as its file asks for it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from workbench.effect import Effect
from workbench.effects.sensor_offset import (
    AngleSensorOffset,
    PositionSensorOffset,
    PressureSensorOffset,
)
from workbench.effects.sensor_response import SensorLag, SensorScale
from workbench.errors import InputError, Message, listed
from workbench.units import public_name, suffix

KINDS = {  # by unit: the offset, and a typical size of the signal
    "m": (PositionSensorOffset, 0.1),
    "rad": (AngleSensorOffset, 1.0),
    "pa": (PressureSensorOffset, 1e5),
}


def sensor_flaws(starts: Mapping[str, float]) -> Iterator[Effect]:
    """Lag, wrong scale and offset of each sensor; ``starts`` are what they read at the start.

    Raises
    ------
    InputError
        If a signal ends in no unit of a position, an angle or a pressure.
    """
    for signal, start in starts.items():
        place = public_name(signal)
        if suffix(signal) not in KINDS:
            ends = {"position": "m", "angle": "rad", "pressure": "pa"}
            meant = ends.get(place.rpartition(".")[2], "")
            what = f"sensor_flaws: there is none for {signal}"
            expected = f"a name that ends in {listed(f'_{unit}' for unit in KINDS)}"
            raise InputError(Message(what, "", expected, f"{place}_{meant}" if meant else ""))
        offset, unit = KINDS[suffix(signal)]
        yield SensorLag(name=f"sensor_lag@{place}", signal=signal, unit=unit, initial=start)
        yield SensorScale(name=f"sensor_scale@{place}", signal=signal)
        yield offset(name=f"sensor_offset@{place}", signal=signal)
