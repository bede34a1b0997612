"""Speed of linear, nonlinear and hybrid MPC beside rivals: the rows of study ``control-speed``.

Run it with ``pytest tests/benchmarks -s --benchmark-enable -m ""``, or ``workbench study
control-speed`` for the whole table.  CPU time counts, because other work on the machine would count
in wall time; nothing is asserted about it, only that what is timed is right.
"""

import numpy as np
import pytest

from studies.control_speed_study import (
    AT_LIMITS,
    KEPT_OSQP,
    MILLIVOLT,
    OURS_OSQP,
    at_limits,
    on_the_drive,
    on_the_gearbox,
    outcome,
)

pytestmark = pytest.mark.slow  # a minute and a half


@pytest.fixture(scope="module")
def rows():
    return at_limits(60) | on_the_drive(1, 3) | on_the_gearbox(1)


def test_every_solver_finds_the_input_at_a_limit_to_a_millivolt(rows):
    for name in (AT_LIMITS, OURS_OSQP, KEPT_OSQP):
        assert len(rows[name].times_s) > 3
        assert rows[name].off_v < MILLIVOLT


def test_every_call_that_is_timed_has_an_answer(rows):
    assert all(row.sound for row in rows.values())
    assert all(np.isfinite(row.times_s).all() for row in rows.values())


def test_the_rows_of_control_speed(benchmark, rows):
    told = benchmark.pedantic(outcome, (rows,), rounds=1).text
    if benchmark.enabled:
        print("\n" + told)

    assert all(name in told for name in rows)
