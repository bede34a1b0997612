"""Windows, noise, priors and the Gauss-Newton fit."""

from dataclasses import replace

import numpy as np
import pytest

from studies.text_of_results import errors_text, windows_text
from workbench.fitting.beyond_noise import whole_beyond_noise
from workbench.fitting.costs import best_of_each, points_costs
from workbench.fitting.errors import Place, plain_ratio, signal_errors
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.noise import measured_noise
from workbench.fitting.problem import fuller, staged
from workbench.fitting.start_states import refit_starts
from workbench.fitting.starts import guessed_states
from workbench.fitting.unknowns import Unknowns, nominal_unknowns
from workbench.fitting.windows import UNSEEN_PENALTY, cut_windows
from workbench.plants import crr_arm, crr_rig, cylinder_bench, servo_drive
from workbench.recording import Recording
from workbench.simulation import simulate

NOISE = {"slide.position_m": 5e-6, "chamber_a.pressure_pa": 500.0, "chamber_b.pressure_pa": 500.0}

NOTHING = Unknowns((), *(np.zeros(0) for _ in range(5)))


@pytest.fixture(scope="module")
def plant():
    return servo_drive().lean()


@pytest.fixture(scope="module")
def recording(plant):
    return sines(plant, NOISE)


def sines(plant, noise):
    """2 s of sines through the dead zone, with sensor noise."""
    time_s = 1e-3 * np.arange(2000)
    u = 4.95 + 0.9 * np.sin(2 * np.pi * 1.1 * time_s) + 0.3 * np.sin(2 * np.pi * 2.7 * time_s)
    run = simulate(plant, Recording("sines", 1e-3, {"valve.command_v": u}))
    rng = np.random.default_rng(5)
    noisy = {n: run[n] + s * rng.standard_normal(len(run)) for n, s in noise.items()}
    return Recording("sines", 1e-3, {"valve.command_v": u, **noisy})


def test_noise_is_found_in_a_moving_recording(plant, recording):
    found = measured_noise([recording], plant.measured)

    for name, sigma in NOISE.items():
        assert found[name] == pytest.approx(sigma, rel=0.3)


def test_given_noise_comes_before_measured_noise(plant, recording):
    given = Recording("given", 1e-3, recording.channels, noise={"slide.position_m": 1e-4})

    assert measured_noise([given], plant.measured)["slide.position_m"] == 1e-4


def test_windows_of_the_true_plant_leave_noise_alone(plant, recording):
    windows = cut_windows(plant, [recording], NOISE)
    fit = refit_starts(windows)

    assert fit.chi2 / windows.count == pytest.approx(1.0, abs=0.1)
    said = windows_text(fit, fit)
    assert said.startswith(f"errors over windows of 0.2 s, {len(windows)} in training, ")
    assert "`compare` takes all windows and weighs by sensor noise alone" in said


def test_windows_do_not_cross_gaps(plant, recording):
    channels = recording.channels
    split = Recording("split", 1e-3, channels, starts=(0, 950))
    windows = cut_windows(plant, [split], NOISE)

    assert all(first + windows.length <= 950 or first >= 950 for first in windows.firsts[0])


def test_missing_samples_have_no_weight(plant, recording):
    channels = {**recording.channels, "slide.position_m": recording["slide.position_m"].copy()}
    channels["slide.position_m"][100:150] = np.nan
    windows = cut_windows(plant, [Recording("holes", 1e-3, channels)], NOISE)

    assert windows.count == 3 * 2000 - 50
    assert refit_starts(windows).chi2 / windows.count == pytest.approx(1.0, abs=0.15)


