"""Costs of plans in lanes of the vector unit are those of CasADi's own functions."""

import pickle

import numpy as np
import pytest

from controllers.design_file import design
from workbench.plants.gearbox import gearbox

VENTED = np.array([1.013e5, 1.013e5, 0.0, 0.0])


@pytest.fixture(scope="module")
def made():
    return design("hybrid-mpc", gearbox()).controller


def test_pairs_cost_the_same_in_lanes_and_by_casadi(made):
    """To the last bit; on the way the piston meets its end and Neutral."""
    ranking, rng = made.search.prediction.ranked, np.random.default_rng(4)
    rows = 2 * made.spec.horizon
    way, *moves = (5e-3 * rng.standard_normal(s) for s in (rows, *[(ranking.plans, rows)] * 2))
    for asked in (np.array([12e-3, 1.0, 1.0]), np.array([0.0, 1.0, 0.0])):
        found = ranking.costs(way, moves, asked, VENTED)

        expected = ranking._by_casadi(way, *(each.ravel() for each in moves), asked, VENTED)[0]
        assert len(np.unique(found)) > ranking.plans
        np.testing.assert_array_equal(found, expected.ravel())


def test_plans_cost_the_same_in_lanes_and_one_by_one(made):
    """To the last bit, however many they are."""
    judging, rng = made.search.prediction.judged, np.random.default_rng(3)
    shares = rng.uniform(0.0, 1.0, (11, made.spec.horizon, 2))
    query = np.array([12e-3, 1.0, 1.0])

    found = judging.costs(VENTED, shares, query)

    assert len(np.unique(found)) == 11
    np.testing.assert_array_equal(found, judging._one_by_one(VENTED, shares, query))
    np.testing.assert_array_equal(found[:3], judging.costs(VENTED, shares[:3], query))


def test_costs_travel_to_another_process(made):
    judging = made.search.prediction.judged
    shares, query = np.full((2, made.spec.horizon, 2), 0.5), np.array([12e-3, 1.0, 1.0])
    expected = judging.costs(VENTED, shares, query)

    found = pickle.loads(pickle.dumps(judging)).costs(VENTED, shares, query)

    np.testing.assert_array_equal(found, expected)
