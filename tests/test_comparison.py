"""Comparison of a plant with its recordings: errors by horizon, regimes, worst windows."""

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from studies.documents import comparison_document
from studies.figures.comparison import comparison_figures, overlay_figure
from studies.figures.style import save
from studies.text_of_comparison import comparison_text
from workbench.comparison import compare
from workbench.comparison.compare import (
    FREE_RUN,
    ONE_STEP,
    PLAIN,
    WINDOW,
    Comparison,
)
from workbench.comparison.deviation import ShiftDeviation
from workbench.comparison.horizons import lost
from workbench.comparison.regimes import regimes, shares
from workbench.comparison.run import simulate
from workbench.errors import InputError
from workbench.recording import Recording
from workbench.rig import default_rig

DT = 1e-3
POSITION, PRESSURE = "slide.position_m", "chamber_a.pressure_pa"
NOISE = {POSITION: 5e-6, PRESSURE: 400.0, "chamber_b.pressure_pa": 400.0}


def commands(n=600):
    """Out, a rest with the valve closed, and back."""
    command = np.full(n, 4.95)
    command[50:200], command[400:550] = 6.0, 3.9
    return Recording("manoeuvre", DT, {"valve.command_v": command})


def measured(rig, times=1):
    """The rig's outputs under the commands, so many times, with seeded noise, as a recording."""
    once = commands()
    played = {name: np.tile(values, times) for name, values in once.channels.items()}
    clean, rng = simulate(rig, replace(once, channels=played)), np.random.default_rng(3)
    noisy = {n: clean[n] + s * rng.standard_normal(len(clean)) for n, s in NOISE.items()}
    kept = {"valve.command_v": clean["valve.command_v"], **noisy}
    return replace(clean, channels=kept, noise=NOISE)


@pytest.fixture(scope="module")
def drive():
    return default_rig("servo_drive")


@pytest.fixture(scope="module")
def recording(drive):
    return measured(drive)


@pytest.fixture(scope="module")
def heavy(drive):
    """The same rig, believed to be twice as heavy."""
    return replace(drive, plant=drive.plant.with_values({"slide.mass_kg": 4.44}))


@pytest.fixture(scope="module")
def good(drive, recording):
    return compare(drive, [recording]).recordings[0]


@pytest.fixture(scope="module")
def bad(heavy, recording):
    return compare(heavy, [recording]).recordings[0]


def test_the_plant_that_made_a_recording_explains_it_but_for_noise(good):
    for horizon in (ONE_STEP, WINDOW, FREE_RUN):
        assert good.errors[horizon][PRESSURE].rmse < 3 * NOISE[PRESSURE]


def test_a_wrong_mass_shows_at_every_horizon_and_most_in_the_free_run(good, bad):
    for horizon in (ONE_STEP, WINDOW, FREE_RUN):
        assert bad.errors[horizon][PRESSURE].rmse > 1.2 * good.errors[horizon][PRESSURE].rmse

    assert bad.errors[FREE_RUN][POSITION].rmse > bad.errors[ONE_STEP][POSITION].rmse


def test_a_friction_that_is_too_large_shows_where_the_slide_moves(drive, recording):
    slow = replace(drive, plant=drive.plant.with_values({"friction.viscous_n_s_m": 90.0}))
    found = compare(slow, [recording]).recordings[0]
    share = {regime.name: regime for regime in found.by_regime}

    assert share["moving forward"].share_of_error > share["moving forward"].share_of_time


def test_the_worst_windows_lie_inside_the_recording_worst_first(bad):
    found = [span.share_of_error for span in bad.worst]

    assert found == sorted(found, reverse=True)
    assert all(0.0 <= span.start_s < span.end_s <= 0.6 + 1e-9 for span in bad.worst)


def test_traces_have_the_length_of_the_recording(good):
    assert {len(row) for rows in good.simulated.values() for row in rows.values()} == {600}


def test_the_squared_error_over_that_of_noise_stands_in_table_and_document(drive, bad):
    comparison = Comparison(drive.name, (bad,))
    (document,) = comparison_document(comparison)["recordings"]
    said = comparison_text(comparison)

    heavy = (bad.errors[FREE_RUN][POSITION].rmse / NOISE[POSITION]) ** 2
    assert document["errors"][FREE_RUN]["slide.position"]["chi2_per_sample"] == pytest.approx(heavy)
    (row,) = [line for line in said.splitlines() if re.match(r"slide\.position +free run", line)]
    assert row.split()[-1] == f"{heavy:.3g}"


