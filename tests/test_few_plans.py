"""What hybrid MPC judges at a sample that has time for few plans only."""

from dataclasses import replace

import numpy as np
import pytest

from controllers.design_file import design
from controllers.launches import RELEASED, pulse_pairs
from controllers.plan_search import KEPT, PlanSearch
from controllers.shift_prediction import query
from linearize.shifting import STATES
from workbench.plants.gearbox import gearbox

HOLD, N, END_M = 4, 26, 12e-3


@pytest.fixture(scope="module")
def made():
    return design("hybrid-mpc", gearbox()).controller


@pytest.mark.parametrize("turn", [0, 1])
@pytest.mark.parametrize("judged", [8, 10])
def test_no_switch_and_what_is_suggested_are_judged_however_few_plans_are(
    made, monkeypatch, judged, turn
):
    """Also where the sample before hands on as many plans as it may."""
    x, asked_for, asked = np.zeros(4), query(0.0, -END_M, -END_M), []
    x[:2], x[STATES.index("main_piston.position_m")] = 1.013e5, -END_M
    search, full = replace(made.search, judged=judged), made._full_drive(0.0, RELEASED)
    before = pulse_pairs(HOLD, N)[:KEPT]

    def costs(self, x, query, sent, plans):
        asked.extend(plans)
        return np.arange(float(len(plans)))

    monkeypatch.setattr(PlanSearch, "costs", costs)
    best, _ = search.best(x, asked_for, RELEASED, before, full, turn)

    np.testing.assert_array_equal(best[0], before[0])
    for plan in (search.held(RELEASED), full):
        assert any(np.array_equal(plan, each) for each in asked)
    assert len(asked) == (1 + turn) * (judged + 1)
