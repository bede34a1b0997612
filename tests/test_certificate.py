"""Stability across modes: textbook pairs of loops, and the loops of the designs."""

from unittest.mock import patch

import numpy as np
import pytest
from crr_loops import ARM, TURNS
from scipy.linalg import expm

from controllers import CONTROLLERS
from controllers.certificate import (
    Certificate,
    certificate,
    common_function,
    dwell_samples,
    share_a_function,
)
from controllers.margins import closed, integral_of, loops, unforeseen_s
from controllers.regulator import RegulatorSpec, regulator
from controllers.scheduled import driven_modes
from linearize.standard import axis_modes, standard_modes
from studies.design_text import certificate_text
from workbench.plants.crr_arm import crr_arm
from workbench.plants.servo_drive import servo_drive

DT = 0.01
ROUND, FLAT = np.array([[-0.1, 1.0], [-10.0, -0.1]]), np.array([[-0.1, 10.0], [-1.0, -0.1]])
"""Two slow spirals whose switching diverges: Branicky 1998, IEEE Trans. Autom. Control 43, 475."""


def spirals():
    return expm(ROUND * DT), expm(FLAT * DT)


@pytest.fixture(scope="module")
def hybrid():
    return standard_modes(servo_drive())


def test_loops_that_commute_have_a_common_function_that_shrinks_in_each():
    """Narendra and Balakrishnan 1994: stable matrices that commute share a Lyapunov function."""
    one = np.array([[0.9, 0.2], [0.0, 0.8]])
    both = [one, one @ one + 0.05 * np.eye(2)]
    found = certificate({"one": (both[0],), "other": (both[1],)}, DT)

    assert found.dwell_s == 0.0 and found.breaking == ()
    assert np.linalg.eigvalsh(found.common)[0] > 0.0
    for A in both:
        shrunk = found.common - A.T @ found.common @ A
        assert np.linalg.eigvalsh(shrunk)[0] > 0.0
    x, kept = np.array([1.0, -2.0]), np.exp(-2.0 * found.decay_per_s * DT)
    assert (both[0] @ x) @ found.common @ (both[0] @ x) <= 1.0001 * kept * x @ found.common @ x


def test_two_spirals_break_it_and_need_a_dwell_time():
    one, other = spirals()
    found = certificate({"round": (one,), "flat": (other,)}, DT)

    assert found.common is None and found.decay_per_s == 0.0
    assert found.breaking == (("round", "flat"),)
    assert found.dwell_s > 1.0
    said = certificate_text(found)
    assert "was found for the 2 modes above, not even for these pairs:\n  round with flat\n" in said
    assert "certified is a dwell time of" in said and "any switching" not in said


def test_no_switching_that_keeps_the_dwell_time_grows():
    one, other = spirals()
    samples = dwell_samples([one, other])
    turn = np.linalg.matrix_power(one, samples) @ np.linalg.matrix_power(other, samples)

    assert np.abs(np.linalg.eigvals(turn)).max() < 1.0
    fast = max(
        np.abs(
            np.linalg.eigvals(np.linalg.matrix_power(one, n) @ np.linalg.matrix_power(other, n))
        ).max()
        for n in range(1, 100)
    )
    assert fast > 1.0


def test_the_function_of_one_loop_is_found_by_scipy_too():
    from scipy.linalg import solve_discrete_lyapunov

    A = spirals()[0]
    found = common_function([A])

    assert np.linalg.eigvalsh(solve_discrete_lyapunov(A.T, np.eye(2)))[0] > 0.0
    assert np.linalg.eigvalsh(found - A.T @ found @ A)[0] > 0.0


@pytest.mark.parametrize(("spread", "shared"), [(0.5, True), (12.0, False)])
def test_of_many_loops_a_few_tell_whether_all_share_a_function(spread, shared):
    """A scatter of spirals, narrow enough for a common function and too wide for one."""
    rates = np.random.default_rng(3).uniform(1.0, 1.0 + spread, (30, 2))
    many = [expm(np.array([[-0.5, a], [-b, -0.5]]) * DT) for a, b in rates]

    assert share_a_function(many) == (common_function(many) is not None) == shared
    for wild in ([*many, 1.01 * np.eye(2)], [1.01 * np.eye(2), *many]):
        assert not share_a_function(wild) and common_function(wild) is None


