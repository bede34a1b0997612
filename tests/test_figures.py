"""Figures are fit for a journal of two columns: width, units, fonts, and lines that grey keeps."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from check_loops import metrics
from figure_faults import faults
from matplotlib.colors import to_hex

from studies.checked_runs import FEW
from studies.closed_loop_check import Check
from studies.closed_loop_figures import check_figures
from studies.figures.comparison import comparison_figures
from studies.figures.delays import delay_figure
from studies.figures.fidelity import fidelity_figure
from studies.figures.following import following_figures
from studies.figures.limits import limit_figures
from studies.figures.mode_count import mode_count_figure
from studies.figures.panels import Line, Panel, panels_figure
from studies.figures.robustness import influence_figure, spread_figure
from studies.figures.style import MOST_POINTS, new_figure, save, styled
from studies.robustness import Line as Asked
from studies.robustness import Robustness
from studies.specification import read_specification
from workbench.comparison.compare import Comparison, Regime, compare
from workbench.plants.servo_drive import servo_drive
from workbench.recording import Recording
from workbench.rig import default_rig

X = np.linspace(0.0, 1.0, 50)


def closed_loops(designs=("pid", "lq", "mpc"), estimators=("ekf", "mhe")):
    """Three designs with two estimators each, as a demo draws them."""
    rows, records = [], []
    for design in designs:
        for estimator in estimators:
            names = ("slide.position_m", "reference.slide.position_m", "valve.command_v")
            recording = Recording("run", 1e-3, dict.fromkeys(names, X))
            rows.append(metrics(design=design, estimator=estimator))
            records.append(SimpleNamespace(recording=recording))
    with styled():
        return check_figures(Check(tuple(rows), tuple(records)))["closed_loop_step"]


def robust(make):
    rng = np.random.default_rng(3)
    mass, noise = rng.standard_normal((2, 60))
    lines = (
        Asked("rise", "at most 3 ms", 2.0 + mass, mass > 1.0, "ms"),
        Asked("error (mm)", "at most 2", noise**2, noise**2 > 2.0),
    )
    return make(Robustness(lines, {"slide.mass_kg": mass}))


MARKS = ("RMSE (mm)", "overshoot (mm)")


def limited(designs=("pid", "lq")):
    """Runs against a limit both ways, and one of a pressure, which has no lower side."""
    names, rows = ("slide.velocity_m_s", "chamber_a.pressure_pa"), []
    for design in designs:
        rows.append((SimpleNamespace(design=design, scenario="step"), 1e5 * X))
    records = [
        SimpleNamespace(recording=Recording("run", 1e-3, dict.fromkeys(names, x))) for _, x in rows
    ]
    text = '[limits]\n"slide.velocity" = "1 m/s"\n"chamber_a.pressure" = "6 bar"\n'
    asked = read_specification(text, default_rig(servo_drive())).asked
    return limit_figures(asked, [row for row, _ in rows], records)["limits_step"]


CURVES = {name: {mark: [1.0, 2.0, 3.0] for mark in MARKS} for name in ("lq", "pid")}
FIGURES = {
    "closed loops": closed_loops,
    "limits": limited,
    "spread": lambda: robust(lambda r: spread_figure(r, {"rise": 3.0, "error (mm)": 2.0})),
    "influences": lambda: robust(influence_figure),
    "delays": lambda: delay_figure([0, 1, 2], CURVES, {"lq": (1.0, 1.5), "pid": (np.nan, np.nan)}),
    "fidelity": lambda: fidelity_figure({"friction": dict.fromkeys(MARKS, 2.0)}, MARKS),
    "mode count": lambda: mode_count_figure([1, 2, 3], CURVES),
}


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_is_fit_for_a_journal(name):
    assert not faults(FIGURES[name]())


MANY = [f"lq {run + 1}" for run in range(FEW)]


def followed(runs=MANY):
    """Runs of an arm along a reference."""
    names = ("joint.angle_rad", "reference.joint.angle_rad", "valve.command_v")
    one = SimpleNamespace(recording=Recording("run", 1e-3, dict.fromkeys(names, X)))
    rows = [SimpleNamespace(design=run, estimator="ekf", scenario="1-hz") for run in runs]
    with styled():
        return following_figures(SimpleNamespace(rows=rows, records=[one] * len(rows)))[
            "following_1-hz"
        ]


@pytest.mark.parametrize(
    "drawn",
    [
        lambda: closed_loops(MANY, ("ekf",)),
        lambda: closed_loops(MANY[:6]),
        lambda: limited(MANY),
        followed,
    ],
)
def test_all_runs_that_a_check_draws_are_told_apart(drawn):
    """There are seven colours and kinds of lines: the eighth run had looked as the first."""
    for axes in drawn().axes:
        lines = [line for line in axes.lines if "lq" in str(line.get_label())]
        with styled():  # in which C7 is C0 again
            looks = {(to_hex(line.get_color()), str(line._dash_pattern)) for line in lines}
        assert len(looks) == len(lines) == FEW


def test_estimators_of_one_design_have_colours_of_their_own():
    """One colour was the design's: what two of them did was told apart by dashes alone."""
    lines = [line for line in closed_loops(("lq",)).axes[1].lines if "lq" in line.get_label()]

    assert [line.get_color() for line in lines] == ["C0", "C1"]


def test_the_marks_of_what_is_missed_are_told_in_a_legend():
    figure = FIGURES["spread"]()

    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "share up to it",
        "missed",
        "asked for",
    ]


