"""Robustness: probability of a miss with its interval, worst draws, what moves a figure."""

import numpy as np
import pytest

from studies.draws import kept_rows
from studies.figures.robustness import influence_figure, spread_figure
from studies.kept import Kept
from studies.robustness import Line, Robustness
from studies.robustness_study import Draw, measured, outcome, summary
from studies.text import number
from studies.versions import work_folder
from studies.workers import Workers, working_with

N = 200
MASS, AREA = "slide.mass_kg", "valve.flow_area_m2"


@pytest.fixture
def found():
    """A figure that falls with the mass, and one that nothing moves; both miss in some draws."""
    rng = np.random.default_rng(5)
    mass, area, noise = rng.standard_normal((3, N))
    moved = np.exp(-mass) + 0.1 * noise
    lines = (
        Line("rise", "at most 3", moved, moved > 3.0),
        Line("error", "at most 2", noise, noise > 2.0),
    )
    return Robustness(lines, {MASS: mass, AREA: area})


def test_interval_is_that_of_clopper_and_pearson():
    """None of ten: 1 - 0.025^(1/10), as the tables have it; five of ten: 0.187 to 0.813."""
    values = np.arange(10.0)
    none = Line("x", "", values, np.zeros(10, dtype=bool))
    half = Line("x", "", values, np.arange(10) >= 5)

    assert none.interval == pytest.approx((0.0, 0.3085), abs=1e-4)
    assert half.interval == pytest.approx((0.1871, 0.8129), abs=1e-4)
    assert half.probability == 0.5


def test_a_parameter_that_moves_a_figure_is_named_with_its_direction(found):
    (name, r), *others = found.influences(found.lines[0])

    assert name == MASS
    assert r < -0.8
    assert not others
    assert found.influences(found.lines[1]) == ()


def test_rank_correlation_counts_a_lost_loop_as_the_worst(found):
    line = found.lines[0]
    lost = np.where(line.found > 4.0, np.inf, line.found)
    again = Line(line.name, line.asked, lost, line.missed)

    assert found.influences(again)[0] == pytest.approx(found.influences(line)[0], abs=0.02)
    assert np.isinf(lost[again.worst[0]])


def test_worst_draws_are_the_farthest_out_of_those_that_miss(found):
    line = found.lines[0]

    assert line.worst[0] == line.found.argmax()
    text = found.text
    assert f"draw {line.worst[0] + 1}: " in text
    assert "slide.mass -" in text


def test_the_median_lies_in_the_middle_and_what_95_percent_reach_is_a_draw():
    """Of an even number of draws between two of them, and infinite where half are lost."""
    four = np.array([1.0, 2.0, 4.0, 8.0])
    lines = [
        Line(name, "at most 9", values, values > 9.0)
        for name, values in (("all", four), ("lost", np.array([1.0, np.inf, 4.0, np.inf])))
    ]
    _, every, lost, *_ = Robustness((*lines,), {MASS: np.arange(4.0)}).text.splitlines()

    assert every.split()[4:7] == ["3", "8", "8"]
    assert lost.split()[4:5] == [number(np.inf, 3)]


def test_too_few_draws_say_nothing_of_influences(found):
    few = Robustness((found.lines[0],), {MASS: found.deviations[MASS]})
    short = Line("rise", "", found.lines[0].found[:10], found.lines[0].missed[:10])

    assert few.influences(found.lines[0])
    assert Robustness((short,), {MASS: found.deviations[MASS][:10]}).influences(short) == ()


@pytest.mark.parametrize(
    ("draws", "said"),
    [
        (19, "influences: 20 draws or more needed"),
        (20, "no parameter clearly moves any figure"),
    ],
)
def test_a_figure_of_too_few_draws_says_so_and_not_that_nothing_has_an_influence(draws, said):
    """Of 13 to 19 runs it had said what nobody had worked out."""
    values = np.arange(float(draws))
    lines = (Line("rise", "at most 99", values, values > 99.0),)
    found = Robustness(lines, {MASS: np.abs(values - values.mean())})
    (axes,) = influence_figure(found).axes

    assert [text.get_text() for text in axes.texts] == [said]
    assert found.text.splitlines()[1].endswith("more needed" if draws < 20 else "-")


def test_the_marks_of_a_spread_are_the_draws_that_its_table_counts():
    """One on its limit to within rounding is none of them, nor one without a figure."""
    values = np.array([1.0, 51.0 * (1.0 + 1e-15), 52.0, np.inf])
    line = Line("rise", "at most 51", values, np.array([False, False, True, True]))
    (axes,) = spread_figure(Robustness((line,), {}), {"rise": 51.0}).axes[:1]
    (marks,) = (each for each in axes.lines if each.get_label() == "missed")

    assert values[1] > 51.0 and marks.get_xdata().tolist() == [52.0]


def test_two_drives_of_the_study_differ_and_are_the_same_again(tmp_path):
    first = measured(Draw(0))
    with working_with(Workers(1)):
        rows = kept_rows(tmp_path, measured, {str(k): Draw(k) for k in range(2)}, print)

    assert rows[0]["found"] == first["found"]
    assert rows[1]["found"] != first["found"]
    assert len(Kept(work_folder(tmp_path) / "rows.jsonl").rows) == 2
    said = outcome(rows)
    assert all(claim.holds for claim in said.claims if "no draw is lost" in claim.claim)
    assert set(said.figures) == {"spread", "influences"}


def test_a_lost_loop_misses_every_line():
    lost = {"found": dict.fromkeys(measured(Draw(0))["found"]), "deviations": {}}
    claims = outcome([lost, {**lost}]).claims

    assert not any(claim.holds for claim in claims)
    assert all(line.probability == 1.0 for line in summary([lost]).lines)