def test_samples_that_could_not_be_simulated_are_counted_and_left_out_of_the_error():
    rng, n = np.random.default_rng(8), 400
    channels = {
        "chamber.pressure_pa": np.full(n, 3e5),
        "rod.position_m": np.full(n, 0.02),
        "rod.velocity_m_s": np.zeros(n),
        "rod.force_n": 20.0 + 0.2 * rng.standard_normal(n),
    }
    bench = cylinder_bench().lean()
    windows = cut_windows(bench, [Recording("still", 1e-2, channels)], {"rod.force_n": 0.2})
    fit = refit_starts(windows)
    worse = fit.residual.copy()
    worse[:, 4:7] = UNSEEN_PENALTY
    rows = worse.transpose(1, 0, 2).reshape(len(windows), -1)
    short = replace(fit, derivatives=replace(fit.derivatives, residual=rows))

    (whole,), (part,) = (signal_errors(each).values() for each in (fit, short))
    (none,) = signal_errors(refit_starts(windows, {"chamber.area_m2": 1e305})).values()

    assert (whole.left_out, part.left_out) == (0, 3 * windows.length)
    assert whole.left_out_from is None and part.left_out_from == Place("still", pytest.approx(0.8))
    assert part.rmse == pytest.approx(whole.rmse, rel=0.05)
    assert plain_ratio(fit, short) > 1.0
    assert np.isnan(none.rmse) and none.left_out == windows.count == n
    assert "for 60 samples, the first at 0.8 s of still, which" in errors_text(
        {"train": {"rod.force": part}}, {"rod.force": "rod.force_n"}
    )


def test_start_states_near_a_hole_claim_no_more_than_they_know(plant, recording):
    channels = {**recording.channels, "slide.position_m": recording["slide.position_m"].copy()}
    channels["slide.position_m"][480:650] = np.nan
    whole = guessed_states(plant, recording)[0]
    guess, deviation = guessed_states(plant, Recording("holes", 1e-3, channels))
    off = np.abs(guess - whole) / np.maximum(deviation, 1e-12)

    assert off.max() < 5.0
    assert (deviation[0, 500:640] > 0.01).all() and deviation[0, 300] < 1e-4


def test_recordings_of_different_sample_times_are_refused(plant, recording):
    channels = {name: values[::2] for name, values in recording.channels.items()}
    with pytest.raises(ValueError, match="slow has a sample every 2 ms and sines every 1 ms"):
        cut_windows(plant, [recording, Recording("slow", 2e-3, channels)], NOISE)


def test_a_delay_of_zero_is_no_delay(recording):
    late = servo_drive().with_values({"command_delay.delay_s": 5e-3}).lean()
    windows = cut_windows(late, [recording], NOISE)
    plants = [late.with_values({"command_delay.delay_s": d}) for d in (0.0, 1e-9, 5e-3)]
    at_zero, next_to_it, at_five = (windows.simulated([p], windows.start) for p in plants)

    assert np.allclose(at_zero, next_to_it, rtol=1e-6)
    assert not np.allclose(at_zero, at_five, rtol=1e-6)


def test_a_fit_brings_a_wrong_mass_back(plant, recording):
    """Prior 5 %, start 5 % off."""
    wrong = plant.with_values({"slide.mass_kg": 2.22 * 1.05})
    windows = cut_windows(wrong, [recording], NOISE)
    windows = windows.rescaled(fit_windows(windows, NOTHING, iterations=0).residual)
    unknowns = nominal_unknowns(wrong, fixed=[n for n in wrong.values if n != "slide.mass_kg"])
    fit = fit_windows(windows, unknowns, iterations=20)

    assert fit.plant.values["slide.mass_kg"] == pytest.approx(2.22, rel=0.01)


@pytest.mark.parametrize(
    "wrong",
    [
        {"friction.stiction_excess_n": 1.5, "valve_dead_zone.half_width_v": 1.02},
        {"friction.coulomb_force_n": 1.2, "slide.mass_kg": 1.1, "valve.flow_area_m2": 0.97},
    ],
    ids=["dead zone", "mass"],
)
def test_a_fit_that_has_converged_gains_no_more_from_where_it_ended(plant, wrong):
    """Noise that no fit takes away is most of the cost here: 1 % of it is a fifth of the misfit."""
    loud = {name: 10.0 * sigma for name, sigma in NOISE.items()}
    windows = cut_windows(plant, [sines(plant, loud)], loud)
    off = plant.with_values({name: by * plant.values[name] for name, by in wrong.items()})
    unknowns = nominal_unknowns(off, {}, {})

    found = fit_windows(windows.with_plant(off), unknowns, iterations=40)
    again = fit_windows(found.windows, unknowns, found.point, iterations=40)

    assert found.converged
    assert found.cost - again.cost < 0.01 * whole_beyond_noise(windows, found.cost)