def curves(label="time (s)", width_in=7.16, **looks):
    two = {"style": "-", "colour": "#0072B2"} | looks
    lines = [Line(X, X, "one", "-", "#D55E00"), Line(X, -X, "two", **two)]
    return panels_figure([[Panel(label, "place (mm)", lines)]], width_in, 3.0)


@pytest.mark.parametrize(
    ("figure", "fault"),
    [
        (curves(), "'one' and 'two' look alike in grey"),
        (curves(label="time", style="--"), "no unit on 'time'"),
        (curves(width_in=9.0, style="--"), "9.00 in wide"),
    ],
)
def test_what_makes_a_figure_unfit_is_told(figure, fault):
    assert faults(figure) == [fault]


def test_an_impact_of_one_sample_in_a_long_recording_is_drawn_and_stands_in_the_table(tmp_path):
    """Of a minute every thirtieth sample had been taken, and what lay between was not there."""
    time_s, error = 1e-3 * np.arange(60_000), np.zeros(60_000)
    error[31_237], error[31_238], error[40_001] = 7.0, -9.0, np.nan
    figure = panels_figure([[Panel("time (s)", "error (mm)", [Line(time_s, error, "e")])]], 7, 3)

    (line,) = figure.axes[0].lines
    x, y = line.get_data()
    assert (np.nanmin(y), np.nanmax(y)) == (-9.0, 7.0)
    assert x[np.nanargmax(y)] == time_s[31_237] and (x[0], x[-1]) == (time_s[0], time_s[-1])
    assert len(x) < 2.1 * MOST_POINTS and (np.diff(x) > 0.0).all()
    save(figure, tmp_path / "one", "x")
    assert ",31.237,7\n" in (tmp_path / "one.csv").read_text()


def test_black_and_a_light_colour_are_told_apart_without_another_line():
    assert not faults(curves(colour="#F0E442"))


def test_fonts_are_in_the_files_and_two_files_are_the_same(tmp_path):
    for name in ("one", "two"):
        save(curves(style="--"), tmp_path / name, "workbench check")
    pdf, svg = ((tmp_path / f"one.{ending}").read_bytes() for ending in ("pdf", "svg"))

    assert b"/FontFile2" in pdf and b"/Type3" not in pdf
    assert b"<text" not in svg  # letters are drawn
    for ending in ("pdf", "svg", "csv", "txt"):
        one, two = (tmp_path / f"{name}.{ending}" for name in ("one", "two"))
        assert one.read_bytes() == two.read_bytes()


def test_a_panel_has_one_line_in_the_table_where_its_label_has_two(tmp_path):
    with styled():
        figure = new_figure(3.5, 2.0)
        axes = figure.subplots()
        axes.plot([0, 1], [0, 1], label="line")
        axes.set_ylabel("valve command\n(V)")
    save(figure, tmp_path / "one", "x")

    assert (tmp_path / "one.csv").read_text().splitlines()[1] == "valve command (V),line,0,0"


def test_a_limit_is_drawn_on_each_side_that_it_has_in_the_unit_that_was_typed():
    velocity, pressure = limited().axes

    heights = [[float(line.get_ydata()[0]) for line in a.lines if line.get_linestyle() == ":"]
               for a in (velocity, pressure)]  # fmt: skip
    assert heights[0] == pytest.approx([-1.0, 1.0]) and heights[1][-1] == pytest.approx(6.0)
    assert len(pressure.lines) == 3 and velocity.get_ylabel() == "slide.velocity (m/s)"


def compared(name):
    """A chamber whose pressure falls, under a name of its file."""
    pressure_pa = np.linspace(5e5, 4.9e5, 100) + np.random.default_rng(2).normal(0.0, 500.0, 100)
    recording = Recording(name, 1e-3, {"chamber.pressure_pa": pressure_pa})
    (found,) = compare(default_rig("closed_chamber"), [recording]).recordings
    regimes = (Regime("moving forward", 0.9, 0.5), Regime("at rest", 0.1, 0.5))
    return comparison_figures(Comparison("rig", (replace(found, by_regime=regimes),)))


@pytest.mark.parametrize("name", ["a$_$b", "a$x$b", "a$b", "50 % of_x^2 & <b>"])
def test_a_file_name_is_no_formula_in_a_figure_nor_another_one_in_its_table(name, tmp_path):
    """Between two dollars Matplotlib had read one, and refused `a$_$b` after all the work."""
    for number, figure in enumerate(compared(name).values()):
        save(figure, tmp_path / f"{number}", "workbench compare")
        titles = [figure.get_suptitle(), *(axes.get_title() for axes in figure.axes)]
        assert any(name.replace("$", r"\$") in title for title in titles)

    table = (tmp_path / "1.csv").read_text()
    assert f'"{name}: where the error is, window; regimes overlap",of the time' in table


def test_the_title_of_a_long_file_name_is_whole_in_its_figure():
    for figure in compared("_".join(["day_2_of_the_campaign"] * 5)).values():
        figure.draw_without_rendering()
        for title in filter(None, [figure._suptitle, *(axes.title for axes in figure.axes)]):
            box = title.get_window_extent()
            assert box.x0 >= 0.0 and box.x1 <= figure.bbox.x1


def test_a_design_with_dollars_in_its_name_is_no_formula_in_a_legend(tmp_path):
    for figure in (closed_loops(("a$_$b",)), limited(("a$_$b",))):
        save(figure, tmp_path / "one", "workbench check")
        assert "a$_$b" in (tmp_path / "one.csv").read_text()
