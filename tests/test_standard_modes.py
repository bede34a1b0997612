"""The standard modes of every plant: which there are, where they lie, what holds and lets go."""

import numpy as np
import pytest

from linearize.analysis import analyse
from linearize.axes import joint_axes, rig_axis
from linearize.hybrid_simulation import sampled_hybrid
from linearize.leg_modes import leg_placing
from linearize.modes import hybrid_modes
from linearize.reduction import closed_command, design_model
from linearize.regimes import flow_regimes
from linearize.rest import rest_of
from linearize.standard import REGIME_MODES, STANDARD_MODES, axis_modes, standard_modes
from linearize.stopped import has_stops
from workbench.plants import PLANTS
from workbench.plants.crr_rig import crr_rig
from workbench.plants.servo_drive import servo_drive

SUPPLY_PA, AMBIENT_PA, CRITICAL = 6.5e5, 1.013e5, 0.528282
CAP, ROD_SIDE, VALVE = "cap.pressure_pa", "rod_side.pressure_pa", "valve.command_v"
POSITION = "rod.position_m"
STOPPED = "at upper stop charge cap cap subsonic rod side subsonic"


@pytest.fixture(scope="module")
def rig():
    return standard_modes(crr_rig())


def inlet_pa(offset_v):
    """The input pressure of paper 000, Eq. 9, at an offset of the command; w is 0.75 V."""
    half = 0.5 * (SUPPLY_PA - AMBIENT_PA)
    return AMBIENT_PA + half * (1.0 + np.tanh(np.pi * offset_v / 0.75))


def test_flow_into_a_chamber_chokes_where_the_nozzle_says():
    """physics.md 1.1 and 2.1: below 0.528 P_in gas flows in choked, above P_in / 0.528 out."""
    model = design_model(crr_rig())
    (low, high) = flow_regimes(model, CAP, {VALVE: 5.75})
    (below, above) = flow_regimes(model, ROD_SIDE, {VALVE: 5.75})

    assert (low.label, high.label) == ("cap choked", "cap subsonic")
    assert low.upper == pytest.approx(CRITICAL * inlet_pa(0.5), rel=1e-5)
    assert (below.label, above.label) == ("rod side subsonic", "rod side choked")
    assert below.upper == pytest.approx(inlet_pa(-0.5) / CRITICAL, rel=1e-5)


def test_the_rig_has_valve_by_regimes_by_friction_and_stops(rig):
    names = [mode.name for mode in rig.modes]

    assert len(set(names)) == 3 * 2 * 2 * (3 + 2)
    assert "charge cap cap choked rod side subsonic slide -" in names
    assert {item.what for item in rig.no_modes} >= {"sliding into a stop", "sticking at a stop"}
    assert len(REGIME_MODES["servo_drive"](servo_drive()).modes) == (2 * 2 * 2 + 1) * (3 + 2)


@pytest.mark.parametrize("plant", ["servo_drive", "crr_rig", "crr_arm"])
def test_some_mode_is_active_anywhere(plant):
    hybrid = standard_modes(PLANTS[plant]())
    model = hybrid.model
    rng = np.random.default_rng(4)
    z = np.array([*model.initial, *model.plant.nominal[0]])
    for _ in range(200):
        moved = rng.uniform(-3.0, 3.0, len(z)) * np.concatenate([model.scale, model.command_scale])
        signals = dict(zip((*model.states, *model.commands), z + moved, strict=True))

        assert hybrid.active(signals)


def test_a_rod_against_its_stop_stays_until_pressure_beats_static_friction(rig):
    """Static friction is 19.3 N (physics.md 2.1); cap 5.720 cm2, rod side 5.225 cm2."""
    modes, rod_n = sampled_hybrid(rig, 1e-4), AMBIENT_PA * 4.95e-5

    def speed_m_s(force_n):
        cap_pa = (force_n + rod_n + 3e5 * 5.225e-4) / 5.720e-4
        run = modes.run(np.array([0.0, 0.0, cap_pa, 3e5]), np.full((1, 2), 5.25))
        return run.states[1, 1]

    assert speed_m_s(-50.0) == 0.0
    assert speed_m_s(18.5) == 0.0
    assert speed_m_s(20.0) > 1e-4


