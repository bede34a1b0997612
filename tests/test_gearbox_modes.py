"""The gearbox's modes against the corrected formulas of paper 003, entry by entry.

The formulas of physics.md 4.2 stand here in plain numpy, and only here: the package takes every
number from the derivatives of the one model.  Errata that show: E003-2 and E003-3 (signs), E003-4
(flows at the point), E003-6 (contact never pulls), E003-8 (mass by side), E003-9 (force by side).
"""

from dataclasses import replace

import numpy as np
import pytest

from linearize.analysis import analyse
from linearize.equilibrium import operating_point
from linearize.listing import left_out
from linearize.modes import HybridModel, hybrid_modes, linearised, placed_at
from linearize.shift_modes import (
    DIRECTIONS,
    ShiftPoints,
    gearbox_modes,
    side_cut,
)
from linearize.shifting import (
    DETENT,
    FLOWS,
    HEAT,
    POSITION,
    PRESSURES,
    STATES,
    shift_model,
)
from studies.printed_signs import as_printed
from workbench.plants.gearbox import gearbox

KAPPA, R, ROOM_K, AMBIENT_PA = 1.4, 287.0, 293.15, 1.013e5
A1, A2 = np.pi / 4 * 0.05**2, np.pi / 4 * 0.03**2
RING = np.pi / 4 * (0.065**2 - 0.03**2)
STROKE_M, V10, V20 = 12e-3, 15e-6, 40e-6
FINGER_KG = 1.5e-3 / 0.05**2
EXACT = 1e-9


def formulas(state, flow):
    """A, B and the rates of physics.md 4.2 at (p1, p2, x, v) and two flows."""
    p1, p2, x, v = state
    V1, V2 = V10 + A1 * (x + STROKE_M), V20 + A2 * (STROKE_M - x) + RING * STROKE_M
    low = {"mass": 1.0 + FINGER_KG, "face": A2, "damping": 60.0, "level": -(A1 - A2) * AMBIENT_PA}
    high = {
        "mass": 1.35 + FINGER_KG,
        "face": A2 + RING,
        "damping": 100.0,
        "level": (A2 + RING - A1) * AMBIENT_PA,
    }
    side = high if x > 0.0 else low
    if x > 0.0:
        V2 = V20 + (A2 + RING) * (STROKE_M - x)
    face, mass = side["face"], side["mass"]
    p1_dot = (KAPPA * R * ROOM_K * flow[0] - KAPPA * p1 * A1 * v) / V1
    p2_dot = (KAPPA * R * ROOM_K * flow[1] + KAPPA * p2 * face * v) / V2
    push = p1 * A1 - p2 * face + side["level"] - side["damping"] * v
    A = np.array(
        [
            [-KAPPA * A1 * v / V1, 0.0, -A1 / V1 * p1_dot, -KAPPA * A1 * p1 / V1],
            [0.0, KAPPA * face * v / V2, face / V2 * p2_dot, KAPPA * face * p2 / V2],
            [0.0, 0.0, 0.0, 1.0],
            [A1 / mass, -face / mass, 0.0, -side["damping"] / mass],
        ]
    )
    B = np.zeros((4, 2))
    B[0, 0], B[1, 1] = KAPPA * R * ROOM_K / V1, KAPPA * R * ROOM_K / V2
    return A, B, np.array([p1_dot, p2_dot, v, push / mass])


@pytest.fixture(scope="module")
def plant():
    return gearbox()


@pytest.fixture(scope="module")
def hybrid(plant):
    return gearbox_modes(plant, ShiftPoints(velocity_m_s=0.7))


def test_there_are_the_papers_eight_modes_and_one_held_at_neutral(hybrid):
    names = [mode.name for mode in hybrid.modes]

    assert names[0] == "held at Neutral"
    assert set(names[1:]) == {
        f"{side} 1 {one} 2 {two}"
        for side in ("Low side", "High side")
        for one in ("vents", "charges")
        for two in ("vents", "charges")
    }


