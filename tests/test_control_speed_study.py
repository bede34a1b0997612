"""What the study of speed claims, on times that are given."""

import numpy as np

from studies.control_speed_study import (
    AT_LIMITS,
    BINARIES,
    CVXPY,
    FEWER_JUDGED,
    HYBRID,
    IPOPT,
    KEPT_OSQP,
    LINEAR,
    NONLINEAR,
    OURS_OSQP,
    WHOLE,
    Timed,
    outcome,
)

TIMES_S = {
    AT_LIMITS: 1e-4, OURS_OSQP: 3e-3, KEPT_OSQP: 1e-3, CVXPY: 1e-2, LINEAR: 7e-5,
    NONLINEAR: 3e-4, WHOLE: 5e-4, IPOPT: 6e-2, HYBRID: 8e-4, BINARIES: 2e-4,
    FEWER_JUDGED: 6e-4,
}  # fmt: skip


def rows(**changed):
    found = {name: Timed(np.full(100, s), 1e-6) for name, s in TIMES_S.items()}
    return found | {globals()[name]: row for name, row in changed.items()}


def held(found):
    return [claim.holds for claim in outcome(found).claims]


def test_all_claims_hold_on_times_within_their_bounds():
    assert all(held(rows()))


def test_each_bound_is_one_claim():
    slow = Timed(np.append(np.full(95, 5e-5), np.full(5, 7e-4)))
    cases = {
        0: rows(LINEAR=slow),
        1: rows(AT_LIMITS=Timed(np.full(100, 1e-4), 2e-3)),
        2: rows(KEPT_OSQP=Timed(np.full(100, 5e-5))),
        3: rows(NONLINEAR=Timed(np.full(100, 1.1e-3))),
        4: rows(HYBRID=Timed(np.full(100, 1.1e-3))),
        5: rows(FEWER_JUDGED=Timed(np.full(100, 1.1e-3))),
        6: rows(IPOPT=Timed(np.full(100, 6e-2), sound=False)),
    }
    for place, found in cases.items():
        assert [k for k, holds in enumerate(held(found)) if not holds] == [place]
