"""Corners of fits and rankings: silent outputs, single windows, narrow bounds, what a rig holds."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_diagnosis import bench, coulomb

from workbench.diagnosis.ranking import _reason_not_asked
from workbench.diagnosis.refit import bounded_error, refit_from_priors, surplus
from workbench.diagnosis.rough import with_shape
from workbench.diagnosis.scan import scan_from_priors, sizes_to_try
from workbench.effects.forces import EndCushion
from workbench.fitting.errors import plain_chance, plain_ratio
from workbench.fitting.gauss_newton import Fit
from workbench.fitting.linearised import parameter_steps
from workbench.fitting.problem import pose
from workbench.fitting.unknowns import Unknowns, nominal_unknowns
from workbench.fitting.window_length import window_length_s
from workbench.law_scales import scales
from workbench.recording import Recording
from workbench.recordings import chamber_decay
from workbench.rig import default_rig, load_rig
from workbench.rig_laws import law_terms, with_laws

DRIVE = default_rig("servo_drive")
PRESSURE = "chamber.pressure_pa"


@dataclass(frozen=True)
class Errors:
    """What of a fit tells its errors."""

    windows: SimpleNamespace
    residual: np.ndarray
    squares = Fit.squares


def errors(size: float, windows: int = 4) -> Errors:
    """A fit whose residual is as large everywhere; nothing is recorded of its third output."""
    measured, residual = np.zeros((3, windows, 10)), np.full((3, windows, 10), size)
    measured[2], residual[2] = np.nan, 0.0
    cut = SimpleNamespace(
        measured=measured,
        scale=np.ones((3, windows)),
        weight=1.0 * np.isfinite(measured),
        correlation=np.ones((3, windows)),
    )
    return Errors(cut, residual)


def test_an_output_of_which_nothing_is_recorded_has_no_say_in_the_plain_error():
    assert plain_ratio(errors(1.0), errors(2.0)) == pytest.approx(4.0)


def test_a_plain_error_that_hangs_on_one_window_is_known_no_better_than_that_window():
    """Of four windows one is spoilt: without it the ratio is 1, without any other it is 18/3."""
    before, spoilt, alike = errors(1.0), errors(1.0), errors(1.1)
    spoilt.residual[0, 2] = 4.0
    spoilt.residual[1, 2] = 4.0

    assert plain_ratio(before, spoilt) == pytest.approx(19.0 / 4.0)
    assert plain_chance(before, spoilt) == pytest.approx(0.75 * np.log(6.0))
    assert plain_chance(before, alike) == pytest.approx(0.0, abs=1e-12)
    assert plain_chance(errors(1.0, windows=1), errors(2.0, windows=1)) == 0.0
    assert np.isnan(plain_chance(before, None))


def test_one_held_out_window_says_nothing_of_chance():
    assert surplus(errors(0.5, windows=1), errors(0.6, windows=1)) == 0.0


def test_a_held_out_window_counts_no_more_than_an_outlying_one_of_its_recorded_samples():
    """Of output 1 every other sample is missing; 9 n / tau is all that a window may count."""
    found = errors(1.0)
    found.windows.measured[1, :, ::2], found.residual[1, :, ::2] = np.nan, 0.0
    found.windows.weight = 1.0 * np.isfinite(found.windows.measured)
    found.windows.correlation[1] = 2.5
    plain = 4 * (10 + 5)
    found.residual[:2, 2] *= 2.9  # squared 8.41: output 0 keeps it, of output 1 it is cut

    assert bounded_error(found) == pytest.approx(plain - 15 + 84.1 + 9 * 5 / 2.5)
    found.residual[:2, 2] *= 10.0
    assert bounded_error(found) == pytest.approx(plain - 15 + 90 + 9 * 5 / 2.5)


def decay(seconds: float) -> Recording:
    t = 0.1 * np.arange(round(seconds / 0.1))
    return Recording("decay", 0.1, {PRESSURE: 8e5 * np.exp(-t / 2000.0)}, {PRESSURE: 100.0})


@pytest.mark.parametrize("seconds", [19, 21])
def test_a_short_held_out_recording_is_no_stub_beside_a_long_training(seconds):
    plant = chamber_decay.rig().plant.lean()

    assert window_length_s(plant, [decay(60)], [decay(seconds)]) == pytest.approx(seconds)


def test_a_step_ends_where_the_bounds_end():
    narrow = Unknowns(
        ("a",), np.array([0.5]), np.array([5.0]), np.zeros(1), np.ones(1), np.ones(1)
    )  # fmt: skip
    for t in (0.0, 0.06, -0.06):
        (step,) = parameter_steps(narrow, np.array([t]))
        made = (narrow.values(np.array([t + step]))["a"] - 0.5) / 5.0 - t

        assert step != 0.0
        assert made == pytest.approx(step, rel=1e-12)


def test_what_the_rig_says_of_a_tolerated_delay_is_heard():
    tolerated = next(c for c in DRIVE.plant.candidates.values() if c.cause.tolerated)
    surer = nominal_unknowns(DRIVE.plant, {tolerated.strength: 1e-5})
    none = nominal_unknowns(DRIVE.plant, {tolerated.strength: 0.0})

    assert surer.scale[surer.names.index(tolerated.strength)] == 1e-5
    assert tolerated.strength not in none.names


def test_a_shift_of_what_has_no_uncertainty_says_so():
    rig = load_rig('plant = "servo_drive"\n[uncertainty]\n"slide.mass" = "0 kg"\n')
    unknowns = nominal_unknowns(rig.plant, rig.deviations, rig.fixed)
    problem = SimpleNamespace(whole=rig.plant, rig=rig, base=SimpleNamespace(unknowns=unknowns))

    said = _reason_not_asked(problem, rig.plant.candidates["added_mass"])

    assert said == "not applicable: slide.mass has no uncertainty"


def test_a_shape_that_the_rig_fixes_is_neither_scanned_nor_held_elsewhere():
    stiction = DRIVE.plant.candidates["stiction"]
    (shape,) = (f"{stiction.member}.{key}" for key in stiction.cause.shapes)
    rig = load_rig('plant = "servo_drive"\n[fixed]\nnames = ["friction.stribeck_velocity"]\n')
    unknowns = nominal_unknowns(rig.plant, fixed=rig.fixed)
    free, fixed = (
        with_shape(SimpleNamespace(rig=each), unknowns, {shape: 0.0123}).held
        for each in (DRIVE, rig)
    )

    assert shape in rig.fixed
    assert any(shape in trial for trial in sizes_to_try(rig.plant, stiction))
    assert not any(shape in trial for trial in sizes_to_try(rig.plant, stiction, rig.fixed))
    assert free[shape] == 0.0123 and shape not in fixed


@pytest.mark.parametrize("order", [1, -1])
def test_terms_of_a_law_have_sizes_where_sensors_take_turns_or_are_silent(order):
    n = 400
    rows = np.arange(n) % 2 == 0
    channels = {
        "slide.position_m": np.linspace(0.1, 0.2, n),
        "chamber_a.pressure_pa": np.where(rows, 6e5, np.nan),
        "chamber_b.pressure_pa": np.where(rows, np.nan, 4e5),
    }
    silent = dict.fromkeys(channels, np.full(n, np.nan))
    recordings = [Recording("a", 1e-3, channels), Recording("b", 1e-3, silent)][::order]
    plant = with_laws(DRIVE.plant, [*law_terms(DRIVE.plant)])
    laws = [effect for effect in plant.effects if effect.name.startswith("law[")]

    found = scales(laws, recordings)

    assert all(np.isfinite(value) and value > 0.0 for value in found.values())
    assert found["law[dp]@slide.pressure_pa"] == pytest.approx(2e5)
    assert found["law[sign v dp]@slide.stroke_m"] == pytest.approx(0.1)
    plant.with_values(found)


@pytest.mark.parametrize(
    ("plant", "longest_m"), [("servo_drive", 0.03), ("crr_arm", 0.015), ("gearbox", 0.008)]
)
def test_no_cushion_is_tried_that_would_be_viscous_friction(plant, longest_m):
    """Of 24 mm in a gearbox 15 at either end are the whole stroke."""
    plant = load_rig(f'plant = "{plant}"\n').plant
    cushion = plant.candidates["end_cushion"]
    stroke_m = plant.values["end_cushion.stroke_m"]

    lengths_m = {each["end_cushion.length_m"] for each in sizes_to_try(plant, cushion)}

    assert max(lengths_m) == longest_m < 0.5 * stroke_m


@pytest.mark.parametrize(
    ("shapes", "tried"), [({}, {}), ({"lower_m": (0.0, 0.01), "length_m": (0.008, 9.0)},) * 2]
)
def test_a_cushion_of_ones_own_has_the_shapes_of_its_cause(shapes, tried):
    """It may have none, or others than the length."""
    (cause,) = EndCushion.causes
    cushion = EndCushion(name="mine", body="slide")
    fitting = {**tried, "length_m": (0.008,)} if tried else {}

    assert cushion.shapes_of(replace(cause, shapes=shapes)) == fitting


@pytest.mark.parametrize("fixed", ["", '[fixed]\nnames = ["end_cushion.length"]\n'])
def test_a_cushion_whose_length_is_not_scanned_keeps_the_one_of_its_rig(fixed):
    """On the stroke of a valve none that is tried fits; where the rig fixes one no other is."""
    stroke = '"end_cushion.stroke" = "12 mm"\n' * (not fixed)
    values = f'[values]\n{stroke}"end_cushion.length" = "6 mm"\n'
    rig = load_rig(f'plant = "servo_drive"\n{values}{fixed}')
    cushion = rig.plant.candidates["end_cushion"]

    trials = sizes_to_try(rig.plant, cushion, rig.fixed)

    assert trials and all([*trial] == [cushion.strength] for trial in trials)


def test_a_refit_from_the_priors_needs_no_shape_that_was_not_scanned():
    values = '[values]\n"chamber.area" = "518.7 mm^2"\n'
    rig = load_rig(f'plant = "cylinder_bench"\n{values}[fixed]\nnames = ["friction.wavelength"]\n')
    problem = pose(rig, [bench(1, coulomb)])
    wavy = (p for p in scan_from_priors(problem) if p.candidate.name == "friction_position")
    (profile,) = wavy

    found = refit_from_priors(problem, profile)

    assert found.fit.windows.plant.values["friction.wavelength_m"] == pytest.approx(
        rig.plant.values["friction.wavelength_m"]
    )


def test_a_recording_without_measurements_is_not_held_out():
    """Of a vessel it was a division by zero, of a drive it silently refused every effect."""
    empty = bench(2, coulomb)
    empty["rod.force_n"][:] = np.nan

    with pytest.raises(ValueError, match=f"{empty.name}: no output is recorded in what is held"):
        pose(load_rig('plant = "cylinder_bench"'), [bench(1, coulomb)], [empty])