@pytest.mark.parametrize("velocity_m_s", [0.0, 0.7, -1.3])
def test_every_entry_of_every_mode_is_that_of_the_corrected_formulas(plant, velocity_m_s):
    for mode in gearbox_modes(plant, ShiftPoints(velocity_m_s=velocity_m_s)).modes[1:]:
        A, B, rates = formulas(mode.state, mode.command)

        assert mode.state_names == STATES
        assert pytest.approx(A, rel=EXACT, abs=1e-12) == mode.A, mode.name
        assert pytest.approx(B, rel=EXACT, abs=0.0) == mode.B, mode.name
        assert mode.drift == pytest.approx(rates, rel=EXACT, abs=1e-9), mode.name
        assert np.array_equal(mode.C, np.eye(3, 4))
        assert not mode.D.any()


SHIFT_M = 4e-3  # the reference counts from another place, and keeps below Neutral


@pytest.fixture(scope="module")
def reference():
    """The plant with the numbers of physics.md section 10: V1 = V10 + A1 x, V2 = V20 - A2 x."""
    face1, face2, ring = 1.9e-3, 7e-4, 1e-3
    values = {
        "chamber_1.area_m2": face1,
        "chamber_2.area_m2": face2,
        "chamber_2.second_area_m2": ring,
        "chamber_1.dead_volume_m3": 4e-5 + face1 * (SHIFT_M - STROKE_M),
        "chamber_2.dead_volume_m3": 3e-5 - face2 * (SHIFT_M + STROKE_M) - ring * STROKE_M,
    }
    return shift_model(gearbox().with_values(values))


def test_the_reference_jacobian_comes_out_of_the_plant_with_its_numbers(reference):
    A = reference.jacobians([6e5, 3e5, 2e-3 - SHIFT_M, 0.7], [0.0, 0.0])[0].full()

    expected = [-42.5114, 1.10646e9, -3.64384e7, 23.986, 1.76121e8, 1.02797e7, 1.1875e-3, -4.375e-4]
    found = [*A[0, [0, 2, 3]], *A[1, 1:], *A[3, :2], A[3, 3]]
    assert found == pytest.approx([*expected, -37.5], rel=5e-6)


def test_the_printed_signs_make_a_mode_unstable_that_is_not(reference):
    """Physics.md section 3 below E003-3: +62.7 and -100.2 at 1 and 9 bar, instead of a spring.

    Paper 003 prints a24 with the sign of a chamber that grows with x.  The pressurised chamber 2
    then acts as a negative spring.
    """
    at = dict(zip(STATES, (1e5, 9e5, 2e-3 - SHIFT_M, 0.0), strict=True))
    right = linearised(reference, {}, operating_point(reference, at))
    printed = as_printed(reference, right)

    spring, wrong = (np.sort_complex(np.linalg.eigvals(m.A)) for m in (right, printed))
    assert spring.real == pytest.approx([-18.75, -18.75, 0.0, 0.0], abs=1e-4)
    assert np.abs(spring.imag).max() == pytest.approx(143.0, abs=0.5)
    assert wrong.real == pytest.approx([-100.2, 0.0, 0.0, 62.7], abs=0.1)
    assert np.abs(wrong.imag).max() < 1e-3


def test_the_mass_depends_on_the_side(hybrid):
    low, high = hybrid["Low side 1 vents 2 vents"], hybrid["High side 1 vents 2 vents"]

    assert A1 / low.A[3, 0] == pytest.approx(1.6, rel=EXACT)
    assert A1 / high.A[3, 0] == pytest.approx(1.95, rel=EXACT)


def test_at_rest_the_modes_are_controllable_and_observable_by_all_outputs_only(plant):
    """Physics.md 4.2: position alone leaves one of two pressures that act through one force."""
    for mode in gearbox_modes(plant).modes[1:]:
        quiet = linearised_at_no_flow(plant, mode)
        alone = replace(quiet, C=quiet.C[2:], D=quiet.D[2:], output_names=quiet.output_names[2:])

        assert (analyse(quiet).controllable, analyse(quiet).observable) == (4, 4)
        assert analyse(alone).observable == 3
        assert np.sort(np.abs(analyse(quiet).poles))[:2] == pytest.approx([0.0, 0.0], abs=1e-3)


