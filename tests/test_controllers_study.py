"""The study of the controllers: its draws, and what it claims of numbers that are given."""

import numpy as np
import pytest

from studies.controllers_study import DESIGNS, outcome
from studies.yardsticks import (
    FINAL,
    HALF,
    KNOWN_WITHIN,
    LATE_S,
    LIMITS,
    MASS,
    PAYLOADS_KG,
    draws,
    late,
    sine,
)
from workbench.simulation import command_delay_s

BEST = next(iter(DESIGNS))


def rows(share=0.5, **other):
    """Three draws of every design and payload at a share of every limit, unless told otherwise."""
    found = {mark: share * limit for mark, limit in LIMITS.items()} | other
    return {(name, kg): [dict(found) for _ in range(3)] for name in DESIGNS for kg in PAYLOADS_KG}


def held(found):
    return {claim.claim: claim.holds for claim in found.claims}


def test_designs_within_every_limit_hold_every_claim_and_beyond_none():
    assert all(held(outcome(rows())).values())
    beyond = held(outcome(rows(share=1.2)))

    assert [holds for claim, holds in beyond.items() if "at most" in claim] == [False] * len(LIMITS)


def test_the_median_counts_against_the_limit_and_the_spread_against_twice_it():
    one_bad, one_far = rows(), rows()
    one_bad[BEST, 5.8][0][FINAL] = 1.9 * LIMITS[FINAL]
    one_far[BEST, 5.8][0][FINAL] = 2.1 * LIMITS[FINAL]

    assert all(held(outcome(one_bad)).values())
    assert [claim for claim, holds in held(outcome(one_far)).items() if not holds] == [
        f"{BEST}, every payload, {FINAL}: 0.05 at most"
    ]


def test_a_draw_that_is_lost_is_named_and_the_figure_is_drawn_without_it():
    lost = rows()
    lost[BEST, 10.0][2] = dict.fromkeys(LIMITS)
    found = outcome(lost)
    claim = found.claims[-1]

    assert not claim.holds and claim.found.startswith("cascade with 10 kg, draw 3: ")
    assert claim.found.count(" sd") == 3 and "mass" not in claim.found
    assert list(found.figures) == ["yardsticks"]
    assert len(found.figures["yardsticks"].axes) == len(LIMITS)
    shown = found.figures["yardsticks"].axes[0].get_legend_handles_labels()[1]
    assert shown == [*DESIGNS, "published"]


def test_an_error_of_another_design_breaks_no_claim():
    others = rows()
    others["pid", 2.2][0][HALF] = 100.0

    assert all(held(outcome(others)).values())


def test_draws_repeat_and_know_the_payload_within_a_fifth():
    first, again = ([*draws(4)] for _ in range(2))
    known = np.array([each.believed.values[MASS] / each.payload_kg for each in first])

    assert [each.plant.values for each in first] == [each.plant.values for each in again]
    assert all(each.plant.values[MASS] == each.payload_kg for each in first)
    assert abs(known - 1.0).max() < KNOWN_WITHIN
    assert np.ptp(known) > 0.05
    valves = {each.plant.values["valve.flow_area_m2"] for each in first}
    assert len(valves) == 4


def test_commands_come_a_sample_late_and_design_and_estimator_know_it():
    (early,) = draws(1, (5.8,))
    found = late(early)

    for plant, before in ((found.plant, early.plant), (found.believed, early.believed)):
        assert command_delay_s(plant) == LATE_S and command_delay_s(before) == 0.0
        assert {**plant.values, "command_delay.delay_s": 0.0} == before.values


def test_a_sine_is_judged_in_its_second_period():
    plant = next(draws(1)).plant
    scenario = sine(plant, 0.5, 0.06)

    assert scenario.judged_s == pytest.approx(2.0) and len(scenario.reference_m) == 4000
    assert np.ptp(scenario.reference_m) == pytest.approx(0.12, rel=1e-3)


def test_the_other_plants_stand_beside_the_drive_in_text_claims_figures_and_numbers():
    from studies.controllers_study import together

    step = {"overshoot_pa": [2e3, 5e3], "settling_s": [0.02, 0.025]}
    found = together(outcome(rows()), {"soft_joint": [{"0-1": step}] * 2})

    assert "soft_joint" in found.text and "cascade" in found.text
    assert len(found.claims) == len(outcome(rows()).claims) + 3
    assert list(found.figures) == ["yardsticks", "followers"]
    ticks = [label.get_text() for label in found.figures["followers"].axes[0].get_xticklabels()]
    assert ticks == ["0-1, overshoot", "0-1, settling"]
    assert found.numbers["soft_joint"]["design"] == "pressure"