def test_a_fit_that_is_cut_short_does_not_say_that_it_has_converged(plant, recording):
    off = plant.with_values({"slide.mass_kg": 1.15 * plant.values["slide.mass_kg"]})
    windows = cut_windows(off, [recording], NOISE)

    found = fit_windows(windows, nominal_unknowns(off, {}, {}), iterations=10)
    again = fit_windows(windows, found.unknowns, found.point, iterations=1)

    assert again.cost < 0.9 * found.cost
    assert not found.converged


def test_what_is_absent_fixed_or_known_is_not_moved(plant):
    unknowns = nominal_unknowns(plant, fixed=["slide.mass_kg"])

    assert "slide.mass_kg" not in unknowns.names
    assert "chamber_a.area_m2" not in unknowns.names
    assert "slide.added_mass_kg" not in unknowns.names
    assert "friction.coulomb_force_n" in unknowns.names


def test_an_unknown_at_a_bound_that_wants_beyond_takes_no_part():
    plant = servo_drive()
    unknowns = nominal_unknowns(plant)
    t = np.zeros(len(unknowns))
    row = unknowns.names.index("command_delay.delay_s")
    pulled = np.zeros(len(unknowns))
    pulled[row] = 1.0  # the cost falls towards negative delays

    assert unknowns.pinned(t, pulled)[row]
    assert not unknowns.pinned(t, -pulled)[row]


def test_each_window_begins_where_it_costs_least(plant, recording):
    windows = cut_windows(plant, [recording], NOISE)
    off = windows.start.copy()
    off[:, ::2] += 3.0 * windows.start_deviation[:, ::2]
    other = 2.0 * windows.start - off
    points = [Point(np.zeros(0), starts) for starts in (off, other)]
    costs = points_costs(windows, NOTHING, points).rows

    best = best_of_each(costs)

    again = points_costs(windows, NOTHING, [best.point]).best
    lowest = np.min([each.by_window for each in costs], axis=0)
    assert again.by_window == pytest.approx(lowest, rel=1e-9)
    assert (best.cost, best.chi2) == pytest.approx((again.cost, again.chi2), rel=1e-9)


def test_an_arm_of_which_the_angle_is_recorded_starts_with_its_gas_and_speed():
    """The rod has no state and no channel: its place follows from the angle."""
    arm = crr_arm().lean()
    command = 5.25 + 1.5 * np.sin(np.arange(400) / 50.0)
    run = simulate(arm, Recording("swing", 1e-3, {arm.commands[0].name: command}))
    seen = Recording("swing", 1e-3, {n: run[n] for n in (*arm.model.commands, *arm.measured)})

    guess = dict(zip(arm.state_list, guessed_states(arm, seen)[0], strict=True))

    for name, tolerance in {"cap.mass_kg": 0.02, "rod_side.mass_kg": 0.02}.items():
        assert guess[name] == pytest.approx(run[name], rel=tolerance), name
    assert guess["cap.pressure_pa"] == pytest.approx(run["cap.pressure_pa"])
    speed = run["joint.velocity_rad_s"]
    error = (guess["joint.velocity_rad_s"] - speed)[10:-10]
    assert np.sqrt(np.mean(error**2)) < 0.1 * np.sqrt(np.mean(speed**2))


@pytest.mark.parametrize("build", [crr_rig, servo_drive], ids=["crr_rig", "servo_drive"])
def test_a_plant_with_more_members_keeps_every_state_of_one_with_fewer(build):
    # The friction of the rescue robot's rig has no bristle unless one of its causes is added.
    whole = build()
    for added in whole.candidates.values():
        plant = staged(whole, added.member)
        richer = fuller(whole, plant, "chamber_leak@cap", "valve_lag")

        assert set(plant.state_list) <= set(richer.state_list), added.name
