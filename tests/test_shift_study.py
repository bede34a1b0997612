"""Study low-to-neutral: its claims hold, its shares add up, and its runs are what they say."""

import json

import numpy as np
import pytest

from linearize.shifting import COULOMB
from studies.low_to_neutral import (
    PIECES,
    STEP_S,
    along,
    fed,
    linear,
    nonlinear,
    one_point,
    reduced,
    shift,
)
from studies.registry import STUDIES
from studies.shift_study import REPAIRS, measured, shares
from studies.study import Extent


@pytest.fixture(scope="module")
def seen():
    return shift()


def test_the_shift_is_that_of_the_reference(seen):
    """Physics.md section 7: starts at 5.5 ms, arrives at 15.1 ms, 4.6 bar in chamber 1 at 10 ms."""
    row = measured("plant", seen.states, seen)

    assert row.started_s == pytest.approx(5.5e-3, abs=1e-4)
    assert row.arrived_s == pytest.approx(15.1e-3, abs=1e-4)
    assert row.at_10_ms[0] == pytest.approx(4.6e5, abs=0.05e5)


@pytest.mark.parametrize(("kept", "starts", "arrives"), [((COULOMB,), 5.4, 14.4), ((), 5.0, 14.0)])
def test_the_reduced_models_are_those_of_the_reference(seen, kept, starts, arrives):
    """Physics.md section 7, before linearising."""
    row = measured("reduced", nonlinear(reduced(*kept), seen), seen)

    assert 1e3 * row.started_s == pytest.approx(starts, abs=0.15)
    assert 1e3 * row.arrived_s == pytest.approx(arrives, abs=0.15)


def test_modes_along_the_way_cover_it_once(seen):
    modes = along(reduced(), seen)

    assert len(modes) == PIECES
    for place in np.linspace(-0.012, -1e-6, 200):
        assert [m.box["main_piston.position_m"].contains(place) for m in modes].count(True) == 1


def test_one_mode_alone_follows_its_own_equation(seen):
    """Sample by sample against the exact solution of the mode, while it moves below Neutral."""
    from scipy.integrate import solve_ivp

    model = reduced()
    (mode,) = one_point(model)
    states = linear(model, (mode,), seen)
    k = 400
    flow = seen.flows[:, k]
    exact = solve_ivp(
        lambda t, x: mode.rates(x, flow), (0.0, STEP_S), states[:, k], rtol=1e-10, atol=1e-9
    )

    assert states[:, k + 1] == pytest.approx(exact.y[:, -1], rel=1e-7, abs=1e-9)


def test_the_plant_under_its_flows_is_the_plant(seen):
    assert measured("fed", fed(seen), seen).share[2] < 0.01


def test_shares_add_up_to_the_whole_gap():
    rng = np.random.default_rng(3)
    sets = [frozenset(n for k, n in enumerate(REPAIRS) if bits >> k & 1) for bits in range(16)]
    gaps = dict(zip(sets, rng.uniform(size=16), strict=True))
    alone = {made: 5.0 - len(made & {"detent"}) for made in sets}

    parts = shares(gaps)

    assert sum(parts.values()) == pytest.approx(gaps[frozenset()] - gaps[frozenset(REPAIRS)])
    assert shares(alone) == pytest.approx(dict.fromkeys(REPAIRS, 0.0) | {"detent": 1.0})


def test_the_claims_of_the_study_hold_and_its_numbers_are_plain(tmp_path):
    found = STUDIES["low-to-neutral"].run(tmp_path, Extent.QUICK, lambda message: None)

    assert not [claim.claim for claim in found.claims if not claim.holds]
    assert len(found.claims) == 6
    assert len(json.loads(json.dumps(found.numbers))["rows"]) == 21