def test_the_valve_is_closed_inside_its_dead_zone(drive, recording):
    plant = drive.fit_for(recording).lean()

    found = regimes(plant, recording)

    closed = found["valve closed"]
    assert closed[:50].all() and closed[210:390].all()
    assert not closed[60:190].any()
    assert found["valve open above 4.95 V"][60:190].all()


def test_valve_sides_and_directions_part_the_time(drive, recording):
    found = regimes(drive.fit_for(recording).lean(), recording)

    names = ("valve closed", "valve open above 4.95 V", "valve open below 4.95 V")
    sides = sum(found[name].astype(int) for name in names)
    ways = sum(found[n].astype(int) for n in ("at rest", "moving forward", "moving backward"))
    assert (sides == 1).all() and (ways == 1).all()


def test_a_change_of_direction_is_a_reversal(drive, recording):
    found = regimes(drive.fit_for(recording).lean(), recording)

    assert "reversal" in found
    assert not found["reversal"][:60].any()


def test_shares_of_regimes_come_largest_first():
    chosen = {"a": np.array([True, False, False]), "b": np.array([False, True, True])}

    assert shares(chosen, np.array([1.0, 3.0, np.nan])) == {"b": 0.75, "a": 0.25}


def test_pieces_of_a_split_recording_start_anew(drive, recording):
    split = replace(recording, starts=(0, 300))

    found = compare(drive, [split]).recordings[0]

    assert found.errors[FREE_RUN][PRESSURE].rmse < 10 * NOISE[PRESSURE]
    assert found.notes[0].startswith("2 pieces stand one behind the other, from 0, 0.3 s on")


def test_a_recording_shorter_than_a_window_says_so(drive, recording):
    found = compare(drive, [recording.part(0, 60)]).recordings[0]

    assert WINDOW not in found.errors
    assert "window" in found.notes[0]
    assert "windows of" not in comparison_text(Comparison(drive.name, (found,)))


def test_a_plant_without_states_is_compared_sample_by_sample():
    bench = default_rig("cylinder_bench")
    t = DT * np.arange(400)
    channels = {
        "chamber.pressure_pa": np.full(400, 3e5),
        "rod.position_m": 0.02 + 0.01 * np.sin(9 * t),
        "rod.velocity_m_s": 0.09 * np.cos(9 * t),
        "rod.force_n": 20.0 + np.random.default_rng(1).standard_normal(400),
    }

    found = compare(bench, [Recording("bench", DT, channels)]).recordings[0]

    assert set(found.errors) == {PLAIN}
    assert "worst windows shaded" in overlay_figure(found).get_suptitle()
    assert "shaded" not in overlay_figure(replace(found, worst=())).get_suptitle()


def test_a_run_without_the_command_is_refused(drive):
    with pytest.raises(InputError, match=r"servo_drive needs valve\.command"):
        simulate(drive, Recording("empty", DT, {"supply.pressure_pa": np.full(10, 7e5)}))


def test_the_document_holds_noise_regimes_shifts_and_whiteness(drive, bad):
    document = comparison_document(Comparison(drive.name, (bad,)))
    (found,) = json.loads(json.dumps(document, allow_nan=False))["recordings"]

    assert found["noise"]["chamber_a.pressure"] == {
        "value": 400.0, "unit": "Pa", "from": "given with the recording",
    }  # fmt: skip
    assert found["judged_on"] == WINDOW and found["shifts"] == []
    assert found["window_s"] == 0.2
    assert ", windows of 0.2 s" in comparison_text(Comparison(drive.name, (bad,)))
    assert {"regime", "share_of_error", "share_of_time"} == set(found["by_regime"][0])
    assert {"start_s", "end_s", "share_of_error"} == set(found["worst"][0])
    assert 0.0 <= found["lags_outside_band"]["slide.position"] <= 1.0


