"""S002-7: dead volumes from a known tank that is let into a locked chamber.

Tank (V_1, P_1) and chamber (V_i, P_i0) end at one pressure P_2 and, after some seconds, at the
temperature of the room, so that the gas of both is that of the common volume:

    P_1 V_1 + P_i0 V_i = P_2 (V_1 + V_i),    V_i = V_1 (P_1 - P_2) / (P_2 - P_i0)

all pressures absolute.  Erratum E002-9: Eq. 22 prints V_i = V_1 (P_1 / P_2 - 1), which holds for an
empty chamber only; with absolute pressures and a chamber at ambient it is 20 % too small.

Where P_2 is read, and against what, says `release.py`.  The dead volume is V_i without what the
piston has swept, by the plant's own geometry; where the plant changes its dead volume by a share,
it keeps that share and what is found is the volume that is changed.

Source: paper 002 Eqs. 22, 23, Fig. 15, Table 6 (E002-8, E002-9); physics.md 5, row S002-7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError, Message, likest_first, listed
from workbench.identification.estimate import Estimate
from workbench.identification.held_gas import (
    STILL_M,
    geometry,
    held_position_m,
    position_channel,
    pressed_chamber,
)
from workbench.identification.release import TANK_CHANNEL, Release, release
from workbench.identification.result import Curve, Identified, Procedure, complete, unfit
from workbench.parts import Chamber
from workbench.plant import Plant
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.units import public_name

TANK_M3 = 0.344e-3  # E002-10
NEAREST = 3  # columns that may hold the tank's pressure


@dataclass(frozen=True, kw_only=True)
class DeadVolumes(Identified):
    """Total and dead volume of each chamber that was filled; ``curves`` hold its pressure."""

    releases: tuple[Release, ...]


def dead_volume(
    rig: Rig, recordings: Sequence[Recording], tank_volume_m3: float = TANK_M3
) -> DeadVolumes:
    """Dead volumes of the chambers that a tank of known volume was let into.

    The tank stands where the supply was: its pressure is the channel ``supply.pressure``.

    Raises
    ------
    InputError
        If a recording has no release into a locked chamber, or ends before the flat window.
    """
    complete(recordings)
    plant = rig.fit_for(recordings[0])
    found: dict[str, tuple[Estimate, Estimate]] = {}
    releases, curves = [], []
    for each in recordings:
        chamber = _locked(plant, each)
        opened = release(chamber, each)
        if chamber.name in found:
            what = f"fills {chamber.name} again"
            raise unfit(each, what, "one recording for each chamber")
        found[chamber.name] = _volumes(plant, chamber, each, opened, tank_volume_m3)
        releases.append(opened)
        curves.append(_curve(each, opened))
    return DeadVolumes(
        rig=rig,
        estimates=tuple(total for total, _ in found.values()),
        parameters=tuple(dead for _, dead in found.values()),
        curves=tuple(curves),
        releases=tuple(releases),
    )


def _locked(plant: Plant, recording: Recording) -> Chamber:
    """The chamber that is filled, its piston locked."""
    if TANK_CHANNEL not in recording.channels:
        raise _no_tank(recording)
    chamber = pressed_chamber(plant, recording)
    if not isinstance(chamber, Chamber):
        what = "has no cylinder chamber, whose dead volume could be found"
        raise InputError(Message(what, plant.name, "a drive"))
    moved_m = float(np.ptp(recording[position_channel(chamber)]))
    if moved_m > STILL_M:
        what = f"is no reservoir test: the piston moves by {1e3 * moved_m:.3g} mm"
        raise unfit(recording, what, "a piston locked in its place")
    return chamber


def _no_tank(recording: Recording) -> InputError:
    """The complaint that a recording lacks the tank, with columns that may hold it."""
    name = public_name(TANK_CHANNEL)
    if not recording.unmapped:
        what = "is no reservoir test: the pressure of the tank is not recorded"
        return unfit(recording, what, f"it as {name}, where the tank stands for the supply")
    unread = listed(likest_first(name, recording.unmapped), most=NEAREST)
    what = (
        f"the rig maps no column to {name}, where the tank stands for the supply; "
        f"it does not read {unread}"
    )
    expected = f"the column of the tank's pressure as {name} in [recording.channels]"
    return unfit(recording, what, expected)


def _volumes(
    plant: Plant, chamber: Chamber, recording: Recording, opened: Release, tank_m3: float
) -> tuple[Estimate, Estimate]:
    """Total volume and dead volume."""
    total = tank_m3 * opened.fallen_pa / opened.risen_pa
    deviation = total * opened.deviation
    dead = f"{chamber.name}.dead_volume_m3"
    changed = 1.0 + plant.values.get(f"{chamber.name}.dead_volume_change", 0.0)
    volume, _ = geometry(plant, chamber, held_position_m(chamber, recording))
    swept = volume - changed * plant.values[dead]
    return (
        Estimate(f"{chamber.name}.total_volume_m3", total, deviation),
        Estimate(dead, (total - swept) / changed, deviation / changed),
    )


def _curve(recording: Recording, opened: Release) -> Curve:
    """Pressure of the chamber, and the exponential through its flat window from the release on."""
    time_s, pressure = recording.time_s, recording[f"{opened.chamber}.pressure_pa"]
    behind_s = np.maximum(time_s - opened.opened_s, 0.0)
    leaking = opened.after_pa * np.exp(-opened.leak_per_s * behind_s)
    fitted = np.where(time_s < opened.opened_s, opened.before_pa, leaking)
    return Curve(
        label=f"{recording.name}, {opened.chamber}",
        along=time_s,
        measured=pressure,
        fitted=fitted,
    )


PROCEDURE = Procedure(
    name="dead-volume",
    gives="total and dead volume of each chamber",
    manoeuvre="piston locked at the far end of the chamber's stroke, a full tank of known volume "
    "(--tank), filled 20 s or more before, in place of the supply: let it into the chamber 1 s "
    "after the start and leave it open for 30 s; one recording for each chamber",
    channels="valve.command, slide.position, the pressure of the chamber, and that of the tank as "
    "supply.pressure, at 50 Hz or more",
    example="dead-volume drive2.toml release_*.csv --tank '0.344 l' -o drive3.toml",
    source="paper 002 Eqs. 22, 23, Fig. 15, Table 6 (S002-7, E002-9)",
    printed={"chamber_a.total_volume_m3": 1.734e-4, "chamber_b.total_volume_m3": 1.976e-4},
    run=dead_volume,
)
