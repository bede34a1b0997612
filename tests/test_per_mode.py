"""A controller and an estimator of its own in every mode."""

import numpy as np
import pytest

from controllers.design_file import design, read_design, write_design
from controllers.lq import lq_gain
from controllers.per_mode import GAINS, Method
from controllers.scheduled import driven_modes
from controllers.state_feedback import LqSpec
from linearize.standard import POSITION, slide_modes
from studies.closed_loop_check import check, standard_estimator
from workbench.contracts import Command, Estimate
from workbench.errors import InputError, UnknownNameError
from workbench.plants.servo_drive import servo_drive


@pytest.fixture(scope="module")
def plant():
    return servo_drive().lean()


@pytest.fixture(scope="module")
def hybrid(plant):
    return slide_modes(plant)


@pytest.fixture(scope="module")
def mixed(plant):
    """PID in the middle forward, a cascade there backward, LQ elsewhere."""
    chosen = {"charge a slide + middle": "pid", "charge b slide - middle": "cascade"}
    return design("per-mode", plant, {"modes": chosen})


def test_every_mode_has_the_gain_of_its_own_method(mixed, hybrid):
    gains, area = mixed.controller.gains, mixed.controller.task.area_m2
    (low, middle, _), (_, back, _) = driven_modes(hybrid)
    spec = LqSpec()
    lq = lq_gain(low, spec.tolerable, spec.integral_time_s, 1e-3)

    assert gains.forward[0].feedback == pytest.approx(lq.feedback)
    for found, mode, method in (
        (gains.forward[1], middle, Method.PID),
        (gains.backward[1], back, Method.CASCADE),
    ):
        wanted = GAINS[method](mode, area, 1e-3)
        assert found.feedback == pytest.approx(wanted.feedback)
        assert found.integral == pytest.approx(wanted.integral)
    assert not gains.forward[1].feedback[2:].any() and gains.backward[1].feedback[2:].any()


def at(plant, place_m, speed_m_s=0.0):
    states = plant.model.states
    x = np.array(plant.initial)
    x[states.index(POSITION)], x[states.index("slide.velocity_m_s")] = place_m, speed_m_s
    return Estimate(states, x, np.eye(len(states)))


def test_what_the_integral_holds_does_not_jump_between_modes_of_other_methods(mixed, plant):
    made = mixed.controller
    begun = made.start()
    for place_m in np.linspace(0.05, 0.24, 12):
        estimate, reference = at(plant, place_m), np.full((1, made.preview), place_m + 0.004)
        opened = [
            made.step(Command(begun.value, type(begun.memory)(plan=volts)), reference, estimate)
            for volts in (0.0, 0.05)
        ]
        one, other = (each.notes["opening_v"] for each in opened)
        assert one - other == pytest.approx(0.05, abs=1e-9)


def test_a_design_by_mode_is_a_file_that_builds_it_again(mixed, tmp_path):
    write_design(mixed, tmp_path / "mixed.toml")

    again = read_design(tmp_path / "mixed.toml")

    assert again.spec == mixed.spec
    assert again.controller.gains.forward[1].feedback == pytest.approx(
        mixed.controller.gains.forward[1].feedback
    )
    assert '"charge a slide + middle" = "pid"' in (tmp_path / "mixed.toml").read_text()


@pytest.mark.parametrize(
    ("modes", "said"),
    [
        ({"charge a slide + midle": "pid"}, "did you mean 'charge a slide"),
        ({"closed slide + middle": "pid"}, "closed slide .* the valve drives the motion have no"),
        ({"charge a slide + middle": "pit"}, "is 'pit'"),
        ({"charge a slide + middle": ["pid"]}, "is \\['pid'\\]; expected lq, pid, cascade"),
        ("pid", "no table"),
    ],
)
def test_a_choice_that_does_not_exist_is_refused(plant, modes, said):
    with pytest.raises(InputError, match=said):
        design("per-mode", plant, {"modes": modes})


def test_an_estimator_speaks_in_the_modes_that_hold_its_words(plant):
    """At rest the linear filter, in motion the extended one: each as it is alone."""
    chosen = standard_estimator("ekf,kalman@stick", plant, 2e-3)
    alone = [standard_estimator(name, plant, 2e-3) for name in ("ekf", "kalman")]
    names = [mode.name for mode in chosen.finder.sampled.hybrid.modes]
    assert all(chosen.speaks[k] == ("stick" in name) for k, name in enumerate(names))

    places = np.concatenate([np.full(20, 0.1), 0.1 + 0.5 * 2e-3 * np.arange(60)])
    pressure = float(at(plant, 0.1).pick(["chamber_a.pressure_pa"])[0])
    command, spoke = np.array([4.95]), []
    begun = [each.start(np.array([0.1, pressure, pressure])) for each in (chosen, *alone)]
    for place in places:
        seen = np.array([place, pressure, pressure])
        begun = [
            each.update(last, command, seen)
            for each, last in zip((chosen, *alone), begun, strict=True)
        ]
        together, *singly = begun
        k = int(together.notes["speaks"])
        spoke.append(k)
        assert together.pick([POSITION]) == pytest.approx(singly[k].pick([POSITION]))
        assert together.names == begun[0].names

    assert spoke[10] == 1 and spoke[-1] == 0


@pytest.mark.parametrize(
    ("choice", "said"),
    [
        ("ekf,ukf@nowhere", "is for no mode"),
        ("ekf,ukf", "is for no mode"),
        ("ekf,ukf@stik", "did you mean 'ukf@stick'"),
        ("ekf,ukf@stick midle", "did you mean 'ukf@stick middle'"),
        ("ekf@stick", "comes first"),
        ("ekf,unscented@stick", "no estimator unscented"),
    ],
)
def test_a_choice_of_estimators_that_cannot_be_is_refused(plant, choice, said):
    with pytest.raises(UnknownNameError, match=said):
        standard_estimator(choice, plant, 2e-3)


def test_a_mixed_design_behind_mixed_estimators_reaches_the_goal_of_a_step(mixed, plant):
    found = check(plant, {"mixed": mixed.controller}, ["ekf,kalman@slide"], ["step"])

    assert found.rows[0].reached
