"""A rig's plant under recorded inputs alone: the outputs need not be there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from workbench.errors import InputError, Message, listed
from workbench.fitting.starts import guessed_states
from workbench.law_range import warn_beyond
from workbench.plant import Plant
from workbench.reading import read_recording
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.simulation import simulate as simulate_plant
from workbench.units import public_name


def read_inputs(rig: Rig, path: Path | str) -> Recording:
    """A recording of which only the inputs must be there."""
    plant = rig.plant
    needed = {signal.name for signal in (*plant.commands, *plant.measured_inputs)}
    channels = {
        name: replace(channel, optional=channel.optional or name not in needed)
        for name, channel in rig.reader.channels.items()
    }
    return read_recording(replace(rig, reader=replace(rig.reader, channels=channels)), path)


def simulate(rig: Rig, recording: Recording) -> Recording:
    """The nonlinear plant under recorded inputs: inputs, states and outputs, piece by piece.

    Each piece starts from its first recorded sample where outputs were recorded, else from the
    plant's own initial state.  Where it leaves the range in which the rig's empirical terms were
    seen, a warning says so.

    Raises
    ------
    InputError
        If a command or measured input is missing.
    ArithmeticError
        If the solution is not finite.
    """
    plant = plant_for(rig, recording).lean()
    pieces = [simulate_plant(plant, p, guessed_states(plant, p)[0, :, 0]) for p in recording.pieces]
    found = _joined(recording, pieces)
    warn_beyond(rig, found)
    return found


def plant_for(rig: Rig, recording: Recording) -> Plant:
    """The rig's plant with what was recorded of its optional inputs as measured inputs.

    Raises
    ------
    InputError
        If a command or measured input is missing.
    """
    plant, carried = rig.plant, recording.channels
    needed = [s.name for s in (*plant.commands, *plant.measured_inputs)]
    missing = [public_name(name) for name in needed if name not in carried]
    if missing:
        what = f"{plant.name} needs {listed(missing)}"
        raise InputError(Message(what, recording.name, f"besides {listed(carried)}"))
    given = [s.name for s in plant.optional_inputs if s.name in carried]
    return plant.with_measured_input(*given) if given else plant


def _joined(recording: Recording, pieces: list[Recording]) -> Recording:
    import numpy as np

    names = pieces[0].channels
    channels = {name: np.concatenate([piece[name] for piece in pieces]) for name in names}
    return replace(recording, channels=channels, noise={}, source="simulation")
