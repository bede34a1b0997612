"""Delays in the margins: a law behind an estimator that looks ahead, and one that does not."""

import numpy as np
import pytest
from commands import call

from controllers.design_file import design, write_design
from controllers.foresight import delays_of, foresighted
from controllers.margins import both_ways_s, closed, margins, margins_of
from controllers.output_feedback import kalman_gain, lqg_law
from controllers.scheduled import driven_modes
from linearize.discrete import sampled
from studies.checking import loops_of
from studies.closed_loop_check import PROCESS_NOISE, noise_of
from studies.design_report import design_report
from studies.design_text import design_texts
from studies.text import number
from workbench.errors import InputError
from workbench.plants import PLANTS
from workbench.plants.crr_rig import crr_rig
from workbench.plants.servo_drive import servo_drive
from workbench.rig import default_rig

DT = 2e-3
NEAR = (2e-3, 4e-3)  # about the margin of delay


@pytest.fixture(scope="module")
def lq():
    return design("lq", servo_drive())


@pytest.fixture(scope="module")
def mode(lq):
    return driven_modes(lq.hybrid)[0][1]


@pytest.fixture(scope="module")
def law(lq):
    return lq.controller.laws.forward[1]


def test_a_foreseen_delay_leaves_the_poles_of_the_loop_as_they_were(mode, law):
    """With the mode's own prediction the loop is the undelayed one, its openings under way at 0."""
    ahead = foresighted(mode, law, DT, 6.0 * DT)
    alone, there = (
        np.sort(abs(np.linalg.eigvals(closed(mode, *each))))
        for each in ((law, DT), (ahead, DT, 6.0 * DT))
    )

    assert there[-5:] == pytest.approx(alone, rel=1e-6)
    assert there[:-5].max() < 0.1


def test_a_foreseen_delay_takes_margins_although_it_leaves_the_poles(mode, law):
    """20 ms: the plant with 24 ms swings by 4 mm, where 6 to 7 ms of margin had been printed."""
    alone, ahead = margins_of(mode, law, DT), foresighted(mode, law, DT, 20e-3)
    found = margins_of(mode, ahead, DT, 20e-3)
    wrong_s = [np.abs(np.linalg.eigvals(closed(mode, ahead, DT, 20e-3 + d))).max() for d in NEAR]

    assert alone.delay_s > 6e-3
    assert 2e-3 < found.delay_s < 4e-3
    assert [radius < 1.0 for radius in wrong_s] == [d < found.delay_s for d in NEAR]


@pytest.mark.parametrize("share", [0.4, 0.9])
def test_a_part_of_a_sample_is_foreseen_as_the_estimators_do(mode, law, share):
    """It was rounded, to none or to all of a sample: what the estimators no longer do."""
    alone = np.linalg.eigvals(closed(mode, law, DT))
    late = np.linalg.eigvals(closed(mode, foresighted(mode, law, DT, share * DT), DT, share * DT))

    assert np.sort(abs(late))[-5:] == pytest.approx(np.sort(abs(alone)), rel=1e-6)


@pytest.mark.parametrize("late", [0.0, 1.0, 2.0])
def test_a_filter_that_is_told_what_arrives_leaves_the_poles_of_loop_and_filter(mode, law, late):
    """Separation holds behind a foreseen delay too; a filter told what is sent would be off."""
    noises = PROCESS_NOISE, noise_of(servo_drive())
    delay_s = late * DT
    filtered = lqg_law(mode, foresighted(mode, law, DT, delay_s), *noises, DT, delay_s)
    L, small = kalman_gain(mode, *noises, DT), sampled(mode, DT)
    alone = np.linalg.eigvals(closed(mode, law, DT))
    own = np.linalg.eigvals(small.F @ (np.eye(4) - L @ mode.C))
    there = abs(np.linalg.eigvals(closed(mode, filtered, DT, delay_s)))

    assert np.sort(there)[-9:] == pytest.approx(np.sort(abs(np.append(alone, own))), rel=1e-5)


@pytest.mark.parametrize(
    ("rig", "method", "words"),
    [
        (
            'plant = "servo_drive"\n[effects]\nadd = ["command_delay"]\n'
            '[values]\n"command_delay.delay" = "20 ms"\n',
            "lq",
            "with 20 ms of the commands, foreseen by each mode",
        ),
        pytest.param(
            'plant = "crr_rig"\n',
            "axis-pid",
            "with 1 ms of the sensors and 1 ms of the commands; the law acts on the measurement "
            "itself and foresees nothing, as under `check --estimator raw`",
            marks=pytest.mark.slow,
        ),
        ('plant = "servo_drive"\n', "lq", "without delays; all states are taken as known"),
    ],
)
def test_design_says_which_delays_its_margins_are_for(tmp_path, rig, method, words):
    path = tmp_path / "rig.toml"
    path.write_text(rig)
    answer = call("design", path, "--controller", method, "-o", tmp_path / "design.toml", "-q")

    assert answer.exit_code == 0, answer.output
    assert words in answer.stdout


def test_only_a_law_on_the_measurement_is_checked_on_a_drive_without_an_estimator(tmp_path):
    """`raw` is what its margins are for; an LQ feeds back what a drive does not measure."""
    plant, texts = servo_drive(), {}
    for method in ("axis-pid", "lq"):
        write_design(design(method, plant), path := tmp_path / f"{method}.toml")
        texts[path] = path.read_text()
    pid, lq = ({path: text} for path, text in texts.items())
    loops = loops_of(default_rig(plant), pid, ["raw"], ["step"])

    assert loops.once(plant, 0).rows[0].final_error_m < 0.5e-3
    for designs in (lq, texts):
        with pytest.raises(InputError, match="raw"):
            loops_of(default_rig(plant), designs, ["raw"], ["step"])


@pytest.mark.parametrize(
    ("method", "name"),
    [("axis-lq", "crr_rig"), ("joint-lq", "crr_leg"), ("pressure", "soft_joint")],
)
def test_raw_is_refused_on_a_bench_where_a_law_asks_for_what_no_sensor_gives(
    tmp_path, method, name
):
    """It had ended inside the program, with a KeyError; a pressure is all that a bellows has."""
    plant = PLANTS[name]()
    write_design(design(method, plant), path := tmp_path / "design.toml")
    asked = default_rig(plant), {path: path.read_text()}, ["raw"]

    if method == "pressure":
        assert loops_of(*asked).estimators == ("raw",)
        return
    with pytest.raises(InputError, match="raw gives what is measured, and design asks for more"):
        loops_of(*asked)


def test_a_law_on_the_measurement_has_the_margins_that_it_was_tuned_for():
    """With the delay of one way more than the sensors' alone, which had been printed."""
    found = design("axis-pid", crr_rig(), {"tuning": {"bandwidth_hz": 5.0}})
    delays = delays_of(found.plant, found.controller)
    hybrid, laws, dt = found.hybrid, found.controller.laws, found.controller.sample_time_s
    printed = "\n".join(design_texts(design_report(found, lambda said: None)))
    tuned = margins(hybrid, laws, dt, both_ways_s(found.plant))

    assert (delays.both_s, delays.foreseen) == (pytest.approx(2e-3), False)
    for each in tuned:
        assert f"{number(np.degrees(each.phase_rad), 3)}" in printed
