"""What the gearbox actuator does: the shifts of physics.md 7 and the sizes of its section 6."""

import numpy as np
import pytest
from gearbox_shifts import (
    HIGH_M,
    LOW_M,
    POSITION,
    SHIFTS,
    VELOCITY,
    first_ms,
    run,
    settled_ms,
    shifted,
)

from workbench.closed_loop import Hardware
from workbench.plants.gearbox import gearbox

AMBIENT_PA = 1.013e5
P1, P2, PC = (f"{name}.pressure_pa" for name in ("chamber_1", "chamber_2", "control_chamber"))
LIFT = "valve_1.armature_position_m"


@pytest.mark.parametrize(
    ("name", "rises_ms", "moves_ms", "leaves_ms", "settles_ms"),
    [
        ("N to H", 2.8, 5.1, 6.9, 20.2),
        ("H to N", 2.8, 5.1, 7.0, 39.4),
        ("N to L", 3.0, 9.0, 11.7, 41.8),
        ("L to N", 2.6, 4.1, 5.5, 33.9),
    ],
)
def test_each_shift_takes_the_time_of_the_table(name, rises_ms, moves_ms, leaves_ms, settles_ms):
    """To the 0.1 ms that the table shows."""
    start_m, _, end_m = SHIFTS[name]
    seen = shifted(name)
    rising = np.maximum(seen[P1], seen[P2]) > 1.02 * AMBIENT_PA

    assert first_ms(seen, rising) == pytest.approx(rises_ms, abs=0.11)
    assert first_ms(seen, np.abs(seen[VELOCITY]) > 0.01) == pytest.approx(moves_ms, abs=0.11)
    moved = np.abs(seen[POSITION] - start_m) > 1e-4
    assert first_ms(seen, moved) == pytest.approx(leaves_ms, abs=0.11)
    assert settled_ms(seen, end_m) == pytest.approx(settles_ms, abs=0.15)


def test_on_the_way_to_high_the_exhaust_chokes_and_the_control_chamber_breathes():
    seen = shifted("N to H")

    assert seen[P1][-1] == pytest.approx(9e5, rel=1e-3)
    assert seen[P2].max() == pytest.approx(1.86e5, rel=0.01)
    assert seen[P2][-1] < 1.1e5
    assert [seen[PC].min(), seen[PC].max()] == pytest.approx([0.89e5, 1.013e5], rel=0.01)


def test_from_low_the_piston_arrives_fast_and_pushes_the_floating_piston_4_mm():
    seen = shifted("L to N")
    arrival = int(np.argmax(seen[POSITION] > 0.0))

    assert 0.1 * arrival == pytest.approx(15.1, abs=0.11)
    assert seen[VELOCITY][arrival - 1] == pytest.approx(2.3, abs=0.05)
    assert seen["floating_piston.position_m"].max() == pytest.approx(4e-3, abs=0.3e-3)


@pytest.mark.parametrize("name", SHIFTS)
def test_after_the_release_the_detent_holds_within_half_a_millimetre(name):
    start_m, command, end_m = SHIFTS[name]
    seen = run(gearbox(start_m).lean(), [(command, 0.06), ((0, 0), 0.2)])

    assert seen[POSITION][-1] == pytest.approx(end_m, abs=0.5e-3)
    assert abs(seen[VELOCITY][-1]) < 1e-3
    assert seen[P1][-1] < 1.1 * AMBIENT_PA


def test_the_gas_warms_up_while_charging_and_cools_down_while_released():
    plant = gearbox().lean()
    seen = run(plant, [((1, 0), 0.06), ((0, 0), 0.2)])
    x, u = seen.rows(plant.model.states), seen.rows(plant.model.commands)
    warm = plant.model.quantities("chamber_1.temperature_k").map(len(seen))
    kelvin = warm(x, u, np.zeros((0, len(seen))), plant.nominal[2]).full()

    assert [kelvin.min(), kelvin.max()] == pytest.approx([203.0, 373.0], abs=2.0)


