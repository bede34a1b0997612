"""Manoeuvres, the loop that rehearses them, the distance of rivals, and what is recommended."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import PLANT_MODELS
from test_diagnosis import bench, coulomb

from studies.demo import DATA
from studies.documents import diagnosis_document
from studies.export import save_next_recording
from studies.text_of_next_recording import next_recording_text
from workbench.comparison.run import read_inputs
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.manoeuvre_choice import least_gain
from workbench.diagnosis.next_recording import next_recording
from workbench.diagnosis.result import DecidedBy, Ranked
from workbench.diagnosis.rivals import distance
from workbench.diagnosis.showing import showing
from workbench.effect import Kind
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.linearised import Linearised, Point
from workbench.fitting.noise import measured_noise
from workbench.fitting.problem import Problem
from workbench.fitting.unknowns import nominal_unknowns
from workbench.fitting.windows import cut_windows
from workbench.manoeuvres.library import LIBRARY, position_triangle
from workbench.manoeuvres.limits import Drive, limits_of
from workbench.manoeuvres.play import odd_multisine
from workbench.manoeuvres.rehearse import rehearse, speed_maps
from workbench.reading import read_recording
from workbench.recording import Recording
from workbench.rig import load_rig

PLACE, COMMAND = "slide.position_m", "valve.command_v"
A, B = "chamber_a.pressure_pa", "chamber_b.pressure_pa"
SHORT = tuple(m for m in LIBRARY if "slowly against" in m.words or "multisine about" in m.words)


def recorded_of(plant, n=2000):
    """A recording that moves every output of a plant a little, between its stops; made up."""
    wave = np.sin(np.linspace(0.0, 6.0, n))
    channels = {s.name: s.nominal + 0.1 * wave for s in (*plant.commands, *plant.measured_inputs)}
    for name in plant.measured:
        middle, size = (3e5, 1e5) if name.endswith("pressure_pa") else (0.1, 0.05)
        middle = 0.5 if name.endswith("angle_rad") else middle
        channels[name] = middle + size * wave
    return Recording("made up", 1e-3, channels)


@pytest.fixture(params=["servo_drive", "crr_leg", "servo_reservoir", "soft_joint", "gearbox"])
def limits(request):
    plant = PLANT_MODELS[request.param]
    return limits_of(plant, [recorded_of(plant)])


def library_of(limits):
    return [each for each in LIBRARY if each.drive is limits.drive]


@pytest.mark.parametrize(
    ("name", "drive", "axes"),
    [
        ("servo_drive", Drive.POSITION, 1),
        ("crr_leg", Drive.POSITION, 3),
        ("servo_reservoir", Drive.PRESSURE, 0),
        ("gearbox", Drive.SWITCHED, 0),
    ],
)
def test_limits_tell_how_commands_move_a_plant(name, drive, axes):
    plant = PLANT_MODELS[name]
    found = limits_of(plant, [recorded_of(plant)])

    assert (found.drive, len(found.axes)) == (drive, axes)


def test_every_manoeuvre_keeps_to_ranges_of_commands_and_of_recorded_places(
    limits,
):
    assert len(library_of(limits)) >= 4
    for each in library_of(limits):
        play = each.make(limits, 1.0)

        assert play.commands.shape == (len(limits.commands), limits.samples)
        for signal, row in zip(limits.commands, play.commands, strict=True):
            given = row[np.isfinite(row)]
            assert np.all((given >= signal.lower) & (given <= signal.upper)), each.words
            assert not signal.levels or set(given) <= set(signal.levels), each.words
            assert not signal.levels or np.all(given[:50] == min(signal.levels)), each.words
        if play.looped:
            for axis, row in zip(limits.axes, play.reference, strict=True):
                assert row[0] == pytest.approx(axis.start)
                low, high = axis.stops if each.ends else (axis.low, axis.high)
                room = 0.11 * (axis.high - axis.low) if each.ends else 1e-12
                assert not np.any((row < low - room) | (row > high + room)), each.words


def test_every_manoeuvre_moves_something_and_is_the_same_every_time(limits):
    for each in library_of(limits):
        one, again = each.make(limits, 1.0), each.make(limits, 1.0)

        assert np.array_equal(one.commands, again.commands, equal_nan=True), each.words
        moved = one.reference if one.looped else one.commands
        assert np.nanmax(moved) > np.nanmin(moved), each.words


def moved_by(play):
    """Largest change in a sample behind the first two seconds, in which it leaves the start."""
    rows = (play.reference if play.looped else play.commands)[:, 2000:]
    return np.nanmax(np.abs(np.diff(rows)))  # NaN while a loop waits


def test_a_smaller_share_makes_a_smaller_manoeuvre(limits):
    for each in library_of(limits):
        if limits.drive is Drive.SWITCHED:
            continue
        full, less = each.make(limits, 1.0), each.make(limits, 0.35)
        assert moved_by(less) < moved_by(full), each.words


def test_an_odd_multisine_has_odd_lines_alone():
    time_s = np.arange(10_000) * 1e-3
    lines = np.abs(np.fft.rfft(odd_multisine(time_s, 0.3, 8))) / 5000
    places = np.flatnonzero(lines > 1e-6)

    assert np.array_equal(places, 3 * (2 * np.arange(8) + 1))  # 0.3 Hz is line 3 of 10 s


def test_what_breaks_a_limit_is_said():
    plant = PLANT_MODELS["servo_drive"]
    found = limits_of(plant, [recorded_of(plant)])
    sound = Recording("sound", 1e-3, {PLACE: np.full(100, 0.1), A: np.full(100, 3e5)})

    def with_(name, values):
        return replace(sound, channels={**sound.channels, name: values})

    assert found.broken_by(sound, ends=False) == ""
    assert "pressure above" in found.broken_by(with_(A, np.full(100, 9e5)), ends=False)
    assert "pressure above" in found.broken_by(with_(A, np.full(100, np.nan)), ends=False)
    assert "leaves" in found.broken_by(with_(PLACE, np.full(100, np.nan)), ends=False)
    far = with_(PLACE, np.full(100, 0.2))
    assert "leaves" in found.broken_by(far, ends=False)
    assert found.broken_by(far, ends=True) == ""
    beyond = with_(PLACE, np.full(100, 0.3))
    assert "leaves" in found.broken_by(beyond, ends=True)
    assert "faster" in found.broken_by(with_(PLACE, np.linspace(0.06, 0.14, 100)), ends=False)


def test_the_distance_is_what_the_best_parameters_and_starts_leave():
    """Against plain least squares over parameters and start states at once."""
    rng = np.random.default_rng(3)
    n, rows, n_x, n_p = 4, 30, 2, 3
    r, J_p = rng.standard_normal((n, rows)), rng.standard_normal((n, rows, n_p))
    basis, triangle = np.linalg.qr(rng.standard_normal((n, rows, n_x)))
    at = Linearised(Point(np.zeros(n_p), np.zeros((n_x, n))), r, J_p, basis, triangle)
    precision = np.diag([1.0, 4.0, 9.0])

    starts = np.zeros((n * rows, n * n_x))
    for k in range(n):
        starts[k * rows : (k + 1) * rows, k * n_x : (k + 1) * n_x] = basis[k]
    held = np.hstack([np.diag([1.0, 2.0, 3.0]), np.zeros((n_p, n * n_x))])
    whole = np.vstack([np.hstack([J_p.reshape(-1, n_p), starts]), held])
    target = np.concatenate([r.ravel(), np.zeros(n_p)])
    best = np.linalg.lstsq(whole, target, rcond=None)[0]

    expected = float(np.sum((target - whole @ best) ** 2))
    assert distance(at, precision, np.full(n, 1e9)) == pytest.approx(expected, rel=1e-9)
    assert distance(at, precision, np.full(n, 1.0)) <= n  # no window counts for more


@pytest.fixture(scope="module")
def demo_rig():
    return load_rig(DATA / "rig.toml")


@pytest.fixture(scope="module")
def rivals(demo_rig):
    """A force and a sensor offset that look alike: 15 N on the slide are 30 kPa in chamber a."""
    recording = read_recording(demo_rig, DATA / "train.csv").part(0, 2000)
    sizes = {"constant_force": 15.0, "sensor_offset@chamber_a.pressure": 3e4}
    plant = demo_rig.fit_for(recording).lean(keep=sizes)
    windows = cut_windows(plant, [recording], measured_noise([recording], plant.measured))
    windows = windows.rescaled(windows.residuals([plant], windows.start)[0])
    return {name: rival(windows, name, size) for name, size in sizes.items()}


def rival(windows, name, size):
    """A fit of all that is uncertain and of one cause, which is then given a size."""
    cause = windows.plant.candidates[name]
    unknowns = nominal_unknowns(windows.plant, added=[cause])
    fit = fit_windows(windows, unknowns, iterations=1)
    values = {**fit.plant.values, cause.strength: size}
    return replace(fit, point=replace(fit.point, t=unknowns.scaled(values)))


@pytest.fixture(scope="module")
def asked(rivals):
    return next_recording(rivals, SHORT)


def test_the_loop_follows_a_slow_triangle_in_spite_of_the_dead_zone(rivals):
    fit = next(iter(rivals.values()))
    limits = limits_of(fit.plant, fit.windows.recordings)
    play = position_triangle(limits, 1.0, 9.0)
    (run,) = rehearse(fit, limits, [play], speed_maps(fit, limits))
    (axis,) = limits.axes
    late = limits.time_s > 1.5

    error = (run[PLACE] - play.reference[0])[late]
    assert np.sqrt(np.mean(error**2)) < 0.03 * (axis.high - axis.low)
    assert np.isfinite(run[COMMAND]).all()


def test_a_force_and_a_sensor_offset_can_be_told_apart(rivals, asked):
    assert asked.what.startswith(tuple(each.words for each in SHORT))
    assert asked.separates == tuple(rivals)
    assert asked.expected_gain > 10.0
    assert asked.alike == ()


def test_the_recommended_recording_keeps_the_limits_for_every_rival(rivals, asked):
    fit = next(iter(rivals.values()))
    limits = limits_of(fit.plant, fit.windows.recordings)

    assert list(asked.predicted) == list(rivals)
    ends = any(each.ends and asked.what.startswith(each.words) for each in SHORT)
    for run in asked.predicted.values():
        assert limits.broken_by(run, ends) == ""


def test_nothing_is_recommended_for_rivals_that_are_the_same(rivals):
    fit = next(iter(rivals.values()))

    assert next_recording({"one": fit, "same": fit}, SHORT[:1]) is None
    with pytest.raises(ValueError, match="at least two"):
        next_recording({"one": fit})


def test_enough_gain_passes_the_judge_in_eight_of_ten():
    z = np.random.default_rng(2).standard_normal(100_000)
    for more, samples in ((0, 1.0), (1, 300.0), (2, 300.0)):
        least = least_gain(more, samples)
        passes = least + 2.0 * np.sqrt(least) * z > 4.0 + more * np.log(samples)
        assert np.mean(passes) == pytest.approx(0.8, abs=0.01)


def test_an_effect_that_was_not_shown_gets_the_manoeuvre_that_shows_it(demo_rig, rivals):
    base = rivals["constant_force"]
    name = "sensor_offset@chamber_a.pressure"
    whole = demo_rig.fit_for(base.windows.recordings[0])
    problem = Problem(demo_rig, whole, (), base, None)
    row = Ranked(whole.candidates[name], Kind.EFFECT, {}, 0.0, 0.0, (), 0.0, DecidedBy.SCAN,
                 False, (), visible_from=5.0)  # fmt: skip

    asked = showing(problem, [row], SHORT)

    assert asked.separates == ("nothing", name)
    assert asked.what.startswith(tuple(each.words for each in SHORT))
    assert asked.expected_gain >= least_gain(1)
    assert asked.alike == ()
    assert showing(problem, [replace(row, visible_from=0.5)], SHORT) is None


@pytest.mark.filterwarnings("ignore:.*did you mean 'reference")
def test_commands_read_back_as_the_rig_reads_its_files(demo_rig, asked, tmp_path):
    save_next_recording(demo_rig, asked, tmp_path, "a command")

    head = (tmp_path / "next_recording.csv").read_text().splitlines()[0]
    back = read_inputs(demo_rig, tmp_path / "next_recording.csv")
    first = asked.predicted[asked.separates[0]]
    assert head.split(",")[:2] == ["time_s", "command_V"]
    assert back.sample_time_s == pytest.approx(first.sample_time_s)
    np.testing.assert_allclose(back[COMMAND], first[COMMAND], rtol=1e-9)
    for ending in (".pdf", ".svg", "_how.txt"):
        assert (tmp_path / f"next_recording{ending}").stat().st_size > 1000


def test_text_says_what_to_record_and_what_it_is_expected_to_bring(asked):
    said = next_recording_text(replace(asked, alike=(("one", "other"),)))

    assert said.startswith(f"next recording: {asked.what}\nit tells apart constant_force, ")
    assert "of chi2 if nothing more is missing where it goes; one and other stay alike" in said


def test_a_bench_that_cannot_be_commanded_gets_advice_in_words():
    rig = load_rig(
        'name = "bench"\nplant = "cylinder_bench"\n[values]\n"chamber.area" = "519 mm^2"\n'
    )
    found = diagnose(rig, [bench(1, coulomb)])  # nothing held out: a tie at most
    asked = found.next_recording

    assert asked.what == found.ranking[0].candidate.cause.shown_by
    assert asked.separates[0] == found.ranking[0].candidate.name
    document = diagnosis_document(found, {})["next_recording"]
    assert document["expected_gain"] is None
    assert document["separates"] == list(asked.separates)