def test_with_an_unstable_mode_nothing_is_certified_and_it_is_named():
    found = certificate({"calm": (0.5 * np.eye(2),), "wild": (1.01 * np.eye(2),)}, DT)

    assert found.unstable == ("wild",) and found.common is None and found.dwell_s is None
    assert certificate_text(found) == (
        "no certificate across modes: unstable by themselves are wild"
    )


@pytest.mark.parametrize("name", ["lq", "mpc"])
def test_lq_and_mpc_are_certified_under_any_switching_and_mixing_of_their_modes(hybrid, name):
    method = CONTROLLERS[name]
    made = method.design(hybrid, method.spec())
    found = certificate(loops(hybrid, made.laws, made.sample_time_s), made.sample_time_s)

    assert found.common is not None and len(found.modes) == 6
    assert found.decay_per_s > 0.05
    assert "one quadratic Lyapunov function" in certificate_text(found)


def test_gains_that_must_not_be_mixed_are_told_from_switching_that_may_be():
    """Both modes shrink under their own law; the other law that is mixed in does not in one."""
    calm, wild = 0.5 * np.eye(2), np.diag([1.2, 0.5])
    found = certificate({"one": (calm, calm), "other": (0.6 * np.eye(2), wild)}, DT)

    assert found.common is not None and not found.mixing
    assert found.breaking == (("one", "other"),)
    said = certificate_text(found)
    assert "each mode with its own gains; for every mix of them none was found" in said
    assert said.splitlines()[1] == "  one with other"


PAIRS = tuple((f"mode {one}", f"mode {other}") for one in range(4) for other in range(one + 1, 4))


@pytest.mark.parametrize(
    ("breaking", "any_switching", "said"),
    [
        (PAIRS, False, "  mode 0 with mode 1; mode 2; mode 3\n  mode 1 with mode 2; mode 3\n"),
        (PAIRS, False, "\ncertified is a dwell time of 4 ms in each mode, each with its own"),
        (
            (),
            False,
            "no common quadratic Lyapunov function was found for the 4 modes above, though",
        ),
        ((), True, "certified is any switching between the modes, from sample to sample too"),
    ],
)
def test_what_is_certified_is_told_with_every_pair_and_no_more_than_was_found(
    breaking, any_switching, said
):
    modes = tuple(f"mode {k}" for k in range(4))
    found = Certificate(modes, (), None, False, 0.0, breaking, 4e-3, any_switching)

    assert said in certificate_text(found)


def test_a_dwell_time_of_one_sample_is_any_switching():
    """Loops that commute, seen without their common function."""
    calm, calmer = (0.5 * np.eye(2),), (0.4 * np.eye(2),)
    with patch("controllers.certificate.common_function", return_value=None):
        found = certificate({"calm": calm, "calmer": calmer}, DT)

    assert found.dwell_s == pytest.approx(DT) and found.any_switching
    assert not certificate(
        dict(zip("ab", ((each,) for each in spirals()), strict=True)), DT
    ).any_switching


def test_the_arms_modes_are_certified_with_their_own_gains_behind_its_sensors():
    """1 ms of the sensors is in the loops."""
    hybrid = axis_modes(crr_arm())
    made = regulator(hybrid, RegulatorSpec(tolerable=ARM, **TURNS))
    delay_s = unforeseen_s(hybrid.plant)
    found = certificate(loops(hybrid, made.laws, 1e-3, delay_s), 1e-3)

    assert delay_s == pytest.approx(1e-3)
    assert found.common is not None and found.unstable == ()
    assert len(found.common) == 6


def test_a_loop_under_mixed_gains_lies_between_the_loops_of_each(hybrid):
    """What is certified of the corners holds inside, since a loop is linear in its law."""
    made = CONTROLLERS["lq"].design(hybrid, CONTROLLERS["lq"].spec())
    mode, laws = driven_modes(hybrid)[0][1], made.laws.forward
    mixed = made.gains.forward
    feedback = 0.3 * mixed[1].feedback + 0.7 * mixed[2].feedback
    integral = 0.3 * mixed[1].integral + 0.7 * mixed[2].integral
    between = closed(mode, integral_of(feedback, integral, 2e-3), 2e-3)
    corners = [closed(mode, laws[k], 2e-3) for k in (1, 2)]

    assert np.allclose(between, 0.3 * corners[0] + 0.7 * corners[1])