def test_what_comes_fast_against_a_stop_is_stopped_by_it(rig):
    """Whatever the pressure that already drives it back."""
    modes = sampled_hybrid(rig, 1e-3)
    run = modes.run(np.array([0.5e-3, -0.5, 6e5, 2e5]), np.full((1, 4), 5.25))

    assert run.states[0].min() > -1e-3
    assert run.states[1, 2] == 0.0
    assert run.states[1, 3] > 0.0


def test_a_point_at_rest_is_one_and_the_others_say_how_far_it_is(rig):
    here = rest_of(rig, rig["centred cap subsonic rod side subsonic stick"])
    stopped = rest_of(rig, rig[STOPPED])
    off_pa = np.abs(stopped.state[2:] - rig[STOPPED].state)
    none = rest_of(rig, rig["charge cap cap choked rod side choked stick"])

    assert here.away < 1e-9
    assert stopped.state[2:] == pytest.approx([inlet_pa(0.5), inlet_pa(-0.5)], rel=1e-6)
    assert stopped.away == pytest.approx(off_pa.max() / 1e5)
    assert none is None


def test_a_rest_that_static_friction_does_not_carry_is_none():
    """Supply against ambient pushes the slide with 295 N."""
    hybrid = standard_modes(servo_drive())

    assert rest_of(hybrid, hybrid["charge a stick middle"]) is None


def test_the_valve_of_the_rig_is_centred_at_its_offset():
    """physics.md 2.1: 5.25 V; an offset besides moves it."""
    assert closed_command(crr_rig()) == pytest.approx(5.25)
    assert rig_axis(crr_rig().with_values({"valve_offset.offset_v": 0.35})).centre == pytest.approx(
        5.35
    )


def test_the_range_of_a_joint_is_that_of_its_stops():
    """physics.md 2.2 and 2.3, in degrees."""
    (arm,) = joint_axes(PLANTS["crr_arm"]())
    leg = joint_axes(PLANTS["crr_leg"]())

    assert np.degrees(arm.ends) == pytest.approx([17.0, 95.0], abs=1e-3)
    assert [axis.prefix for axis in leg] == ["1 ", "2 ", "3 "]
    assert np.degrees([axis.ends for axis in leg]).ravel() == pytest.approx(
        [-40.0, 40.0, -25.0, 55.0, 17.0, 95.0], abs=1e-3
    )


def test_a_joint_that_sticks_takes_up_what_the_others_do_to_it():
    """Joints 2 and 3 share inertia: held, joint 2 makes joint 3 swing as fast as 1 / M33 says."""
    hybrid = standard_modes(PLANTS["crr_leg"]())
    free = hybrid["1 low 2 low 3 low 1 stick 2 slide + 3 slide +"]
    held = hybrid["1 low 2 low 3 low 1 stick 2 stick 3 slide +"]
    row, column = "joint_3.velocity_rad_s", "cap_3.pressure_pa"

    def slope(mode):
        return mode.A[mode.state_names.index(row), mode.state_names.index(column)]

    coupled = hybrid.model
    point = np.array([free.box[f"joint_{k}.angle_rad"].point for k in (1, 2, 3)])
    leg = next(part for part in coupled.plant.parts if part.name == "leg")
    M = np.array([[float(leg.mass_matrix(point)[i, j]) for j in (1, 2)] for i in (1, 2)])

    assert slope(held) / slope(free) == pytest.approx(1.0 / M[1, 1] / np.linalg.inv(M)[1, 1])
    assert "joint_2.velocity_rad_s" not in held.state_names


def test_the_drift_of_a_joint_is_that_beside_the_joint_that_is_held():
    """Where the pressures carry nothing: M33 a3' = M32 a2 + M33 a3 with joint 2 at rest."""
    plant = PLANTS["crr_leg"]()
    legs = standard_modes(plant).model
    _, axis, _ = joint_axes(plant)
    cut = {axis.velocity: axis.friction_cut()}
    held = hybrid_modes(plant, cut, model=legs)["2 stick"]
    x, u = legs.initial, legs.plant.nominal[0]
    a = dict(zip(legs.states, legs.f(x, u)[0].full().ravel(), strict=True))
    leg = next(part for part in legs.plant.parts if part.name == "leg")
    q = np.array([x[legs.states.index(f"joint_{k}.angle_rad")] for k in (1, 2, 3)])
    M32, M33 = (float(leg.mass_matrix(q)[2, k]) for k in (1, 2))
    row = held.state_names.index("joint_3.velocity_rad_s")
    reaction = M32 / M33 * a["joint_2.velocity_rad_s"]

    assert abs(reaction) > 1.0
    assert held.drift[row] == pytest.approx(a["joint_3.velocity_rad_s"] + reaction)


