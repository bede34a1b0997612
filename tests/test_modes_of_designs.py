"""``modes --for METHOD`` lists the modes that a design by it names, with tables and export."""

import json

import numpy as np
import pytest
from commands import call

from controllers import CONTROLLERS
from linearize.holding import whole_point
from linearize.standard import leg_joint_modes
from workbench.plants import PLANTS

BRIEF = ("--no-validity", "-q")
METHODS = {"crr_rig": "axis-lq", "crr_arm": "feedback-linearisation", "crr_leg": "joint-lq"}


@pytest.fixture
def rig(tmp_path):
    """Writes the file of a rig with this plant."""

    def written(plant):
        (tmp_path / "rig.toml").write_text(f'plant = "{plant}"\n')
        return tmp_path / "rig.toml"

    return written


@pytest.mark.parametrize("plant", METHODS)
def test_the_modes_of_a_design_are_listed_and_exported_with_their_matrices(tmp_path, rig, plant):
    words = ("--for", METHODS[plant], "--json", tmp_path / "modes.json", "--export", tmp_path / "m")
    answer = call("modes", rig(plant), *words, *BRIEF)
    assert answer.exit_code == 0, answer.output
    wanted = CONTROLLERS[METHODS[plant]].modes(PLANTS[plant]())
    found = json.loads((tmp_path / "modes.json").read_text())["modes"]
    arrays = np.load(tmp_path / "m" / "modes.npz")
    pictures = {path.stem for path in (tmp_path / "m").glob("*.svg")}

    assert [mode["name"] for mode in found] == [mode.name for mode in wanted.modes]
    assert all(np.array_equal(f["A"], m.A) for f, m in zip(found, wanted.modes, strict=True))
    assert all(f["error_share"] < 0.2 for f in found)
    assert np.array_equal(arrays["B_0"], wanted.modes[0].B)
    assert ("mode_map" in pictures) == (plant != "crr_leg") and "mode_poles" in pictures


def test_every_mode_that_a_design_names_is_among_those_listed(tmp_path, rig):
    path, made = rig("crr_rig"), tmp_path / "lq.toml"
    designed = call("design", path, "--controller", "axis-lq", "-o", made, "-q").stdout
    listed = call("modes", path, "--for", "axis-lq", *BRIEF).stdout
    standard = call("modes", path, *BRIEF).stdout
    rows = [line for line in designed.splitlines() if line.startswith("slide ")]
    names = {" ".join(line.split()[: 5 if "end" in line else 3]) for line in rows}

    assert len(names) == 6
    for name in names:
        assert f"\n{name} " in listed and f"\n{name} " not in standard


def test_a_joints_mode_stands_at_the_point_of_the_whole_leg():
    """The other cylinders carry their joints at rest there, under commands of their own."""
    hybrid = leg_joint_modes(PLANTS["crr_leg"]())
    model = hybrid.model
    n = len(model.states)
    for mode in hybrid.modes:
        point = whole_point(hybrid, mode)
        rates = model.f(point[:n], point[n:])[0].full().ravel() / model.scale
        others = [k for k, name in enumerate(model.states) if name not in mode.state_names]

        assert np.abs(rates[others]).max() < 1e-2
