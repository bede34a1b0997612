"""Modes of the rig's and the arm's cylinder for tests of controllers: direction by place."""

from itertools import pairwise
from math import inf, radians

from linearize.equilibrium import operating_point
from linearize.modes import Interval, hybrid_modes
from workbench.plants.crr_arm import crr_arm
from workbench.plants.crr_rig import crr_rig

SPEEDS = {"crr_rig": 0.1, "crr_arm": 0.4}
PLACES = {
    "crr_rig": (0.02, 0.076, 0.13),
    "crr_arm": tuple(radians(angle) for angle in (25.0, 56.0, 87.0)),
}
PLANTS = {"crr_rig": crr_rig, "crr_arm": crr_arm}


def cylinder_modes(plant):
    """Steady motion both ways at three places, six modes."""
    position = plant.measured[0]
    velocity = next(n for n in plant.model.states if n.startswith(f"{position.split('.')[0]}.vel"))
    pressures, command = plant.measured[1:], plant.commands[0].name
    speed, places = SPEEDS[plant.name], PLACES[plant.name]
    ends = [-inf, *((a + b) / 2.0 for a, b in pairwise(places)), inf]
    cuts = {
        velocity: (Interval("back", -inf, 0.0, -speed), Interval("forth", 0.0, inf, speed)),
        position: tuple(
            Interval(f"place {k}", ends[k], ends[k + 1], at) for k, at in enumerate(places)
        ),
    }

    def moving(model, box):
        given = {name: interval.point for name, interval in box.items()}
        return operating_point(model, given, (command, *pressures), (velocity, *pressures))

    return hybrid_modes(plant, cuts, moving)
