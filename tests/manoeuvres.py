"""The recorded manoeuvres that ship with the project, gone through by the drive's own model."""

from functools import cache

import studies.demo
from linearize.reduction import design_model
from linearize.visits import Visited, visited
from workbench.comparison.run import simulate
from workbench.reading import read_recording
from workbench.rig import load_rig

FOLDER = studies.demo.DATA


@cache
def gone_through(name: str) -> Visited:
    """What the drive visits under the recorded commands of ``train`` or ``validation``."""
    rig = load_rig(FOLDER / "rig.toml")
    simulated = simulate(rig, read_recording(rig, FOLDER / f"{name}.csv"))
    return visited(design_model(rig.plant), rig.plant.lean(), simulated)
