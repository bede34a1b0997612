"""Which signals of a plant a position controller acts on: one body between two chambers."""

from __future__ import annotations

from dataclasses import dataclass

from workbench.plant import Plant


@dataclass(frozen=True)
class Axis:
    """Names of the states of one axis and of its command; a joint's position is its angle."""

    position: str
    velocity: str
    pressures: tuple[str, str]
    command: str

    @property
    def states(self) -> tuple[str, ...]:
        """Position, velocity and both pressures."""
        return (self.position, self.velocity, *self.pressures)


def axis_of(plant: Plant) -> Axis:
    """The axis of a plant with one valve: its first output, its speed, and two pressures.

    Raises
    ------
    ValueError
        If the plant is not of that kind.
    """
    position = plant.measured[0]
    body = position.rpartition(".")[0]
    states = plant.model.states
    speeds = [name for name in states if name.startswith(f"{body}.velocity")]
    pressures = [name for name in plant.measured if name.endswith(".pressure_pa")]
    if not speeds or len(pressures) != 2 or len(plant.commands) != 1:
        what = f"{plant.name} has {len(plant.commands)} commands and measures {position} and "
        what += f"{len(pressures)} pressures"
        raise ValueError(f"{what}; expected one command, a position first, and two pressures")
    return Axis(position, speeds[0], tuple(pressures), plant.commands[0].name)