def test_a_recording_of_gear_shifts_prints_the_table_of_paper_003(bad):
    cases = (
        ShiftDeviation("N to H", 0.1, 0.1203, {PRESSURE: 0.0429, POSITION: 0.045}),
        ShiftDeviation("H to N", 0.5, 0.54, {PRESSURE: 0.1003, POSITION: float("nan")}),
    )
    gearbox = replace(bad, shifts=cases)

    said = comparison_text(Comparison("gearbox", (gearbox,))).splitlines()
    (document,) = comparison_document(Comparison("gearbox", (gearbox,)))["recordings"]

    (first,) = (k for k, line in enumerate(said) if line.startswith("deviation of the shift"))
    rows = [line.split("  ") for line in said[first + 1 : first + 4]]
    cells = [[cell.strip() for cell in row if cell.strip()] for row in rows]
    assert cells[0] == ["N to H", "0.100 s", "20.3 ms", "4.29 %", "4.50 %"]
    assert cells[1] == ["H to N", "0.500 s", "40.0 ms", "10.03 %", "-"]
    assert cells[2] == ["mean", "-", "-", "7.16 %", "4.50 %"]
    assert document["shifts"][0]["deviation"] == {
        "chamber_a.pressure": 0.0429, "slide.position": 0.045,
    }  # fmt: skip
    assert document["shifts"][1]["deviation"]["slide.position"] is None


def test_every_figure_of_a_comparison_has_axes_with_units(drive, bad, tmp_path):
    figures = comparison_figures(Comparison(drive.name, (bad,)))

    kinds = "comparison", "regimes", "error_over_motion", "error_over_command", "residuals"
    assert list(figures) == [f"{kind}_manoeuvre" for kind in kinds]
    for name, figure in figures.items():
        shown = [axes for axes in figure.axes if axes.get_visible()]
        words = [{axes.get_xlabel(), axes.get_ylabel()} - {""} for axes in shown]
        assert all(words), name
        assert all(re.search(r"\(.+\)$", word) for some in words for word in some), name
        save(figure, tmp_path / name, "workbench compare")


def test_the_table_beside_a_map_holds_its_cells(drive, bad, tmp_path):
    figures = comparison_figures(Comparison(drive.name, (bad,)))
    save(figures["error_over_command_manoeuvre"], tmp_path / "map", "workbench compare")

    (drawn,) = (each for each in bad.over_command if each.output == PRESSURE)
    with (tmp_path / "map.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["panel"] == "chamber a pressure"]
    assert len(rows) == np.isfinite(drawn.rms).sum() > 3
    assert max(float(row["curve"]) for row in rows) == pytest.approx(
        1e-5 * np.nanmax(drawn.rms), rel=1e-3
    )


def test_without_position_and_commands_there_are_fewer_maps():
    chamber = default_rig("closed_chamber")
    pressure_pa = np.linspace(5e5, 4.9e5, 400) + 500 * np.random.default_rng(2).standard_normal(400)
    recording = Recording("decay", DT, {"chamber.pressure_pa": pressure_pa})

    found = compare(chamber, [recording])

    assert set(comparison_figures(found)) == {"comparison_decay", "residuals_decay"}
    (late,) = compare(chamber, [replace(recording, begins_s=1234.5)]).recordings
    said = "times count from the first sample, at 1234.5 s in its file"
    assert said in late.notes and said not in found.recordings[0].notes


def test_a_plant_with_one_state_is_compared_over_all_horizons():
    joint, n = default_rig("soft_joint"), 400
    commands = Recording("fill", 2.5e-3, {"valve.pwm": np.repeat([0.5, 0.7, 0.5, 0.3], n // 4)})
    clean = simulate(joint, commands)
    noisy = clean["bellows.pressure_pa"] + 1e3 * np.random.default_rng(4).standard_normal(n)
    recording = replace(commands, channels={**commands.channels, "bellows.pressure_pa": noisy})

    found = compare(joint, [recording]).recordings[0]

    assert set(found.errors) == {ONE_STEP, WINDOW, FREE_RUN}
    assert found.errors[ONE_STEP]["bellows.pressure_pa"].rmse < 1.5e3
    assert found.notes == ()


def test_it_is_said_from_when_on_a_filter_gave_nothing(recording):
    ahead = np.where(np.arange(len(recording)) < 150, 0.0, np.nan)

    (said,) = lost(recording, {POSITION: ahead})

    assert said == "one step: the filter gave nothing for 75 % of the samples, the first at 0.15 s"
    assert lost(recording, {POSITION: np.zeros(len(recording))}) == []
