"""A closed chamber that loses pressure: by a leak, by cooling, or by a wall that cools with it.

V dp/dt = -kappa R T mdot_leak + (kappa - 1) Q, the full level with the mass of gas as a state, so
that the initial temperature of the gas is free.  The plant is bare: pressure stands still.

The chamber has no measured temperature and a leak's area over the volume is all that a pressure
shows, so volume, surface and ambient temperature are *chosen* and their priors wide.

Source: physics.md 2.7 and the chamber decay of the data set printed_cylinder.
"""

from __future__ import annotations

from workbench.effects import HairlineLeak, StillWall
from workbench.parts import Atmosphere
from workbench.plant import Plant
from workbench.vessel import Vessel

VOLUME_M3 = 1e-4
SURFACE_M2 = 1.3e-2  # of a cylinder as long as it is wide
START_PA = 8e5


def closed_chamber() -> Plant:
    """The tight chamber at room temperature."""
    return Plant(
        name="closed_chamber",
        parts=(
            Atmosphere(name="atmosphere"),
            Vessel(
                name="chamber",
                volume_m3=VOLUME_M3,
                surface_m2=SURFACE_M2,
                initial_pressure_pa=START_PA,
            ),
        ),
        effects=(
            HairlineLeak(name="chamber_leak", chamber="chamber"),
            StillWall(name="wall_heat", chambers=("chamber",), wall="atmosphere"),
        ),
        measured=("chamber.pressure_pa",),
    )