def linearised_at_no_flow(plant, mode):
    model = shift_model(plant)
    at = dict(zip(mode.state_names, mode.state, strict=True))
    return linearised(model, {}, operating_point(model, {**at, **dict.fromkeys(FLOWS, 0.0)}))


def test_the_reduction_is_a_written_list_that_can_be_undone_line_by_line(plant, hybrid):
    lines = left_out(hybrid).splitlines()
    kept = shift_model(plant, omitted=(HEAT,))

    assert [line.partition(":")[0] for line in lines] == [
        "solenoids",
        "floating_piston",
        "finger",
        "control_chamber.pressure_pa",
        "mass of gas",
        "dry friction",
        "detent",
        "wall heat",
    ]
    assert len(plant.lean().model.states) == 18
    assert len(kept.left_out) == len(lines) - 2
    at = [3e5, 3e5, -3e-3, 0.0]
    track_n = 0.6 * np.sin(2 * np.pi * at[2] / 12e-3) * 300.0 * 0.05 / 0.05
    forces = [1.6 * float(m.f(at, [0.0, 0.0])[0][3]) for m in (kept, hybrid.model)]
    assert forces[0] - forces[1] == pytest.approx(-track_n)


def test_dry_friction_that_is_kept_is_a_constant_of_the_direction(plant):
    """45 N of the main piston and 10 N of the shank below Neutral; 45 and 30 N above it."""
    dry = shift_model(plant, omitted=(DETENT, HEAT))
    cuts = {POSITION: side_cut(dry), **DIRECTIONS}
    placing = placed_at(dict.fromkeys(PRESSURES, 3e5))
    with_it = hybrid_modes(plant, cuts, placing, dry)
    without = hybrid_modes(plant, cuts, placing, shift_model(plant))

    for one, other in zip(with_it.modes, without.modes, strict=True):
        force_n = 55.0 if "Low side" in one.name else 75.0
        mass_kg = 1.6 if "Low side" in one.name else 1.95
        sign = 1.0 if "towards High" in one.name else -1.0

        assert pytest.approx(other.A, rel=EXACT, abs=1e-9) == one.A
        assert mass_kg * (one.drift - other.drift)[3] == pytest.approx(-sign * force_n)


def test_several_points_of_a_side_follow_the_volume_that_it_shrinks(plant):
    cut = side_cut(shift_model(plant), 3)
    first = V10 + A1 * (np.array([part.point for part in cut[:3]]) + STROKE_M)
    second = V20 + (A2 + RING) * (STROKE_M - np.array([part.point for part in cut[3:]]))

    assert first[1:] / first[:-1] == pytest.approx([first[1] / first[0]] * 2, rel=1e-4)
    assert second[1:] / second[:-1] == pytest.approx([second[1] / second[0]] * 2, rel=1e-4)
    assert len(gearbox_modes(plant, pieces=3).modes) == 1 + 6 * 4


def test_more_points_of_a_side_bring_the_modes_nearer_to_the_plant(plant):
    """Largest error of the stiffness to x over the Low side, at the pressures of the mode."""
    errors = [worst_spring(gearbox_modes(plant, pieces=pieces)) for pieces in (1, 2, 4)]

    assert errors[1] < 0.65 * errors[0]
    assert errors[2] < 0.65 * errors[1]


def worst_spring(hybrid: HybridModel) -> float:
    worst, modes = 0.0, [m for m in hybrid.modes if "1 vents 2 vents" in m.name]
    for x in np.linspace(-STROKE_M + 1e-5, -1e-5, 49):
        mode = next(m for m in modes if m.box[POSITION].contains(x))
        exact = formulas([*mode.state[:2], x, 0.0], mode.command)[0][0, 3]
        worst = max(worst, abs(mode.A[0, 3] / exact - 1.0))
    return worst
