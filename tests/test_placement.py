"""Modes placed where a recording goes predict another recording well, and better than one model."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from manoeuvres import gone_through

from linearize.hybrid_simulation import sampled_hybrid
from linearize.placement import growing_modes, placed_modes
from linearize.prediction import error_along, fitted_single, prediction_of, single_of
from linearize.standard import COMMAND, POSITION, VELOCITY, standard_modes
from linearize.visits import joined, windows
from workbench.plants.servo_drive import STROKE_M, servo_drive

STEP_S = 1e-3
AS_MANY = 27  # as the standard modes are


@pytest.fixture(scope="module")
def hybrid():
    return standard_modes(servo_drive())


@pytest.fixture(scope="module")
def seen():
    return gone_through("train")


@pytest.fixture(scope="module")
def unseen():
    """Windows of 50 ms in the recording that no placement saw."""
    return windows(gone_through("validation"))


@pytest.fixture(scope="module")
def placed(hybrid, seen):
    return placed_modes(hybrid, seen, AS_MANY)


@pytest.fixture(scope="module")
def single(hybrid, unseen):
    """The best single linear model there is: fitted to the very windows it is judged on."""
    return fitted_single(hybrid, unseen)


def error(modes, unseen):
    return prediction_of(modes, unseen).total


def test_windows_are_of_50_ms_in_free_motion_and_end_where_the_manoeuvre_does(seen, unseen):
    """In the training recording the open loop drifts to a stop; those windows do not count."""
    assert unseen.states.shape[:2] == (4, 51)
    assert unseen.commands.shape[:2] == (1, 51)
    assert windows(seen).states[0].max() < STROKE_M
    assert 0.85 < seen.free.mean() < 0.95


def test_commands_are_those_behind_the_dead_zone(unseen):
    """Half of the recording rests: there the valve is shut, not merely within its dead zone."""
    shut = np.isclose(unseen.commands, 4.95, atol=0.03)

    assert 0.2 < shut.mean() < 0.9


def test_windows_do_not_reach_across_a_gap(seen):
    gap = replace(seen, starts=(0, 30))

    assert windows(gap, 0.05, 0.02).states[:, 0, 0].tolist() == seen.states[:, 30].tolist()


def test_a_manoeuvre_shorter_than_the_horizon_is_an_error(seen):
    with pytest.raises(ValueError, match=r"no window of 20 s in free motion"):
        windows(seen, horizon_s=20.0)


def test_manoeuvres_of_several_sample_times_are_each_judged_at_their_own(hybrid):
    fine = gone_through("validation")
    rows = {name: getattr(fine, name)[..., ::5] for name in ("states", "commands", "free")}
    coarse = replace(fine, sample_time_s=5e-3, touching=fine.touching[::5], **rows)
    alone = [error_along(hybrid, [each]) for each in (fine, coarse)]
    both = error_along(hybrid, [fine, coarse, fine])

    assert both == pytest.approx(error_along(hybrid, [coarse, fine, fine]))
    assert min(alone) <= both <= max(alone)


def test_a_horizon_shorter_than_a_sample_is_an_error(seen):
    with pytest.raises(ValueError, match=r"no window of 0\.05 s: samples are 0\.2 s apart"):
        windows(replace(seen, sample_time_s=0.2))


def test_placed_modes_err_a_third_of_the_best_single_linear_model_over_50_ms(
    placed, single, unseen
):
    """0.0228 against 0.0757, RMS over states in units of their scale: 0.30."""
    share = error(sampled_hybrid(placed, STEP_S), unseen) / error(single, unseen)

    assert share < 0.31


def test_the_fitted_single_model_beats_every_mode_taken_alone(hybrid, placed, single, unseen):
    alone = [
        error(single_of(each, mode, STEP_S), unseen)
        for each in (hybrid, placed)
        for mode in each.modes
    ]

    assert error(single, unseen) < 0.5 * np.nanmin(alone)


def test_the_fitted_single_model_finds_a_linear_plant_again(hybrid, unseen):
    linear = single_of(hybrid, hybrid["charge a slide + middle"], STEP_S)
    run = linear.run(unseen.states[:, 0], unseen.commands)
    made = replace(unseen, states=run.states)

    assert error(fitted_single(hybrid, made), made) < 1e-6


def test_placed_modes_err_half_as_much_as_as_many_standard_ones(hybrid, placed, unseen):
    """0.0228 against 0.0480."""
    pair = [error(sampled_hybrid(each, STEP_S), unseen) for each in (placed, hybrid)]

    assert pair[0] < 0.5 * pair[1]


def test_the_error_falls_with_the_number_of_modes(hybrid, seen):
    own = windows(seen)
    grown = list(islice(growing_modes(hybrid, seen), 25))
    few, some, many = (error(sampled_hybrid(grown[n - 3], STEP_S), own) for n in (3, 10, 27))

    assert [len(each.modes) for each in grown] == list(range(3, 28))
    assert many < 0.6 * some < 0.36 * few


def test_exactly_one_placed_mode_is_active_anywhere(placed):
    rng = np.random.default_rng(3)
    for _ in range(100):
        signals = {
            COMMAND: rng.uniform(0.0, 10.0),
            VELOCITY: rng.choice([-0.5, -0.01, 0.0, 0.01, 0.5]),
            POSITION: rng.uniform(0.0, STROKE_M),
            "chamber_a.pressure_pa": rng.uniform(1e5, 7e5),
            "chamber_b.pressure_pa": rng.uniform(1e5, 7e5),
        }

        assert [mode.holds(signals) for mode in placed.modes].count(True) == 1
        assert ("stick" in placed.active(signals).name) == (signals[VELOCITY] == 0.0)


def test_placed_modes_have_names_of_their_own_and_points_in_their_boxes(placed):
    assert len({mode.name for mode in placed.modes}) == AS_MANY
    for mode in placed.modes:
        names = (*mode.state_names, *mode.command_names)
        at = dict(zip(names, (*mode.state, *mode.command), strict=True))
        for name, region in mode.box.items():
            assert region.contains(region.point)
            assert at.get(name, region.point) == region.point


@pytest.mark.parametrize(("number", "expected"), [(2, "at least 3"), (10_000, "at most ")])
def test_a_number_of_modes_that_cannot_be_had_is_an_error(hybrid, seen, number, expected):
    short = replace(
        seen,
        states=seen.states[:, 400:2400],
        commands=seen.commands[:, 400:2400],
        touching=seen.touching[400:2400],
        free=seen.free[400:2400],
    )

    with pytest.raises(ValueError, match=f"{number} modes asked for, expected {expected}"):
        placed_modes(hybrid, short, number)


def test_what_a_manoeuvre_never_visits_keeps_the_mode_that_it_has(hybrid, seen):
    """A manoeuvre without rest: the sticking mode stays, the others are placed."""
    moving = replace(seen, free=seen.free & (np.abs(seen.states[1]) > 2e-3))
    placed = placed_modes(hybrid, moving, 10)
    (stick,) = (mode for mode in placed.modes if "stick" in mode.name)

    assert pytest.approx(hybrid["charge b stick near a"].A) == stick.A
    assert [*stick.box] == [VELOCITY]


def test_manoeuvres_are_joined_with_a_gap_between_them(seen):
    both = joined([seen, seen])
    n = seen.states.shape[1]

    assert both.starts == (0, n)
    assert windows(both).states.shape[2] == 2 * windows(seen).states.shape[2]
