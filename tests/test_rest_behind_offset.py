"""Where a valve rests beside the middle of its command: the CRR rig's at 5.25 V of 0 to 10 V."""

import casadi as ca
import numpy as np
import pytest

from workbench.comparison.regimes import regimes
from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.rig_laws import with_laws
from workbench.simulation import arriving_at_rest

REST_V, COMMAND, N = 5.25, "valve.command_v", 400


def under(command_v):
    """A recording of the rig at rest under one command."""
    plant = PLANTS["crr_rig"]()
    start = dict(zip(plant.model.states, plant.initial, strict=True))
    channels = {COMMAND: np.full(N, command_v)}
    channels |= {name: np.full(N, start[name]) for name in plant.measured}
    return regimes(plant, Recording("rest", 1e-3, channels))


def test_a_valve_is_closed_at_the_command_where_it_rests():
    found = under(REST_V)

    assert found["valve closed"].all()
    assert not any("open" in name or "near null" in name for name in found)


def test_a_valve_is_open_to_the_side_of_where_it_rests():
    found = under(5.5)

    assert found["valve open above 5.25 V"][N // 2 :].all()
    assert "valve open below 5.25 V" not in found


def test_an_offset_that_is_fitted_moves_the_command_at_which_the_valve_rests_not_the_valve():
    moved = PLANTS["crr_rig"]().with_values({"valve_offset.offset_v": 0.55})

    assert arriving_at_rest(moved) == arriving_at_rest(PLANTS["crr_rig"]()) == {COMMAND: 5.0}


LAW, SIZE_KG_S = "law[|u|]@cap", 1e-4


def flow_at(command_v):
    """Flow in kg/s by the law of the opening, whose size is that at the full range to one side."""
    plant = with_laws(PLANTS["crr_rig"]().lean(), [LAW]).with_values(
        {f"{LAW}.size_kg_s": SIZE_KG_S}
    )
    (flow,) = (value for (member, *_), value in plant.model.flows.items() if member == LAW)
    _, d, p = plant.nominal
    evaluate = ca.Function("flow", [*plant.model.symbols], [flow])
    return evaluate(plant.initial, command_v[None], d, p).full().ravel()


def test_the_law_of_the_opening_has_no_flow_and_its_kink_where_the_valve_rests():
    step_v = 0.05
    command_v = REST_V + step_v * np.arange(-10, 11)
    flow = flow_at(command_v)
    slopes = np.diff(flow) / step_v

    assert flow[10] == pytest.approx(0.0, abs=2e-3 * SIZE_KG_S)  # its kink is rounded
    assert slopes[:9] == pytest.approx(-SIZE_KG_S / REST_V, rel=0.02)
    assert slopes[11:] == pytest.approx(SIZE_KG_S / REST_V, rel=0.02)
