"""Laws that no catalogue has, in recordings of the independent truth: right term, right balance.

What is hidden is F = -c v |v| on the slide, F = c y^2 around the middle of the stroke, a leak of
chamber a that opens with the speed of the slide, and a constant flow into chamber b (see
``studies/truth/laws``).  A gas that leaves through a hole under its pressure goes as |v| p.
"""

from functools import cache

import pytest

from studies.hidden_benches import SERVO_DRIVE
from studies.hidden_effects import recordings
from studies.truth.cases import read_cases
from workbench.diagnosis.diagnose import _where_told
from workbench.diagnosis.law import empirical_law
from workbench.diagnosis.scan import scan_catalogue
from workbench.diagnosis.where import locate
from workbench.fitting.problem import pose

CASES = read_cases()
TERMS = {
    "quadratic_drag": "law[v|v|]@slide",
    "sagging_cable": "law[(x - mid)^2]@slide",
    "sliding_leak": "law[|v| p]@chamber_a",
    "purge_flow": "law[constant]@chamber_b",
}
DRAG = "law[v|v|]@slide.quadratic_n_s2_m2"


@cache
def made():
    """Recordings of all cases in one batch, which takes no longer than one case."""
    hidden = (*TERMS, "magnetic_catch", None)
    return dict(zip(hidden, recordings([CASES[name, 1] for name in hidden]), strict=True))


def law_in(hidden):
    train, held_out = made()[hidden]
    problem = pose(SERVO_DRIVE.user_rig(CASES[hidden, 1]), [train], [held_out])
    where = locate(problem, [train])
    law = empirical_law(problem, scan_catalogue(problem), where=where)
    if law:
        assert _where_told(problem, [train], where, law).balance in law.balances
    return law


@pytest.mark.slow
@pytest.mark.parametrize("hidden", TERMS)
def test_a_law_outside_the_catalogue_is_its_own_term_in_its_own_balance(hidden):
    law = law_in(hidden)

    assert {*law.balances} <= {*SERVO_DRIVE.laws[hidden]}
    assert law.steps[0].candidate.name == TERMS[hidden]
    assert law.drop_validation > 0.2
    if hidden == "quadratic_drag":
        assert law.terms[DRAG].value == pytest.approx(CASES[hidden, 1].size, rel=0.25)


@pytest.mark.slow
def test_a_magnet_at_one_place_is_three_waves_of_the_place():
    """No single term is like it: the terms are read off the smoothed missing force."""
    law = law_in("magnetic_catch")

    assert law.balances == ("slide.momentum",)
    assert [step.candidate.cause.drivers[0][-4:] for step in law.steps] == 3 * ["x/L)"]
    assert law.drop_train > 0.6 and law.drop_validation > 0.6


@pytest.mark.slow
def test_where_the_truth_has_no_law_none_is_found():
    assert law_in(None) is None
