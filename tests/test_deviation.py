"""The deviation measure of paper 003, by hand and on shifts of the gearbox."""

from dataclasses import replace

import numpy as np
import pytest
from gearbox_shifts import ALL_SHIFTS, run

from workbench.comparison.course import course_of
from workbench.comparison.deviation import deviation, shift_deviations
from workbench.comparison.shifts import begins_energised
from workbench.plants.gearbox import gearbox


def test_the_measure_is_the_mean_absolute_error_over_the_range():
    """|e| = 0, 1, 0, 1: three trapezoids of 1/2 over three steps; range 2: 1/4."""
    measured, simulated = np.array([0.0, 1.0, 2.0, 1.0]), np.array([0.0, 0.0, 2.0, 2.0])

    assert deviation(measured, simulated, 0.1) == pytest.approx(0.25)


def test_errors_of_both_signs_do_not_cancel():
    """e = +1, -1, +1: |e| is 1 throughout, the range 4; as printed the integral would be 0."""
    measured, simulated = np.array([1.0, 2.0, 5.0]), np.array([0.0, 3.0, 4.0])

    assert deviation(measured, simulated, 1e-3) == pytest.approx(0.25)


def test_a_missing_sample_takes_its_two_intervals_away():
    """Left is the last interval with |e| = 1 and 3, mean 2, over the range 10."""
    measured = np.array([0.0, np.nan, 9.0, 10.0])
    simulated = np.array([0.0, 5.0, 8.0, 7.0])

    assert deviation(measured, simulated, 0.5) == pytest.approx(0.2)


def test_a_slow_sensor_has_a_deviation_between_its_own_samples():
    """|e| = 0, 2, 4 at 0, 3 and 6: means 1 and 3 over three samples each, over the range 8."""
    measured, simulated = np.full(8, np.nan), np.arange(8.0)
    measured[[0, 3, 6]] = [0.0, 5.0, 2.0]
    simulated[[0, 3, 6]] = [0.0, 3.0, -2.0]

    assert deviation(measured, simulated, 0.1) == pytest.approx(2.0 / 5.0)


def test_an_uneven_slow_sensor_counts_each_interval_by_its_length():
    """|e| = 1, 1, 4 at 0, 2 and 5: means 1 over two samples and 2.5 over three; range 10."""
    measured = np.array([0.0, np.nan, 10.0, np.nan, np.nan, 5.0])
    simulated = np.array([1.0, 0.0, 9.0, 0.0, 0.0, 9.0])

    assert deviation(measured, simulated, 1e-3) == pytest.approx((2.0 + 7.5) / 5.0 / 10.0)


def test_a_lost_sample_of_a_slow_sensor_takes_the_time_around_it_away():
    """Recorded every two samples, that at 4 lost: left are 0 to 2 and 6 to 8, with |e| 1 and 3."""
    measured, simulated = np.full(9, np.nan), np.zeros(9)
    measured[[0, 2, 6, 8]] = [1.0, -1.0, 3.0, 3.0]

    assert deviation(measured, simulated, 0.1) == pytest.approx(2.0 / 4.0)
    assert deviation(measured, simulated, 0.1, usual=4) == pytest.approx(2.0 / 4.0)
    assert deviation(measured[2:7], simulated[2:7], 0.1, usual=4) == pytest.approx(2.0 / 4.0)
    assert np.isnan(deviation(measured[2:7], simulated[2:7], 0.1, usual=2))


def test_what_does_not_vary_has_no_deviation():
    assert np.isnan(deviation(np.ones(5), np.zeros(5), 0.1))
    assert np.isnan(deviation(np.full(5, np.nan), np.zeros(5), 0.1))


@pytest.fixture(scope="module")
def recorded():
    """All four shifts, as the plant itself makes them, from 50 ms before the first."""
    return run(gearbox().lean(), (((0, 0), 0.05), *ALL_SHIFTS), 2e-4)


@pytest.fixture(scope="module")
def table(recorded):
    return shift_deviations(course_of(gearbox(), recorded))


def test_the_table_has_the_four_cases_and_no_deviation_of_the_plant_from_itself(table):
    assert [shift.case for shift in table] == ["N to H", "H to N", "N to L", "L to N"]
    starts = np.cumsum([0.05, *(duration for _, duration in ALL_SHIFTS[:-1])])[::2]
    assert [shift.start_s for shift in table] == pytest.approx(starts, abs=3e-4)
    for shift in table:
        assert 0.01 < shift.end_s - shift.start_s < 0.06
        assert max(shift.deviations.values()) < 5e-3


@pytest.mark.parametrize("every", [1, 10], ids=["every sample", "a slow sensor"])
def test_a_constant_error_of_a_pressure_is_its_share_of_the_range(recorded, table, every):
    """A tenth of the range, added from the change of the commands on."""
    name, shift = "chamber_1.pressure_pa", table[0]
    first, last = (round(t / recorded.sample_time_s) for t in (shift.start_s, shift.end_s))
    span = np.ptp(recorded[name][first : last + 1])
    lifted = recorded[name] + 0.1 * span * (np.arange(len(recorded)) >= first)
    taken = np.where(np.arange(len(recorded)) % every == 0, lifted, np.nan)
    short = replace(recorded, channels={**recorded.channels, name: taken}).part(0, last + 200)

    (found,) = shift_deviations(course_of(gearbox(), short))

    assert found.case == "N to H"
    assert found.deviations[name] == pytest.approx(0.1, abs=2e-3)


def test_a_shift_in_which_a_slow_sensor_lost_every_other_sample_has_no_deviation(recorded, table):
    """Elsewhere it gives every 10th; that its gaps are alike within the shift makes none usual."""
    name, shift = "chamber_1.pressure_pa", table[0]
    first, last = (round(t / recorded.sample_time_s) for t in (shift.start_s, shift.end_s))
    k = np.arange(len(recorded))
    every = np.where((k >= first) & (k <= last), 20, 10)
    taken = np.where(k % every == 0, recorded[name], np.nan)
    slow = replace(recorded, channels={**recorded.channels, name: taken})

    found = shift_deviations(course_of(gearbox(), slow))

    assert np.isnan(found[0].deviations[name])
    assert found[1].deviations[name] < 5e-3


def test_a_shift_that_began_before_the_recording_is_not_counted_and_that_is_said(recorded):
    """What the armature did before is not known."""
    late = course_of(gearbox(), recorded.part(260, 500))

    assert shift_deviations(late) == () and begins_energised(late)
    assert not begins_energised(course_of(gearbox(), recorded.part(0, 500)))
    cut = replace(recorded.part(0, 500), starts=(0, 260))
    assert shift_deviations(course_of(gearbox(), cut)) == ()
    assert begins_energised(course_of(gearbox(), cut))
