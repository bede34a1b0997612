"""What the study of gear shifts claims of drawn plants, on numbers that are given."""

from dataclasses import replace

import numpy as np
import pytest

from studies.gear_shift_study import (
    HYBRID,
    LQ,
    PD,
    SCHEDULED,
    _claims_of_draws,
    _missed,
    _truth,
    ranking,
    told_known,
    valves_alone,
)
from studies.shift_check import SHIFTS, Shift
from workbench.plants.gearbox import gearbox

TIMES_S = {HYBRID: 0.02, SCHEDULED: 0.03, LQ: 0.035, PD: 0.05}


def shift(design, scenario, settling_s):
    """A shift within its bounds but for its time, which may be 25 ms."""
    numbers = dict.fromkeys(Shift.__dataclass_fields__, 0.0) | {"longest_s": 0.025}
    numbers |= {"design": design, "scenario": scenario, "settling_s": settling_s}
    return Shift(**numbers)


def rows(number=2, **other):
    """All four shifts of every design on so many draws."""
    times = TIMES_S | other
    return [
        shift(f"{design} {k + 1}", scenario, time_s)
        for k in range(number)
        for scenario in SHIFTS
        for design, time_s in times.items()
    ]


def test_a_plant_of_which_the_valves_alone_are_known_is_nominal_but_for_them():
    truth, found, nominal = _truth(3).values, valves_alone(_truth(3)).values, gearbox().values
    own = {name for name in found if name.startswith(("valve_1.", "valve_2."))}

    assert all(found[name] == truth[name] for name in own)
    assert all(found[name] == nominal[name] for name in set(found) - own)
    assert sum(truth[name] != nominal[name] for name in own) > 10
    assert sum(truth[name] != nominal[name] for name in set(found) - own) > 10


def test_claims_can_be_written_as_json():
    assert [type(claim.holds) for claim in _claims_of_draws(rows())] == [bool] * 6


def held(found):
    return {claim.claim: (claim.holds, claim.found) for claim in _claims_of_draws(found)}


def test_the_order_of_the_published_follow_ups_is_looked_for_on_every_draw():
    last = "PD takes longer than LQ, scheduled or not, on every drawn plant"
    first = "scheduled LQ takes less time than LQ on most drawn plants"
    swapped = rows(2)
    late = next(k for k, row in enumerate(swapped) if row.design == f"{SCHEDULED} 2")
    swapped[late] = replace(swapped[late], settling_s=0.2)

    assert held(rows())[last][0] and held(rows())[first][0]
    assert held(rows())[last][1].startswith("on 2 of 2; medians scheduled LQ 120 ms")
    assert held(rows())[first][1] == "on 2 of 2, which chance alone gives with 25 %"
    holds, told = held(swapped)[first]
    assert not holds and told.startswith("on 1 of 2")
    assert not held(swapped)[last][0]


def test_a_shift_that_never_ends_makes_its_design_the_last_one():
    found = ranking(rows(1, **{LQ: np.inf}))

    assert found[SCHEDULED] == [pytest.approx(0.12)] and found[LQ] == [np.inf]


def test_what_rivals_miss_is_no_miss_of_hybrid_mpc():
    claims = held(rows())

    assert all(
        claims[f"{HYBRID}: {name} is fast and soft on every drawn plant"][0] for name in SHIFTS
    )
    assert _missed(rows()) == "none"
    assert "hybrid MPC 2" in _missed(rows(**{HYBRID: 0.03}))


def test_missed_shifts_are_told_with_what_sets_their_plants_apart():
    late = [shift(f"{HYBRID} 5", "n-h", 0.03), shift(f"{HYBRID} 9", "l-n", 0.02)]
    told = told_known(late).splitlines()

    assert told[0].endswith("of the 2 missed, made by a design and a filter that know the plant: 1")
    assert told[1].startswith("draw 5: ") and told[1].count(" sd") == 3
    assert told[2].startswith("draw 9: ")
