"""The condensed program of linear MPC: what is best without limits, and what keeps them."""

import numpy as np
import pytest

from controllers.condensed import Asked
from controllers.linear_mpc import linear_mpc
from controllers.mpc_spec import MpcSpec
from linearize.standard import standard_modes
from workbench.plants.servo_drive import servo_drive

REST = np.array([0.145, 0.0, 5.65e5, 5.65e5])


@pytest.fixture(scope="module")
def hybrid():
    return standard_modes(servo_drive())


@pytest.mark.parametrize("horizon", [1, 20, 30])
def test_without_limits_one_product_gives_the_optimum_its_states_and_its_moves(hybrid, horizon):
    """A moving reference, a force, other targets than zero; by the gradient, step by step."""
    programs = linear_mpc(hybrid, MpcSpec(horizon=horizon)).programs
    rng = np.random.default_rng(5)
    for program in (*programs.forward, *programs.backward):
        x = REST + [0.1, 1.0, 1e5, 1e5] * rng.uniform(-1.0, 1.0, 4)
        places_m, others = rng.uniform(0.0, 0.29, horizon), [rng.uniform(-1.0, 1.0), 5e5, 4e5]
        asked = Asked(x, 12.0, places_m, np.array(others), 0.1, 0.3)
        targets = np.array([[place_m, *others] for place_m in places_m]).ravel()
        unforced = program.unforced(x, 12.0)
        openings = program.unlimited(program.gradient(unforced, targets, 0.1, 0.3))
        states = unforced + program.forced @ openings
        wanted = np.concatenate([openings, states, np.diff(openings, prepend=0.3)])

        assert asked.targets == pytest.approx(targets)
        off = np.abs(program.without_limits(asked) - wanted)
        assert (off < 1e-8 * np.maximum(np.abs(wanted), 1e-3)).all()


@pytest.mark.parametrize(("horizon", "spread"), [(1, 4.0), (20, 1.0)])
def test_openings_keep_the_limits_where_they_keep_the_rows_of_the_program_without_slack(
    hybrid, horizon, spread
):
    """Each kind of limit broken by itself, and random openings around all of them."""
    spec = MpcSpec(rate_v_s=200.0, horizon=horizon)
    program = linear_mpc(hybrid, spec).programs.forward[1]
    n, rng, answers = program.horizon, np.random.default_rng(7), []
    states = REST + [0.1, 1.5, 1.3e5, 1.3e5] * rng.uniform(-1.0, 1.0, (200, 4))
    steps = rng.normal(0.0, rng.choice([0.02, 0.2], (200, 1)), (200, n))
    for x, step in zip(states, spread * steps, strict=True):
        openings, unforced = 0.1 + np.cumsum(step), program.unforced(x, 0.0)
        low, high = program.limits.bounds(unforced, 0.1)
        at = program.rows @ np.concatenate([openings, np.zeros(5)])
        answers.append(program.keeps(openings, unforced, 0.1))

        assert answers[-1] == bool((at >= low).all() and (at <= high).all())
    calm = np.zeros(n), program.unforced(REST, 0.0)
    assert 10 < sum(answers) < 190 and program.keeps(*calm, 0.0)
    assert not program.keeps(*calm, 0.5)
    largest = program.limits.openings[1]
    assert not program.keeps(np.full(n, largest + 0.1), calm[1], largest)
    assert not program.keeps(np.full(n, np.nan), calm[1], 0.0)