def test_the_valve_opens_and_closes_in_its_time():
    """Lift starts 1.9 ms after the command, inlet full 3.8; released after 28 ms 3.9, 5.8, 6.6 ms.

    Physics.md does not say how long the coil was energised before the release, and the times depend
    on it: with a steady current they are 4.4, 6.2 and 7.0 ms, as its simple substitute has them.
    """
    for on_s, released_ms in ((0.028, (3.9, 5.8, 6.6)), (0.3, (4.4, 6.2, 7.0))):
        seen = run(gearbox().lean(), [((1, 0), on_s), ((0, 0), 0.02)])
        lift_m, off = seen[LIFT], round(on_s / 1e-4)
        assert first_ms(seen, lift_m > 1e-5) == pytest.approx(1.9, abs=0.11)
        assert first_ms(seen, lift_m > 3.2e-3 / 4) == pytest.approx(3.8, abs=0.11)

        after_m = lift_m[off:]
        falling = [after_m < 1.89e-3, after_m < 1.9e-3 - 4e-3 / 4, after_m < 0.0]
        assert [first_ms(seen, f) for f in falling] == pytest.approx(released_ms, abs=0.11)


def test_a_weak_supply_or_a_warm_coil_opens_the_valve_later():
    """Section 6: 0.3 to 0.6 ms with 20 V and with 39 ohm; lift 0.8 ms later at 20 V than at 28 V.

    It starts at 2.4 and 1.6 ms here, counted at the same 10 um as the 1.9 ms at 24 V; the 2.2 and
    1.4 ms of section 6 do not fit those 1.9 ms and must be counted earlier.
    """
    starts, rises = {}, {}
    for name, values in {
        "as it is": {},
        "20 V": {"valve_1__supply_voltage_v": 20.0},
        "28 V": {"valve_1__supply_voltage_v": 28.0},
        "39 ohm": {"valve_1__coil_resistance_ohm": 39.0},
        "77 K warmer": {"valve_1__coil_temperature_k": 293.15 + 0.3 / 0.0039},
    }.items():
        seen = shifted("N to H", 0.01, **values)
        starts[name] = first_ms(seen, seen[LIFT] > 1e-5)
        rises[name] = first_ms(seen, seen[P1] > 1.02 * AMBIENT_PA)

    assert starts["20 V"] - starts["28 V"] == pytest.approx(0.8, abs=0.11)
    for late in ("20 V", "39 ohm"):
        assert 0.25 < rises[late] - rises["as it is"] < 0.65
    assert rises["77 K warmer"] == rises["39 ohm"]


@pytest.mark.parametrize(
    ("values", "position_mm", "pressure_bar"),
    [
        ({"detent__force_n": 0.0}, 1.8, 0.32),
        (
            {f"valve_{k}__discharge_coefficient": 0.9 * 0.72 for k in (1, 2)},
            1.6,
            0.61,
        ),
        ({"chamber_1__dead_volume_change": 0.2}, 0.9, 0.24),
        ({"supply__pressure_pa": 0.95 * 9e5}, 0.8, 0.45),
        ({"control_chamber__port_area_m2": 1e-6}, 0.34, 0.06),
        ({"wall_heat__coefficient_w_m2_k": 0.0}, 0.05, 0.03),
    ],
    ids=["detent off", "C_d -10 %", "V10 +20 %", "supply -5 %", "port 1 mm2", "heat off"],
)
def test_an_effect_changes_a_shift_by_what_section_6_says(values, position_mm, pressure_bar):
    bare, seen = shifted("N to H", 0.06), shifted("N to H", 0.06, **values)
    off_mm = 1e3 * np.abs(seen[POSITION] - bare[POSITION]).max()
    off_bar = 1e-5 * np.abs(seen[P1] - bare[P1]).max()

    assert off_mm == pytest.approx(position_mm, abs=0.06)
    assert off_bar == pytest.approx(pressure_bar, abs=0.01)


def test_without_coulomb_friction_of_the_main_piston_the_shift_starts_earlier():
    """Section 6 says 1.3 mm and 0.20 bar for "Coulomb off": the 45 N of the main piston alone."""
    values = {"friction@main_piston.coulomb_force_n": 0.0}
    bare, seen = shifted("N to H", 0.06), shifted("N to H", 0.06, **values)

    assert 1e3 * np.abs(seen[POSITION] - bare[POSITION]).max() == pytest.approx(1.3, abs=0.06)


def test_a_synchroniser_stops_the_shift_until_the_speeds_agree():
    """Standstill near 5 mm, on both sides, for 100 ms over the share of the force that it takes.

    Too weak a force only slows the piston down.
    """
    for name, side in (("N to H", 1), ("N to L", -1)):
        force_n = 1500.0 if side > 0 else 500.0
        seen = shifted(name, 0.2, synchroniser__force_n=force_n)
        in_zone = (side * seen[POSITION] > 5e-3) & (side * seen[POSITION] < 7e-3)
        end_m = HIGH_M if side > 0 else LOW_M

        assert 0.1 < 1e-4 * in_zone.sum() < 0.2
        assert seen[POSITION][-1] == pytest.approx(end_m, abs=0.3e-3)
    weak = shifted("N to H", 0.2, synchroniser__force_n=300.0)
    assert settled_ms(weak, HIGH_M) < 40.0


