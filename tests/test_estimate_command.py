"""``workbench estimate``: what it tells of a recording, and what it refuses."""

import json

import numpy as np
import pytest
from commands import call

from studies.estimating import estimate_rig
from studies.estimating_disturbed import GAP_S, GATED, HOLES, LATELY, SLOWLY, UNGATED
from studies.figures.estimates import estimate_figures
from workbench.errors import InputError
from workbench.plants.servo_drive import OUTPUTS, servo_drive
from workbench.recording import Recording
from workbench.rig import default_rig
from workbench.simulation import simulate

RIG = """plant = "servo_drive"
[recording]
time = { column = "t", unit = "s" }
[recording.channels]
"valve.command" = { column = "u", unit = "V" }
"slide.position" = { column = "x", unit = "m" }
"chamber_a.pressure" = { column = "a", unit = "Pa" }
"chamber_b.pressure" = { column = "b", unit = "Pa" }
"""
COMMAND, N = "valve.command_v", 600


def moved():
    """A drive that is pushed forth and back for 0.6 s, with sensor noise."""
    t = 1e-3 * np.arange(N)
    plant = servo_drive().lean()
    run = simulate(plant, Recording("run", 1e-3, {COMMAND: 4.95 + 0.9 * np.sin(12.0 * t)}))
    rng = np.random.default_rng(3)
    sizes = dict(zip(OUTPUTS, (5e-6, 500.0, 500.0), strict=True))
    seen = {name: run[name] + size * rng.standard_normal(N) for name, size in sizes.items()}
    return Recording("run", 1e-3, {COMMAND: run[COMMAND], **seen})


@pytest.fixture(scope="module")
def found():
    return estimate_rig(default_rig("servo_drive"), [moved()], ["ekf", "kalman"])


def test_the_filter_foretells_the_recording_down_to_its_noise(found):
    (ekf, kalman) = found[0].rows

    assert ekf.horizons[0.001] == pytest.approx([5e-6, 500.0, 500.0], rel=0.5)
    assert ekf.horizons[0.05][0] < 1e-3
    assert 0.7 < ekf.nis < 1.3
    assert ekf.median_s > 0.0 and ekf.p99_s >= ekf.median_s
    assert (kalman.horizons[0.01] >= 0.9 * ekf.horizons[0.01]).all()


def test_states_are_known_where_the_truth_is(found):
    (ekf, _) = found[0].rows

    assert ekf.state_rmse["slide.velocity_m_s"] < 0.02
    assert ekf.state_rmse["chamber_a.pressure_pa"] < 500.0


def test_an_effect_that_is_hidden_makes_it_worse(found):
    (ekf, _) = found[0].rows

    assert found[0].hidden == "constant_force"
    assert ekf.hidden_rmse["slide.velocity_m_s"] > ekf.state_rmse["slide.velocity_m_s"]


def test_data_that_lack_something_cost_what_they_must(found):
    """Of the position, in motion: a hole most; slow pressures and a gate that works next to none.

    Without a gate an outlier of 50 deviations is believed.
    """
    (ekf, _) = found[0].rows
    position = {what: errors[0] for what, errors in ekf.disturbed.items()}
    plain = ekf.state_rmse["slide.position_m"]

    assert GAP_S == 0.05
    assert position[HOLES] > 1.5 * plain
    assert position[SLOWLY] < 2 * plain
    assert position[GATED] < 2 * plain < position[UNGATED]
    assert plain < position[LATELY] < position[HOLES]
    assert all(np.isfinite(errors).all() for errors in ekf.disturbed.values())


def test_the_figure_has_a_panel_for_each_state_and_estimator(found):
    (figure,) = estimate_figures(found).values()

    assert len(figure.axes) == 4 * 2
    assert [axes.get_title() for axes in figure.axes[:2]] == ["ekf", "kalman"]
    assert figure.axes[0].get_ylabel() == "slide\nposition\nerror (mm)"


@pytest.fixture
def place(tmp_path):
    (tmp_path / "rig.toml").write_text(RIG)
    run = moved()
    rows = np.column_stack([run.time_s, run[COMMAND], *(run[name] for name in OUTPUTS)])
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header="t,u,x,a,b", comments="")
    return tmp_path


def test_the_command_prints_tables_and_writes_json(place):
    answer = call("estimate", place / "rig.toml", place / "run.csv", "--with", "ekf", "-q",
                  "--json", place / "found.json")  # fmt: skip
    document = json.loads((place / "found.json").read_text())
    (row,) = document["recordings"][0]["estimators"]

    assert answer.exit_code == 0, answer.output
    assert "process noise by likelihood: momentum x" in answer.stdout
    assert "slide.velocity" in answer.stdout
    assert "every state is seen by slide.position" in answer.stdout
    assert document["schema"] == "workbench.estimates/1"
    assert document["recordings"][0]["not_observable"] == []
    assert document["recordings"][0]["known_to"]["slide.velocity"]["value"] < 1e-2
    assert row["estimator"] == "ekf"
    assert row["prediction_rmse"]["0.01 s"]["slide.position"]["unit"] == "m"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--with", "ekff"), "ekff: is no estimator"),
        (("--with", "ekf,"), "an empty name: is no estimator; expected one of kalman, ekf"),
        (("--with", ""), "an empty name: is no estimator"),
        (("--with", "ekf", "--hide", "chamber_leek@chamber_a"), "chamber_leak@chamber_a"),
    ],
)
def test_an_unknown_name_is_refused_with_the_nearest(place, words, told):
    answer = call("estimate", place / "rig.toml", place / "run.csv", "-q", *words)

    assert answer.exit_code == 2
    assert told in answer.stderr


def test_a_plant_without_states_is_refused():
    plant = default_rig("cylinder_bench").plant
    names = (*plant.model.measured_inputs, *plant.measured)
    held = Recording("held", 1e-3, {name: np.linspace(1.0, 2.0, 50) for name in names})

    with pytest.raises(InputError, match="cylinder_bench: has no states to estimate"):
        estimate_rig(default_rig("cylinder_bench"), [held], ["ekf"])
