"""Solenoid valves alone: what their seats pass, for how long they remember, and how they differ."""

import numpy as np
import pytest

from linearize.valve_response import BEFORE, MASK, MEMORY, packed, valve_response, valve_responses
from linearize.valve_sample import CHARGING, VENTING, valve_ends, valve_sample
from linearize.valve_spread import AS_DESIGNED, Learned, uncertain_valve, valve_spread
from workbench.errors import InputError
from workbench.plants.gearbox import COMMANDS, gearbox
from workbench.recording import Recording
from workbench.simulation import simulate

HOLD = 4
VALVE = "valve_1"


@pytest.fixture(scope="module")
def response():
    return valve_response(gearbox(), VALVE, 1e-3, HOLD)


@pytest.fixture(scope="module")
def sample():
    return valve_sample(gearbox().lean(), VALVE, 1e-3)


def run(sample, commands, plant=None):
    """Shares of a released valve under commands, shape (n, 2)."""
    plant = plant or gearbox().lean()
    x, found = valve_ends(plant, VALVE)[:, 0], []
    for command in commands:
        x, shares = sample(x, float(command), plant.nominal[2])
        x = x.full().ravel()
        found.append(shares.full().ravel())
    return np.array(found)


def looked_up(response, commands, learned=AS_DESIGNED):
    """The same from the table, sample by sample."""
    sent, found = 0, []
    for command in commands:
        found.append(response.ahead(sent, np.array([command]), learned)[0])
        sent = (sent << 1 | int(command)) & MASK
    return np.array(found)


def runs(lengths):
    """Commands that alternate, released first."""
    return np.concatenate([np.full(n, k % 2) for k, n in enumerate(lengths)])


def opened(plant, commands):
    """Shares of both seats by the lift of the armature in the whole plant, by physics.md 2.5."""
    fine, values = 50, plant.values
    u = np.append(np.repeat(commands, fine), commands[-1]).astype(float)
    channels = dict(zip(COMMANDS, (u, np.zeros_like(u)), strict=True))
    whole = simulate(plant, Recording("valve", 1e-3 / fine, channels))
    full_m = values[f"{VALVE}.full_lift_m"]
    lift_m = np.clip(whole[f"{VALVE}.armature_position_m"], 0.0, full_m)
    seats = ((lift_m, "inlet"), (full_m - lift_m, "exhaust"))
    shares = [np.minimum(4.0 * gap / values[f"{VALVE}.{n}_diameter_m"], 1.0) for gap, n in seats]
    means = [0.5 * (row[:-1] + row[1:]).reshape(-1, fine).mean(axis=1) for row in shares]
    return np.transpose(means)


def test_a_valve_held_for_long_passes_one_flow_alone(response):
    assert looked_up(response, np.zeros(3, dtype=int))[-1] == pytest.approx([0.0, 1.0], abs=1e-6)
    on = response.ahead(MASK, np.array([1]))[0]
    assert on == pytest.approx([1.0, 0.0], abs=1e-6)


def test_a_valve_opens_late_closes_later_and_bounces(response):
    on = response.ahead(0, packed(np.ones(20, dtype=int)))
    off = response.ahead(MASK, packed(np.zeros(20, dtype=int)))

    assert on[1, CHARGING] < 0.02 and on[4, CHARGING] > 0.98  # physics.md 2.5: lift from 1.9 ms on
    assert on[3, VENTING] > 0.98 and on[5, VENTING] < 0.1  # the other seat closes at 3.8 ms
    assert on[6, CHARGING] > 0.98
    assert off[2, CHARGING] > 0.98 and off[7, CHARGING] < 0.2  # lift falls from 3.9 ms on
    assert off[5, VENTING] > 0.1
    assert (np.diff(off[:, CHARGING]) > 0.1).any()


def test_on_its_way_both_seats_of_a_valve_are_open(response):
    on = response.ahead(0, packed(np.ones(20, dtype=int)))

    assert on.sum(axis=1).max() > 1.3


@pytest.mark.parametrize("lengths", [(2, 30, 22), (1, 6, 7, 15, 21), (3, 90, 22)])
def test_a_valve_alone_passes_what_that_of_the_whole_plant_does(sample, lengths):
    """Areas of the seats by hand from the armature of a simulation, at 20 us."""
    commands = runs(lengths)
    error = run(sample, commands) - opened(gearbox().lean(), commands)

    assert np.sqrt(np.mean(error**2, axis=0)) == pytest.approx([0.0, 0.0], abs=0.03)
    assert np.abs(error.sum(axis=0)).max() < 0.1  # samples of full flow


def test_the_table_is_the_valve_itself_where_its_last_pause_was_long(response, sample):
    """A window of the table forgets only how short the pause before its oldest pulse was."""
    rng, errors = np.random.default_rng(1), []
    for _ in range(40):
        commands = runs(rng.integers(HOLD, 25, rng.integers(5, 9)))
        errors.append(looked_up(response, commands) - run(sample, commands))

    assert np.sqrt(np.mean(np.concatenate(errors) ** 2)) < 0.025
    assert max(np.sqrt(np.mean(error**2)) for error in errors) < 0.09


