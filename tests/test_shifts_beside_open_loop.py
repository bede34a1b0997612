"""A check of shifts shows the open loop that its bounds come from, in table and figure."""

from dataclasses import replace
from math import isinf

import pytest

from studies.checking import styled_figures
from studies.shift_check import BOUNDS, HEAD, OPEN_LOOP, Drive, check_shifts
from workbench.plants.gearbox import COMMANDS, gearbox

POSITION = "main_piston.position_m"


@pytest.fixture(scope="module")
def found():
    """A design that is the open loop itself, and one that does nothing."""
    return check_shifts(gearbox(), {"same": Drive((1, 0)), "idle": Drive((0, 0))}, ["n-h"])


def test_time_and_impact_of_the_open_loop_stand_beside_the_bounds_that_follow_from_them(found):
    same, idle = found.rows
    head, first, _, told = found.text.splitlines()

    assert (same.open_settling_s, same.open_impact_m_s) == (same.settling_s, same.impact_m_s)
    assert (idle.open_settling_s, idle.open_impact_m_s) == (same.settling_s, same.impact_m_s)
    assert same.longest_s == pytest.approx(1.25 * same.open_settling_s)
    assert same.hardest_m_s == pytest.approx(0.5 * same.open_impact_m_s)
    assert all(name in head for name in ("bound of time ms", "open loop ms", "open loop m/s"))
    assert len({*HEAD}) == len(HEAD) == len(first.split()) - 2  # two wall times follow
    assert told == BOUNDS and "1.25 times the time of the open loop" in told


def test_a_shift_that_takes_exactly_as_long_as_it_may_is_made_in_spite_of_rounding(found):
    """1.25 times 44 samples are less than 55 of them in the last digit."""
    same, _ = found.rows
    on = replace(same, settling_s=55 * 2.5e-4, longest_s=1.25 * (44 * 2.5e-4), impact_m_s=0.0)

    assert on.settling_s > on.longest_s and on.reached
    assert not replace(on, settling_s=56 * 2.5e-4).reached


def test_a_shift_that_never_ends_is_not_made_even_if_the_open_loop_does_not_make_it():
    """A piston too heavy for its supply: whoever sent nothing had been told that it is reached."""
    heavy = gearbox().with_values({"main_piston.mass_kg": 20.0})
    (row,) = check_shifts(heavy, {"idle": Drive((0, 0))}, ["n-l"]).rows

    assert isinf(row.settling_s) and isinf(row.longest_s)
    assert row.impact_m_s == 0.0 and not row.reached


def test_the_open_loop_is_drawn_once_thin_and_grey_with_a_word_in_the_legend(found):
    place, first, _ = styled_figures(found)["shift_n-h"].axes
    (line,) = [each for each in place.lines if each.get_label() == "open loop"]
    recording = found.records[1].recording

    assert line.get_color() == "0.6" and line.get_linewidth() < place.lines[-1].get_linewidth()
    assert line.get_ydata() == pytest.approx(1e3 * found.records[0].recording[POSITION])
    assert line.get_ydata() == pytest.approx(1e3 * recording[OPEN_LOOP + POSITION])
    assert recording[OPEN_LOOP + COMMANDS[0]].min() == 1.0 and first.lines[0].get_ydata()[0] == 1.0
    legend = place.figure.legends[0]
    assert "open loop" in [text.get_text() for text in legend.get_texts()]
