"""The table beside a figure tells every panel and every curve apart."""

import csv
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from studies.figures.comparison import overlay_figure
from studies.figures.estimates import band_figure
from studies.figures.residuals import residual_figure
from studies.figures.robustness import influence_figure, spread_figure
from studies.figures.style import new_figure, save, styled
from studies.robustness import Line, Robustness
from workbench.comparison.compare import FREE_RUN, PLAIN, compare
from workbench.recording import Recording
from workbench.rig import default_rig

TIME = np.linspace(0.0, 1.0, 50)


def table(figure, folder):
    """Curves by panel, of what is saved beside a figure."""
    save(figure, folder / "one", "x")
    found = {}
    with (folder / "one.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            curves = found.setdefault(row["panel"], {})
            curves.setdefault(row["curve"], []).append((row["x"], row["y"]))
    return found


def follower(*names):
    return SimpleNamespace(
        names=names, state=lambda name: TIME, deviation=lambda name: 1.0 + 0.0 * TIME
    )


@pytest.mark.parametrize("estimators", [("ekf",), ("ekf", "imm")])
def test_panels_of_a_grid_are_named_by_their_column_and_their_row(estimators, tmp_path):
    states = ("slide.position_m", "slide.velocity_m_s")
    truth = dict.fromkeys(states, 0.5 * TIME)
    found = table(band_figure({e: follower(*states) for e in estimators}, truth, 0.02), tmp_path)

    assert list(found) == [
        f"{name}, slide {what}"
        for what in ("position error (mm)", "velocity error (m/s)")
        for name in estimators
    ]


def test_an_estimate_that_is_off_for_one_sample_of_a_long_run_is_drawn():
    """As at an impact: every twentieth sample of 3 s at 10 kHz had been, whatever was between."""
    truth = np.zeros(30_000)
    state = truth.copy()
    state[12_345] = 5e-3
    run = SimpleNamespace(
        names=("slide.position_m",), state=lambda _: state, deviation=lambda _: 1e-3 + truth
    )
    axes = band_figure({"ekf": run}, {"slide.position_m": truth}, 1e-4).axes[0]

    time_s, error_mm = axes.lines[0].get_data()
    assert error_mm.max() == pytest.approx(5.0)
    assert time_s[error_mm.argmax()] == pytest.approx(1.2345)
    assert error_mm.max() > axes.get_ylim()[1]
    assert [each.get_text() for each in axes.texts] == ["up to 5"]


def decay():
    rng = np.random.default_rng(2)
    pressure_pa = np.linspace(5e5, 4.9e5, 400) + 500 * rng.standard_normal(400)
    recording = Recording("decay", 1e-3, {"chamber.pressure_pa": pressure_pa})
    return compare(default_rig("closed_chamber"), [recording])


def test_errors_of_a_comparison_say_of_which_output_they_are(tmp_path):
    (one,) = decay().recordings
    two = SimpleNamespace(**vars(one), judged=one.judged)
    second = "chamber_b.pressure_pa"
    for each in (two.measured, two.noise, *two.simulated.values()):
        each[second] = each["chamber.pressure_pa"]
    found = table(overlay_figure(two), tmp_path)

    outputs = "chamber pressure (bar)", "chamber b pressure (bar)"
    assert set(found) == {*outputs, *(f"error of {output}" for output in outputs)}


def test_panels_of_residuals_are_those_of_their_output(tmp_path):
    (one,) = decay().recordings
    two = SimpleNamespace(**vars(one))
    two.residuals = {**one.residuals, "chamber_b.pressure_pa": one.residuals["chamber.pressure_pa"]}
    found = list(table(residual_figure(two), tmp_path))

    assert len(found) == 4
    assert all("chamber b" in name for name in found[2:])
    assert [name.partition(",")[0].partition(";")[0] for name in found] == [
        "spectral density",
        "autocorrelation",
    ] * 2


def test_a_plant_without_states_is_seen_beside_what_was_measured_however_far_off():
    """A free run that drifts is cut off; a force that is wrong all along had been, too."""
    (one,) = decay().recordings
    far = {name: 3.0 * values for name, values in one.measured.items()}
    overlay = overlay_figure(replace(one, simulated={PLAIN: far})).axes[0]
    drifting = overlay_figure(replace(one, simulated={PLAIN: far, FREE_RUN: far})).axes[0]

    (highest,) = (1e-5 * values.max() for values in far.values())
    assert overlay.get_ylim()[1] > highest > drifting.get_ylim()[1]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_is_said_of_a_correlation_covers_none_of_it(sign):
    """As of slow errors, whose correlation is near one all along."""
    (one,) = decay().recordings
    (name, residual) = next(iter(one.residuals.items()))
    high = replace(residual, correlation=sign * np.ones_like(residual.lag_s))
    figure = residual_figure(replace(one, residuals={name: high}))
    figure.draw_without_rendering()

    axes = figure.axes[1]
    (line,), (said,) = axes.lines, axes.texts
    heights = axes.transData.transform(np.column_stack(line.get_data()))[:, 1]
    assert said.get_window_extent().y0 > heights.max()


def test_a_spread_is_named_by_its_line_and_so_are_its_curves(tmp_path):
    rows = dict(
        zip(("rise_time, step", "air, step"), 0.04 * np.arange(100).reshape(2, 50), strict=True)
    )
    lines = [Line(name, "at most 1", size, size > 1.0, "ms") for name, size in rows.items()]
    found = table(spread_figure(Robustness((*lines,), {}), dict.fromkeys(rows, 1.0)), tmp_path)

    assert list(found) == ["rise_time, step (ms)", "air, step (ms)"]
    for curves in found.values():
        assert list(curves) == ["share up to it", "missed", "asked for"]


def test_the_cells_of_a_map_of_influences_are_in_the_table(tmp_path):
    mass = np.linspace(-2.0, 2.0, 50)
    lines = [Line(name, "at most 1", size, size > 1.0) for name, size in
             (("rise", mass), ("error", mass**2), ("air", -mass))]  # fmt: skip
    found = table(influence_figure(Robustness((*lines,), {"slide.mass_kg": mass})), tmp_path)

    (cells,) = (each for name, each in found.items() if not name.startswith("scale"))
    assert cells == {"1": [("rise", "slide.mass")], "-1": [("air", "slide.mass")]}


def test_what_nobody_named_is_told_apart_all_the_same(tmp_path):
    """Panels alike in every label by their number, curves by what the panel shows."""
    with styled():
        figure = new_figure(3.5, 2.0)
        for axes in figure.subplots(1, 2):
            axes.plot(TIME, TIME)
            axes.plot(TIME, -TIME)
            axes.axhline(0.5)
            axes.axvline(0.5)
            axes.plot(TIME, 2 * TIME, label="_kept off the legend")
            axes.set_ylabel("place (mm)")
    found = table(figure, tmp_path)

    assert list(found) == ["place (mm), panel 1", "place (mm), panel 2"]
    assert list(found["place (mm), panel 1"]) == [
        "place 1", "place 2", "level", "upright", "kept off the legend",
    ]  # fmt: skip


def test_points_with_error_bars_are_named_by_their_label(tmp_path):
    """As the flow of each path of a valve: both had been called after the axis."""
    with styled():
        figure = new_figure(3.5, 2.0)
        axes = figure.subplots()
        for label, area_mm2 in (("exhaust path", 2.0), ("supply path", 3.0)):
            axes.errorbar([4.0, 6.0], [0.0, area_mm2], [0.1, 0.2], fmt="s", label=label)
        axes.plot([4.0, 6.0], [1.0, 1.0], label="rig")
        axes.set_ylabel("effective area (mm²)")

    ((_, found),) = table(figure, tmp_path).items()
    assert [*found] == ["exhaust path", "supply path", "rig"]
    assert found["supply path"] == [("4", "0"), ("6", "3")]


def test_the_ends_of_error_bars_stand_beside_their_points_and_nowhere_else(tmp_path):
    with styled():
        figure = new_figure(3.5, 2.0)
        left, right = figure.subplots(1, 2)
        left.plot([0.0, 9.0], [1.0, 2.0], label="fitted")
        left.errorbar([4.0, 6.0], [1.0, 3.0], [0.1, np.nan], fmt="s", label="runs")
        left.set_ylabel("force (N)")
        right.plot([5.0], [7.0], label="rest")
        right.set_ylabel("place (mm)")
    save(figure, tmp_path / "one", "x")

    assert (tmp_path / "one.csv").read_text().splitlines() == [
        "panel,curve,x,y,low,high",
        "force (N),fitted,0,1,,",
        "force (N),fitted,9,2,,",
        "force (N),runs,4,1,0.9,1.1",
        "force (N),runs,6,3,nan,nan",
        "place (mm),rest,5,7,,",
    ]
