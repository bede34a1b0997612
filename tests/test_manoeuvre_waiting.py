"""A manoeuvre that stops and waits: meanwhile there is no reference, and no loop acts."""

import numpy as np
import pytest
from test_how_to_play import DRIVE, PLACE, going
from test_rehearsal import COMMAND, fit, limits_between  # noqa: F401

from studies.text_of_next_recording import LAW, LOOP_OFF, conduct_lines, instructions
from studies.truth.cases import read_cases
from studies.truth.record import played
from workbench.comparison.run import read_inputs
from workbench.diagnosis.result import NextRecording
from workbench.manoeuvres.conduct import conduct
from workbench.manoeuvres.library import position_triangle, shut_and_wait
from workbench.manoeuvres.limits import limits_of
from workbench.manoeuvres.rehearse import SpeedMap, rehearse, speed_maps
from workbench.reading.command_writer import write_commands
from workbench.recording import Recording
from workbench.rig import default_rig


def test_the_reference_is_missing_where_the_valve_is_shut_and_nowhere_else(fit):  # noqa: F811
    limits = limits_between(fit, 0.02, 0.08, 0.03)
    play = shut_and_wait(limits, 1.0)
    (command,), (reference,) = play.commands, play.reference
    waits = np.isnan(reference)

    assert np.array_equal(waits, np.isfinite(command))
    assert set(command[waits]) == {limits.commands[0].nominal}
    assert np.count_nonzero(np.diff(waits.astype(int)) == 1) == 2  # at two places
    assert waits.sum() * limits.sample_time_s > 5.0


def test_a_loop_rests_while_it_waits_and_then_acts_again(fit):  # noqa: F811
    limits = limits_between(fit, 0.02, 0.08, 0.03)
    play = shut_and_wait(limits, 1.0)
    (run,) = rehearse(fit, limits, [play], speed_maps(fit, limits))
    waits = np.isnan(play.reference[0])
    first, *_, last = np.flatnonzero(~waits[1:] & waits[:-1]), np.flatnonzero(waits)[-1]

    assert np.isfinite(run[COMMAND]).all()
    assert set(run[COMMAND][waits]) == {limits.commands[0].nominal}
    goal = play.reference[0][np.flatnonzero(~waits)[-1]]
    assert abs(run[PLACE][first[0]] - goal) > 0.01  # from the first place
    assert run[PLACE][last] == pytest.approx(goal, abs=4e-3)  # to the second one


@pytest.fixture(scope="module")
def asked():
    """What asks for it, and the same for a manoeuvre that never waits."""
    recorded = going(0.06, 0.12)
    limits = limits_of(DRIVE, [recorded])
    speeds = SpeedMap(np.array([-0.5, 0.0, 0.5]), np.array([4.0, 4.95, 6.0]))
    known = conduct(limits, DRIVE, [recorded], [recorded], [speeds])
    return [
        NextRecording("go", ("one", "other"), 9.0, conduct=known, reference={PLACE: reference})
        for make in (shut_and_wait, lambda *to: position_triangle(*to, 9.0))
        for (reference,) in [make(limits, 1.0).reference]
    ]


def test_instructions_say_that_the_loop_is_off_where_there_is_no_reference(asked):
    waiting, moving = asked

    assert conduct_lines(waiting) == [*conduct_lines(moving), LOOP_OFF]
    assert LOOP_OFF in instructions(waiting).splitlines()
    assert "without a reference the loop is off" in LAW


@pytest.mark.filterwarnings("ignore:.*did you mean 'reference slide.position'")
def test_the_file_has_no_reference_while_it_waits(asked, tmp_path):
    rig, reference = default_rig("servo_drive"), asked[0].reference
    sent = Recording("sent", 1e-3, {COMMAND: np.linspace(4.0, 6.0, len(reference[PLACE]))})

    write_commands(rig, sent, tmp_path / "next.csv", reference)

    rows = np.genfromtxt(tmp_path / "next.csv", delimiter=",", skip_header=1)
    assert np.array_equal(np.isnan(rows[:, -1]), np.isnan(reference[PLACE]))
    assert read_inputs(rig, tmp_path / "next.csv")[COMMAND] == pytest.approx(sent[COMMAND])


def test_the_loop_of_the_truth_is_off_where_there_is_no_reference():
    """A loop that held the last reference would hunt: the drive is 50 mm short of it."""
    reference_m = np.repeat([0.06, 0.11, np.nan, 0.11], [100, 50, 300, 300])
    waits = np.isnan(reference_m)

    table = played(read_cases()["constant_force", 3], np.zeros(750), reference_m, 0.06)

    assert all(np.isfinite(values).all() for values in table.values())
    assert len(set(table["command_V"][waits])) == 1
    assert np.ptp(table["command_V"][~waits]) > 1.0
    assert table["position_mm"][-1] == pytest.approx(110.0, abs=5.0)