def test_each_joint_breaks_away_by_itself():
    hybrid = standard_modes(PLANTS["crr_leg"]())
    modes, model = sampled_hybrid(hybrid, 1e-3), hybrid.model
    rest = hybrid["1 high 2 high 3 high 1 stick 2 stick 3 stick"]
    x = model.initial.copy()
    x[[model.states.index(name) for name in rest.state_names]] = rest.state
    for name, region in rest.box.items():
        x[model.states.index(name)] = region.point
    x[model.states.index("cap_2.pressure_pa")] += 1.5e5
    run = modes.run(x, np.tile(rest.command[:, None], 5))
    moved = [np.ptp(run.states[model.states.index(f"joint_{k}.angle_rad")]) for k in (1, 2, 3)]

    assert moved[0] == 0.0
    assert moved[1] > 1e-4


@pytest.mark.slow
def test_a_leg_with_its_valves_cut_comes_to_its_stop_and_leaves_it():
    """physics.md 2.3: joint 2 ends at 55 deg.  The valve opens by 0.8 V to one side, then back."""
    plant = PLANTS["crr_leg"]()
    model = design_model(plant)
    rest = leg_placing(joint_axes(plant))(model, {})
    modes, joint = sampled_hybrid(REGIME_MODES["crr_leg"](plant), 2e-3), "joint_2.angle_rad"
    sent = np.tile(rest.command[:, None], (1, 350))
    sent[1, :200] += 0.8
    sent[1, 200:] -= 0.8
    run = modes.run(rest.state, sent)
    angle_deg = np.degrees(run.states[model.states.index(joint)])
    active = [modes.hybrid.modes[k].name for k in run.modes]

    assert rest.unrest < 1e-9
    assert angle_deg[[0, 199]] == pytest.approx([20.0, 55.0], abs=0.1)
    assert "2 at upper stop" in active[199]
    assert angle_deg[-1] < 45.0
    assert "2 at" not in active[-1]
    assert np.ptp(run.states[model.states.index("joint_1.angle_rad")]) == 0.0


def test_a_steady_slide_both_ways_by_place_has_no_drift_but_its_speed():
    """What controllers of the arm are designed on."""
    hybrid = axis_modes(PLANTS["crr_arm"]())

    assert [mode.name for mode in hybrid.modes[:2]] == ["slide - low", "slide - mid"]
    for mode in hybrid.modes:
        rates = dict(zip(mode.state_names, mode.drift / mode.scale, strict=True))
        assert abs(rates.pop("joint.angle_rad", 1.0)) > 0.1
        assert np.abs([*rates.values()]).max() < 1e-8
    with pytest.raises(KeyError, match="no modes to control one axis with for crr_leg; there are"):
        axis_modes(PLANTS["crr_leg"]())


def test_a_choked_fill_is_an_integrator_and_a_choked_vent_a_lag():
    """physics.md 4.3; the vent path that never shuts leaves the fill a little slope."""
    hybrid = standard_modes(PLANTS["soft_joint"]())
    fill, vent = (hybrid[name].A[0, 0] for name in ("fill bellows choked", "vent bellows choked"))

    assert len(hybrid.modes) == 4
    assert abs(fill) < 1e-2
    assert vent == pytest.approx(-3.74, rel=0.01)
    assert len(standard_modes(PLANTS["soft_joint_parametric"]()).modes) == 2


def test_every_plant_with_a_command_has_standard_modes():
    commanded = {name for name, make in PLANTS.items() if make().commands}

    assert commanded == set(STANDARD_MODES)
    assert [has_stops(standard_modes(PLANTS[n]())) for n in ("servo_drive", "crr_arm")] == [
        False,
        True,
    ]


def test_position_alone_does_not_tell_the_pressures_of_a_resting_rig_apart(rig):
    """physics.md 4.2 of the gearbox, here of a mode without motion: nothing moves at all."""
    report = analyse(rig["centred cap subsonic rod side subsonic stick"])

    assert report.observable == 2
    assert report.seen_from[POSITION] == 0
    assert report.seen_from[CAP] == 1
