"""Study of the number of modes: what it designs on, and claims that say what the numbers say."""

import pytest

from studies.mode_count_study import COMPARED, HALF, JUDGED, PLACES, Parted, outcome, parted_modes
from studies.mode_count_study import worked as measured
from workbench.plants.servo_drive import servo_drive


def rows(**single):
    """Every figure 1, and with a single part so many times as large for a design."""
    return {
        (name, places): [dict.fromkeys(JUDGED, single.get(name, 1.0) if places == 1 else 1.0)]
        for name in COMPARED
        for places in PLACES
    }


@pytest.mark.parametrize("places", [1, 3])
def test_a_part_has_nine_modes(places):
    hybrid = parted_modes(servo_drive(), places)

    assert len(hybrid.modes) == 9 * places


def test_claims_hold_where_more_parts_bring_nothing_and_fail_where_they_do():
    assert all(claim.holds for claim in outcome(rows()).claims)
    said = outcome(rows(mpc=1.5)).claims
    assert [claim.holds for claim in said] == [True, True, False, False]


def test_a_design_on_one_part_follows_a_wide_sine():
    """Within 2 mm of 130 mm, which is a claim of no yardstick but tells a loop from a lost one."""
    assert measured(Parted("lq", 1, 0))["found"][HALF] < 2.0
