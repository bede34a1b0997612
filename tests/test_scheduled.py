"""Which designs of a schedule count where, and how much."""

import numpy as np
import pytest

from controllers.scheduled import Schedule, constant

POINTS_M = np.array([0.02, 0.1, 0.15, 0.3])
SIDES = tuple(f"f{k}" for k in range(4)), tuple(f"b{k}" for k in range(4))
SCHEDULE = Schedule(POINTS_M, *SIDES)


@pytest.mark.parametrize("ahead", [0.0, 0.3, 0.5, 1.0])
@pytest.mark.parametrize("position_m", [-1.0, 0.02, 0.05, 0.1, 0.149, 0.3, 2.0])
def test_designs_between_two_points_are_mixed_linearly_and_by_direction(position_m, ahead):
    weights = dict.fromkeys((*SIDES[0], *SIDES[1]), 0.0)
    for weight, name in SCHEDULE.weighted(position_m, ahead):
        weights[name] += weight

    for share, names in zip((ahead, 1.0 - ahead), SIDES, strict=True):
        for k, name in enumerate(names):
            hat = np.interp(position_m, POINTS_M, np.eye(4)[k])
            assert weights[name] == pytest.approx(share * hat, abs=1e-12)
    assert weights[SCHEDULE.heaviest(position_m, ahead)] == max(weights.values())


def test_one_design_everywhere_counts_everywhere():
    assert sum(w for w, _ in constant("only").weighted(0.7, 0.4)) == pytest.approx(1.0)
    assert constant("only").heaviest(-0.2, 0.0) == "only"