def test_a_recorded_load_takes_the_place_of_the_synchroniser():
    measured = gearbox().with_measured_input("load.force_n")

    assert "synchroniser" not in [effect.name for effect in measured.effects]
    assert "synchroniser" in [effect.name for effect in gearbox().effects]


def test_with_play_the_finger_follows_the_piston_later():
    tight, loose = shifted("N to H", 0.02), shifted("N to H", 0.02, finger_joint__backlash_m=4e-4)
    behind_m = loose[POSITION] - 0.05 * loose["finger.angle_rad"]
    first = first_ms(loose, loose["finger.angle_rad"] > 1e-4)

    assert behind_m.max() > 2e-4
    assert np.abs(tight[POSITION] - 0.05 * tight["finger.angle_rad"]).max() < 1.5e-4
    assert first > first_ms(tight, tight["finger.angle_rad"] > 1e-4)


def test_without_the_contact_the_floating_piston_holds_nothing():
    """From Low with both valves on, the main piston then runs through Neutral to High."""
    seen = shifted("L to N", piston_contact__stiffness_n_m=0.0)

    assert seen[POSITION][-1] == pytest.approx(HIGH_M, abs=0.5e-3)


def test_with_the_control_chamber_left_out_the_pistons_feel_the_atmosphere():
    """Paper 003 Sec. V: p_c = p_amb; unimportant, about 0.1 mm (physics.md 7)."""
    bare, seen = shifted("N to H", 0.06), shifted("N to H", 0.06, control_chamber__acting_share=0.0)

    assert 1e3 * np.abs(seen[POSITION] - bare[POSITION]).max() == pytest.approx(0.1, abs=0.05)


def test_states_that_nobody_records_are_guessed_where_they_can_be():
    """The floating piston ahead of the main one, gas that fits its volume, a valve as commanded."""
    plant = gearbox().lean()
    seen = run(plant, [((1, 0), 0.1)])
    recorded = {name: seen[name] for name in (*plant.measured, *plant.model.commands)}
    known = recorded | {VELOCITY: seen[VELOCITY]}
    for member in plant.members:
        for quantity, (value, _) in member.guess(known).items():
            known[f"{member.name}.{quantity}"] = np.broadcast_to(value, len(seen))
    last = {name: float(known[name][-1]) for name in plant.model.states if name in known}
    sizes = {"floating_piston.position_m": 1e-4, LIFT: 1.2e-3, "valve_1.current_a": 0.1}
    sizes |= {"finger.angle_rad": 1e-3, "control_chamber.mass_kg": 1e-6, PC: 1e3}
    sizes |= {"chamber_1.mass_kg": 2e-4, "chamber_2.mass_kg": 1e-5}  # chamber 1 is still warm

    for name, size in sizes.items():
        assert last[name] == pytest.approx(seen[name][-1], abs=size), name


def test_a_warm_seal_rubs_less_in_both_directions():
    """10 K warmer at 1 N/K: 10 N less friction; without softening warmth changes nothing."""
    plant = gearbox().with_values({"friction_thermal.softening_n_k": 1.0}).lean()
    rate = plant.model.states.index(VELOCITY)
    x, p = plant.initial, plant.nominal[2]
    for velocity_m_s in (0.5, -0.5):
        x[rate] = velocity_m_s
        accelerations = []
        for warmer_k in (0.0, 10.0):
            x[plant.model.states.index("friction_thermal.warmer_k")] = warmer_k
            accelerations.append(float(plant.model.f(x, [0, 0], [], p)[0][rate]))

        assert np.sign(velocity_m_s) * np.diff(accelerations) == pytest.approx(10.0)


def test_a_switched_command_takes_the_nearest_of_its_levels():
    sent = Hardware().sent(gearbox(), np.array([0.4, 0.6]))

    np.testing.assert_array_equal(sent, [0.0, 1.0])
    np.testing.assert_array_equal(Hardware().sent(gearbox(), np.array([-3.0, 7.0])), [0.0, 1.0])
