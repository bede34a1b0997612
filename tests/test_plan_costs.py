"""Costs of plans in lanes of the vector unit are those of CasADi's own functions."""

import pickle

import numpy as np
import pytest
from test_ensemble import needs_lanes

from controllers.design_file import design
from controllers.shift_prediction import query
from workbench.plants.gearbox import gearbox

MOVING = np.array([6e5, 3e5, 9e-3, 1.0])
ASKED = [
    query(12e-3, 0.0, 9e-3),
    query(12e-3, 0.0, 9e-3, met=True),
    query(-12e-3, 0.0, 9e-3),
    query(0.0, 12e-3, 9e-3),
    query(0.0, -12e-3, 9e-3),
]


@pytest.fixture(scope="module")
def made():
    return design("hybrid-mpc", gearbox()).controller


@pytest.fixture(scope="module")
def shares(made):
    """Eleven plans that hold a valve on or off for a while, as shares."""
    rng, horizon = np.random.default_rng(3), made.spec.horizon
    first, last = np.sort(rng.integers(0, horizon, (2, 11, 2, 1)), axis=0)
    ahead = np.arange(horizon)
    held = ((ahead >= first) & (ahead <= last)).transpose(0, 2, 1).astype(float)
    return np.stack([held, 1.0 - held], axis=3).reshape(11, horizon, 4)


@needs_lanes
def test_with_a_compiler_plans_are_costed_in_lanes(made):
    prediction = made.search.prediction

    assert prediction.ranking._lanes is not None
    assert prediction.judging._lanes is not None


@pytest.mark.parametrize("asked", ASKED)
def test_pairs_cost_the_same_in_lanes_and_by_casadi(made, asked):
    """To the last bit; on the way the piston meets its end and Neutral."""
    ranking, rng = made.search.prediction.ranking, np.random.default_rng(4)
    rows = 2 * made.spec.horizon
    way, *moves = (5e-3 * rng.standard_normal(s) for s in (rows, *[(ranking.plans, rows)] * 2))
    found = ranking.costs(way, moves, asked)

    expected = ranking._by_casadi(way, *(each.ravel() for each in moves), asked)[0]
    assert len(np.unique(found)) > ranking.plans
    np.testing.assert_array_equal(found, expected.ravel())


@pytest.mark.parametrize("asked", ASKED)
@pytest.mark.parametrize("number", [1, 3, 4, 5, 11])
def test_plans_cost_the_same_in_lanes_and_one_by_one(made, shares, asked, number):
    """To the last bit, however many they are, through ends, bounces and Neutral."""
    judging = made.search.prediction.judging
    found = judging.costs(MOVING, shares[:number], asked)

    begun = np.array([*MOVING, asked[3], 0.0])
    np.testing.assert_array_equal(found, judging._one_by_one(begun, shares[:number], asked))
    np.testing.assert_array_equal(found, judging.costs(MOVING, shares, asked)[:number])


def test_a_plan_costs_the_sum_of_its_samples_and_what_is_left(made, shares):
    """Sample by sample: every weight is that of its sample."""
    judging, asked = made.search.prediction.judging, ASKED[0]
    plan, memory = shares[4], np.array([*MOVING, asked[3], 0.0])
    for pair, weight in zip(plan, judging.weights, strict=True):
        memory = judging.sample(memory, pair, asked, weight).full().ravel()
    (found,) = judging.costs(MOVING, plan[None], asked)

    assert found == float(judging.last(memory, asked))
    assert len(np.unique(judging.weights)) == made.spec.horizon


def test_what_has_another_shape_is_refused(made, shares):
    """C would read on beyond the end of it."""
    prediction, asked = made.search.prediction, ASKED[0]
    for x, rows, q in (
        (MOVING[:3], shares, asked),
        (MOVING, shares[:, :20], asked),
        (MOVING, shares[:, :, :2], asked),
        (MOVING, shares[:0], asked),
        (MOVING, shares, asked[:3]),
    ):
        with pytest.raises(ValueError, match="plans are costed from"):
            prediction.judging.costs(x, rows, q)
    way, moves = np.zeros(52), [np.zeros((4, 52))] * 2
    with pytest.raises(ValueError, match="plans are costed from"):
        prediction.ranking.costs(way, moves, asked)


def test_costs_travel_to_another_process(made, shares):
    judging = made.search.prediction.judging
    expected = judging.costs(MOVING, shares, ASKED[0])

    found = pickle.loads(pickle.dumps(judging)).costs(MOVING, shares, ASKED[0])

    np.testing.assert_array_equal(found, expected)
