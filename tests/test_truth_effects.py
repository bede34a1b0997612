"""What the truth hides is what the catalogue means: the model with the same effect follows it."""

from dataclasses import replace

import numpy as np
import pytest

from studies.hidden_benches import SERVO_DRIVE
from studies.truth import drive as d
from studies.truth.batch import stack
from studies.truth.case import Case
from studies.truth.draw import EFFECTS, OUTSIDE_CATALOGUE
from studies.truth.integrate import open_loop
from workbench.recording import Recording
from workbench.rig import default_rig
from workbench.simulation import simulate

SHARE = 0.4  # of the typical size
OWN_WAY = ("supply_droop", "friction_asymmetry")  # told by more fields than one strength
NAMES = [name for name in EFFECTS if name not in (*OUTSIDE_CATALOGUE, *OWN_WAY)]
START_M, START_PA = 0.10, 5.65e5
TIME_S = 1e-3 * np.arange(900)
COMMAND_V = 4.95 + 0.9 * np.sin(2 * np.pi * 1.6 * TIME_S) * (TIME_S < 0.7)


SYMMETRIC = dict(coulomb_asymmetry=0.0, stiction_asymmetry=0.0, viscous_asymmetry=0.0)


def size(name):
    return SHARE * EFFECTS[name].typical


@pytest.fixture(scope="module")
def truths():
    """What the true drive does with each effect, all in one batch."""
    hidden = [{field: size(name) for field in EFFECTS[name].fields} for name in NAMES]
    batch = stack([replace(d.Drive(), **{**SYMMETRIC, **fields}) for fields in hidden])
    out = open_loop(batch, COMMAND_V, d.at_rest(batch, START_M, START_PA))
    return {name: {key: v[:, k] for key, v in out.items()} for k, name in enumerate(NAMES)}


@pytest.fixture(scope="module")
def plant():
    """The workbench's drive with all that it may lack at null, and its supply measured."""
    found = default_rig("servo_drive").plant.with_measured_input("supply.pressure_pa")
    return found.with_values({"friction.asymmetry": 0.0})


def followed(plant, values):
    """The workbench's drive under the same command, from the same start."""
    start = dict(zip(plant.model.states, plant.initial, strict=True))
    dead_m3, length_m = (3.105e-5, 5.525e-5), (START_M, d.STROKE_M - START_M)
    for k, side in enumerate("ab"):
        volume_m3 = dead_m3[k] + d.PISTON_AREA_M2 * length_m[k]
        start[f"chamber_{side}.pressure_pa"] = START_PA
        start[f"chamber_{side}.mass_kg"] = START_PA * volume_m3 / (288.0 * 293.15)
    start["slide.position_m"] = START_M
    held = {"valve.command_v": COMMAND_V, "supply.pressure_pa": np.full(len(TIME_S), 7e5)}
    recording = Recording("same", 1e-3, held)
    return simulate(plant.with_values(values), recording, np.array(list(start.values())))


def distance(true, found):
    """Weighted distance of position (mm) and pressures (10 kPa)."""
    errors = (
        1e3 * (true["position_m"] - found["slide.position_m"]),
        1e-4 * (true["pressure_a_pa"] - found["chamber_a.pressure_pa"]),
        1e-4 * (true["pressure_b_pa"] - found["chamber_b.pressure_pa"]),
    )
    return float(np.sqrt(sum(np.mean(e**2) for e in errors)))


@pytest.mark.parametrize("name", NAMES)
def test_the_model_with_the_same_effect_follows_the_truth(name, truths, plant):
    public = SERVO_DRIVE.public_name(Case(name, 0, size(name), (), ()))
    strength = plant.candidates[public].strength

    with_it = distance(truths[name], followed(plant, {strength: size(name)}))
    without = distance(truths[name], followed(plant, {strength: 0.0}))

    assert with_it < 0.25 * without