def test_a_coil_that_was_energised_for_longer_lets_go_later(response, sample):
    """By 1.5 ms between 14 ms and long, where a table of 20 samples alone could not tell."""
    closed = []
    for stood in (14, 30, MEMORY + BEFORE + 30):
        commands = runs((1, stood, MEMORY))
        shares = looked_up(response, commands)[1 + stood :, CHARGING]
        assert shares == pytest.approx(run(sample, commands)[1 + stood :, CHARGING], abs=0.06)
        first = int(np.argmax(shares < 0.5))  # the sample in which half of it is closed
        closed.append(first + (shares[first - 1] - 0.5) / (shares[first - 1] - shares[first]))

    assert closed[2] - closed[0] > 1.2 and closed[0] < closed[1] < closed[2]


def test_what_is_uncertain_of_a_valve_is_nearly_one_number(sample):
    commands = runs((1, 6, 12, 20, 20))
    pairs = valve_spread(gearbox(), VALVE, 1e-3)
    both = ((run(sample, commands, a), run(sample, commands, b)) for a, b in pairs)
    sizes = [np.linalg.norm(ahead - behind) for ahead, behind in both]

    assert sizes[0] ** 2 > 0.6 * np.sum(np.square(sizes))
    assert sizes == sorted(sizes, reverse=True)


def test_a_stronger_valve_pulls_in_sooner_and_lets_go_later(sample):
    stronger, weaker = valve_spread(gearbox(), VALVE, 1e-3)[0]
    found = [run(sample, runs((1, 20, 20)), p) for p in (stronger, gearbox().lean(), weaker)]
    opening = [each[1:8, CHARGING].sum() for each in found]
    closing = [each[21:29, CHARGING].sum() for each in found]

    assert opening == sorted(opening, reverse=True) and closing == sorted(closing, reverse=True)


@pytest.mark.parametrize(("lengths", "share"), [((1, 20, 20), 0.4), ((1, 5, 9, 7, 12), 0.75)])
def test_the_table_knows_what_strength_changes(response, sample, lengths, share):
    """Of the squared error that is left as designed: of a long pulse, of short ones."""
    commands = runs(lengths)
    for strength, plant in zip((1.0, -1.0), valve_spread(gearbox(), VALVE, 1e-3)[0], strict=True):
        truth = run(sample, commands, plant)
        told, untold = (
            np.square(looked_up(response, commands, learned) - truth).sum()
            for learned in (Learned(strength), AS_DESIGNED)
        )
        assert told < share * untold


@pytest.mark.parametrize("strength", [-2.5, 2.5])
def test_no_strength_opens_a_seat_further_than_wholly(response, strength):
    shares = looked_up(response, runs((1, 5, 9, 7, 12)), Learned(strength))

    assert shares.min() >= 0.0 and shares.max() <= 1.0


def test_a_gain_of_the_flow_scales_both_seats(response):
    plan = packed(np.repeat([1, 0], [8, 12]))
    lean = response.ahead(0, plan, Learned(0.0, -0.1))

    assert lean == pytest.approx(0.9 * response.ahead(0, plan))


def test_no_plans_have_no_shares(response):
    assert response.ahead(0, np.zeros((0, 5), dtype=int)).shape == (0, 5, 2)


def test_valves_of_the_same_parameters_share_a_table():
    weak = gearbox().with_values({"valve_2.supply_voltage_v": 23.0})
    first, second = valve_responses(gearbox(), ("valve_1", "valve_2"), 1e-3, 6)
    assert first is second
    first, second = valve_responses(weak, ("valve_1", "valve_2"), 1e-3, 6)
    assert np.abs(first.shares - second.shares).max() > 0.05


def test_a_valve_of_which_all_is_known_has_no_strength(monkeypatch):
    monkeypatch.setattr("linearize.valve_spread._deviations", lambda plant, valve: {})
    plant = gearbox().with_values({"main_piston.mass_kg": 1.01})  # one that nothing has kept
    sure = uncertain_valve(plant, VALVE, 1e-3, 4)
    _, shares, gained, untold = sure.step(sure.begun, 1.0, sure.parameters)

    assert valve_spread(plant, VALVE, 1e-3) == ()
    assert (gained.full() == 0.0).all() and untold.shape == (2, 0)
    assert shares.full().ravel() == pytest.approx([0.0, 1.0], abs=0.02)
    assert (valve_response(plant, VALVE, 1e-3, 6).slopes == 0.0).all()


@pytest.mark.parametrize(
    "plant",
    [
        pytest.param(gearbox().with_measured_input("supply.pressure_pa"), id="measured supply"),
        pytest.param(
            gearbox().with_values({"supply_droop.resistance_pa_s_kg": 5e7}), id="supply droop"
        ),
        pytest.param(gearbox().with_values({f"{VALVE}.leak_area_m2": 3e-7}), id="leak"),
    ],
)
def test_what_else_a_plant_has_changes_no_share(response, plant):
    commands = runs((1, 8, 12))
    found = looked_up(valve_response(plant, VALVE, 1e-3, HOLD), commands)

    assert found == pytest.approx(looked_up(response, commands), abs=1e-6)


def test_a_supply_at_ambient_pressure_is_refused():
    plant = gearbox().with_values({"supply.pressure_pa": 1.0e5})
    with pytest.raises(InputError, match=r"supply\.pressure_pa: is 1 bar; expected more than"):
        valve_response(plant, VALVE, 1e-3, HOLD)
