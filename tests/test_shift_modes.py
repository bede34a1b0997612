"""The gearbox's modes beyond the paper's matrices: Neutral, valves as inputs, flows for valves."""

import json

import casadi as ca
import numpy as np
import pytest

from linearize.listing import document, table
from linearize.shift_modes import gearbox_modes, held_at_neutral, switched_modes, valve_flows
from linearize.shifting import FLOWS, POSITION, PRESSURES, VELOCITY, shift_model
from linearize.standard import standard_modes
from workbench.plants.gearbox import PISTON_M2 as A1
from workbench.plants.gearbox import RING_M2 as RING
from workbench.plants.gearbox import SHANK_M2 as A2
from workbench.plants.gearbox import STROKE_M, gearbox
from workbench.recording import Recording
from workbench.simulation import simulate

KAPPA, R, ROOM_K = 1.4, 287.0, 293.15
V10, V20 = 15e-6, 40e-6
EXACT = 1e-9


@pytest.fixture(scope="module")
def plant():
    return gearbox()


def test_neutral_is_held_where_both_valves_are_on_and_left_where_one_is_not(plant):
    """Physics.md 2.5: both on, +1003 N below Neutral and -1082 N above it."""
    hybrid = gearbox_modes(plant)
    neutral = hybrid["held at Neutral"]
    rest = {POSITION: 0.0, VELOCITY: 0.0, **dict.fromkeys(FLOWS, 0.0)}
    both = rest | dict.fromkeys(PRESSURES, 9e5)

    assert neutral.state_names == PRESSURES
    assert hybrid.active(both) is neutral
    assert not neutral.holds(both | {VELOCITY: 0.5})
    assert not neutral.holds(both | {PRESSURES[1]: 1e5})
    assert not neutral.holds(both | {PRESSURES[0]: 1e5})
    pushes = [9e5 * sum(g.weights.values()) + g.offset for g in neutral.guards[2:]]
    assert np.multiply(pushes, [1.6, 1.95]) == pytest.approx([1003.0, 1082.0], abs=1.0)


def test_the_held_mode_gathers_the_flows(plant):
    mode = held_at_neutral(shift_model(plant))

    assert not mode.A.any()
    assert np.diag(mode.B) == pytest.approx(
        KAPPA * R * ROOM_K / np.array([V10 + A1 * STROKE_M, V20 + (A2 + RING) * STROKE_M])
    )


def test_with_valves_as_inputs_there_are_eight_modes_without_a_command(plant):
    hybrid = switched_modes(plant)
    free = {mode.name: mode for mode in gearbox_modes(plant).modes}

    assert len(hybrid.modes) == 8
    for mode in hybrid.modes:
        assert mode.command_names == ()
        assert mode.drift == pytest.approx(free[mode.name].drift, rel=EXACT)
        assert mode.A[2:] == pytest.approx(free[mode.name].A[2:], rel=EXACT)
        assert mode.A[:2, 2:] == pytest.approx(free[mode.name].A[:2, 2:], rel=EXACT)


def test_what_a_valve_passes_is_that_of_the_nozzle(plant):
    """0.72 pi/4 (3.2 mm)^2 into 5 bar, choked 0.72 pi/4 (4 mm)^2 out of 3 bar."""
    passed = valve_flows(plant)
    psi = np.sqrt(2 * KAPPA / (R * (KAPPA - 1))) * (5 / 9) ** (1 / KAPPA)
    psi *= np.sqrt(1.0 - (5 / 9) ** (1.0 - 1.0 / KAPPA))
    into = 0.72 * np.pi / 4 * 3.2e-3**2 * 9e5 * psi / np.sqrt(ROOM_K)
    out = 0.72 * np.pi / 4 * 4e-3**2 * 3e5 * 0.0404184 / np.sqrt(ROOM_K)

    assert passed(1.0, 5e5) == pytest.approx([into, into], rel=1e-9)
    assert passed(0.0, 3e5) == pytest.approx([-out, -out], rel=1e-5)


def test_the_whole_plant_under_its_own_flows_moves_as_with_its_valves():
    """What feeds the plant in place of valves gets the flows that the valves passed."""
    plant, n, dt = gearbox(-STROKE_M).lean(), 120, 1e-4
    on = np.ones((2, n + 1))
    commands = ("valve_1.command", "valve_2.command")
    run = simulate(plant, Recording("shift", dt, dict(zip(commands, on, strict=True))))
    fed = shift_model(plant).plant

    flows = passed_flows(plant, run, on)
    again = simulate(fed, Recording("fed", dt, dict(zip(FLOWS, flows, strict=True))))

    assert again[POSITION] == pytest.approx(run[POSITION], abs=2e-4)
    assert run[POSITION][-1] > -STROKE_M + 2e-3


def passed_flows(plant, run, on):
    model = plant.model
    names = [(f"valve_{k}", "MassFlow", f"chamber_{k}") for k in (1, 2)]
    f = ca.Function("flows", [*model.symbols], [ca.vertcat(*(model.flows[n] for n in names))])
    x, p = run.rows(model.states), plant.nominal[2]
    flows = np.hstack([f(x[:, k], on[:, k], [], p).full() for k in range(x.shape[1])])
    middle = 0.5 * (flows[:, 1:] + flows[:, :-1])
    return np.column_stack([middle, middle[:, -1]])


def test_the_standard_modes_of_the_gearbox_print_as_a_table(plant):
    lines = table(standard_modes(plant)).splitlines()

    assert len(lines) == 10
    assert lines[1].startswith("held at Neutral")


def test_the_document_tells_where_each_mode_holds(plant):
    free, switched = (make(plant) for make in (gearbox_modes, switched_modes))
    entries = json.loads(json.dumps(document(free), allow_nan=False))
    levels = json.loads(json.dumps(document(switched), allow_nan=False))[0]["region"]

    assert entries[0]["region"][POSITION]["upper"] == pytest.approx(1e-4)
    assert len(entries[0]["guards"]) == 4
    assert entries[1]["region"][POSITION]["lower"] is None
    assert entries[1]["region"][POSITION]["upper"] == 0.0
    assert levels["valve_1.command"] == {"label": "1 vents", "level": 0.0}


def test_what_a_plant_of_ones_own_has_besides_is_listed_too(plant):
    own = plant.with_values({"friction_thermal.softening_n_k": 0.5})
    hybrid = gearbox_modes(own)

    assert [item.what for item in hybrid.model.left_out][-1] == "friction_thermal"
    assert pytest.approx(gearbox_modes(plant).modes[1].A) == hybrid.modes[1].A
