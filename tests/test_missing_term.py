"""What a missing term depends on: nominal parameters taken out, loops named, two intensities."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from test_report import UNITS, diagnosis

from studies.documents import diagnosis_document
from studies.figures.diagnosis import diagnosis_figures, missing_term_figure
from studies.figures.style import styled
from studies.page.missing_term import _dependence as on_page
from studies.text_of_results import diagnosis_text
from workbench.diagnosis.dependence import (
    dependences,
    direction,
    imitated,
    parameter_columns,
    side,
)
from workbench.diagnosis.missing_term import Course, Dependence, Intensities
from workbench.diagnosis.suspects import with_missing_flows
from workbench.fitting.unknowns import nominal_unknowns
from workbench.plants import PLANTS

COMMAND, PLACE = "valve.command_v", "slide.position_m"
STEP_S = 5e-3
TIME_S = STEP_S * np.arange(2400)


def swept(seed=3):
    """Twelve seconds of a command as a person would play it: slow waves of unequal height."""
    random = np.random.default_rng(seed)
    waves = sum(np.sin(2 * np.pi * f * TIME_S + random.uniform(0, 6)) for f in (0.4, 0.9, 1.7))
    return waves + 0.01 * random.standard_normal(len(TIME_S))


def played(command, gap):
    """Backlash: the output follows once the command has crossed the gap."""
    found = np.zeros(len(command))
    for k in range(1, len(command)):
        found[k] = np.clip(found[k - 1], command[k] - gap / 2, command[k] + gap / 2)
    return found


def against(term, drivers, directions, neighbour=None):
    return dependences(drivers, directions, term, term if neighbour is None else neighbour)


def test_hysteresis_of_a_command_is_a_loop_and_a_curve_is_none():
    command, drivers = swept(), {COMMAND: swept(), PLACE: swept(4)}
    ways = {COMMAND: direction(command)}
    noise = 0.05 * np.random.default_rng(8).standard_normal(len(TIME_S))
    memory, curve = (
        against(term + noise, drivers, ways)[0] for term in (played(command, 1.2), command**3)
    )

    assert memory.variable == curve.variable == COMMAND
    assert memory.memory.by == COMMAND and memory.memory.adds > 0.05
    assert np.all(memory.memory.branches[0, 1] < memory.memory.branches[1, 1])  # up lags behind
    assert curve.memory is None
    assert max(loop.adds for loop in curve.loops) < 0.02


def test_friction_is_a_loop_over_the_place_by_the_side_of_the_velocity():
    place = np.cumsum(swept()) * STEP_S
    velocity = np.gradient(place, STEP_S)
    drivers, ways = {PLACE: place}, {"slide.velocity_m_s": side(velocity)}
    (dry,) = against(-8.0 * np.sign(velocity), drivers, ways)
    (spring,) = against(-8.0 * place, drivers, ways)

    assert dry.memory.by == "slide.velocity_m_s" and dry.memory.adds > 0.5
    assert dry.memory.branches[:, 1] == pytest.approx(np.outer([-8.0, 8.0], np.ones(15)))
    assert spring.memory is None


def test_what_wanders_by_chance_runs_through_no_loop():
    """A walk as slow as the smoothed term is, with nothing to do with the command."""
    command, random = swept(), np.random.default_rng(2)
    slow = np.exp(-np.arange(200) / 40)
    walks = (np.convolve(random.standard_normal(len(TIME_S)), slow, "same") for _ in range(20))
    found = [against(w, {COMMAND: command}, {COMMAND: direction(command)})[0] for w in walks]

    assert not any(each.memory for each in found)


def test_turns_of_noise_turn_no_direction():
    command = np.sin(2 * np.pi * 0.4 * TIME_S)
    noisy = command + 0.01 * np.random.default_rng(1).standard_normal(len(TIME_S))

    found = direction(noisy)
    assert np.count_nonzero(np.diff(found[found != 0.0])) == 9  # 4.8 periods
    late = np.gradient(command) * found < 0.0
    assert late.mean() < 0.15  # a tenth of the deviation after each turn
    assert np.array_equal(side(np.array([-2.0, -0.01, 0.0, 3.0])), [-1, 0, 0, 1])


def test_what_parameters_explain_within_their_priors_is_taken_out_and_no_more():
    random = np.random.default_rng(5)
    one, other = (swept(seed) for seed in (6, 7))
    rest = 0.5 * played(swept(9), 0.8) + 0.01 * random.standard_normal(len(one))
    columns = np.column_stack([one, other])

    two_deviations = imitated(2.0 * one + rest, columns)
    assert two_deviations == pytest.approx(2.0 * one, abs=0.25 * np.std(2.0 * one))
    far = imitated(1e3 * one, columns)
    assert far.std() < 0.2 * np.std(1e3 * one)  # a prior does not allow a thousand deviations
    assert not imitated(np.full(len(one), 3.0), columns).any()


def test_columns_are_what_one_prior_deviation_does_to_the_balance():
    lean = PLANTS["servo_drive"]().lean()
    plant, flows = with_missing_flows(lean)
    unknowns = nominal_unknowns(lean)
    n = 4
    x = plant.initial[:, None] + plant.scale[:, None] * np.linspace(0.1, 0.4, n)
    u, d, p = plant.nominal
    u, d = (np.tile(values[:, None], n) + 0.3 for values in (u, d))
    flow = next(f for f in flows if f.place == "chamber_a.mass")
    state = "chamber_a.pressure_pa"
    course = Course(state, f"{flow.name}.flow", x, u, d)
    found = parameter_columns(plant, unknowns, course)

    def rate(name, step):
        moved = p.copy()
        moved[list(plant.model.parameters).index(name)] += step
        row = list(plant.model.states).index(state)
        return plant.model.f.map(n)(x, u, d, np.tile(moved[:, None], n))[0].full()[row]

    one = rate(f"{flow.name}.flow", 1e-5) - rate(f"{flow.name}.flow", -1e-5)
    for name, deviation, column in zip(unknowns.names, unknowns.scale, found.T, strict=True):
        h = 1e-4 * deviation
        slope = (rate(name, h) - rate(name, -h)) / (2e-4) / (one / 2e-5)
        assert column == pytest.approx(slope, rel=1e-4, abs=1e-4 * np.abs(found).max()), name
    assert np.abs(found).max(axis=0)[list(unknowns.names).index("chamber_a.dead_volume_m3")] > 0.0


@pytest.fixture(scope="module")
def looping():
    """A diagnosis whose missing flow lags behind the command, at two intensities."""
    plain, command = diagnosis(), swept()[:400]
    term = 1e-4 * played(command, 1.2)
    ways = {COMMAND: direction(command)}
    drivers = {COMMAND: command, "chamber_a.pressure_pa": 4e5 + 1e5 * swept(4)[:400]}
    found = dependences(drivers, ways, term, 0.8 * term)
    where = replace(
        plain.where, term=term, against=found, intensities=Intensities(1e-4, 1e-5, 0.8 * term),
        imitated=0.12,
    )  # fmt: skip
    return replace(plain, where=where)


def test_a_loop_is_named_memory_in_text_and_json(looping):
    said = diagnosis_text(looping, UNITS)
    where = diagnosis_document(looping, UNITS)["where"]

    assert "it runs through a loop over valve.command" in said and "memory, such as" in said
    assert where["memory"] is True
    first = where["loops"][0]
    assert (first["variable"], first["by"]) == ("valve.command", "valve.command")
    assert first["adds"] > 0.05
    assert where["imitated_by_parameters"] == 0.12
    assert where["random_walk"] == {
        "term": "mass_flow", "likeliest": 1e-4, "neighbour": 1e-5, "unit": "kg/s/s^0.5",
    }  # fmt: skip
    assert diagnosis_document(diagnosis(), UNITS)["where"]["memory"] is False
    assert "memory" not in diagnosis_text(diagnosis(), UNITS)


def test_the_figure_shows_both_ways_and_both_intensities(looping):
    figure = diagnosis_figures(looping)["missing_term"]
    whole, _, first, second = figure.axes

    assert [line.get_label() for line in whole.lines] == [
        "walk slower than the likeliest", "missing term, one deviation shaded",
    ]  # fmt: skip
    assert "a loop" in first.get_title() and "a loop" not in second.get_title()
    labels = [text.get_text() for text in first.get_legend().get_texts()]
    assert labels == ["one deviation in each bin", "valve command rising", "valve command falling"]
    assert len(second.lines) == 3  # mean, the other intensity, zero


def test_balances_that_gain_alike_but_for_chance_are_told_as_one_question():
    """As 8.6 over 7.6 of log-likelihood: a factor of three in the odds, which noise makes."""
    found = diagnosis()
    gains = {"slide.momentum": 8.6, "chamber_a.mass": 7.6, "chamber_b.mass": 3.0}
    near = replace(found, where=replace(found.where, balance="slide.momentum", by_balance=gains))
    far = replace(near, where=replace(near.where, by_balance=gains | {"slide.momentum": 12.0}))

    assert "not told: slide.momentum, or chamber_a.mass\n" in diagnosis_text(near, UNITS)
    assert "not told" not in diagnosis_text(far, UNITS)


def test_a_missing_force_is_always_drawn_against_velocity_and_a_flow_against_a_command():
    where = diagnosis().where
    bins = np.array([[0.0, 1.0], [1.0, 2.0], [0.1, 0.1]])
    names = (
        "chamber_b.pressure_pa", "chamber_a.pressure_pa", "slide.position_m",
        "rate of valve.command_v", "valve.command_v", "slide.velocity_m_s",
    )  # fmt: skip
    against = tuple(Dependence(name, 0.6 - 0.1 * k, bins) for k, name in enumerate(names))

    def drawn(balance, term):
        found = replace(where, balance=balance, term_name=term, against=against)
        return [axes.get_xlabel() for axes in missing_term_figure(found).axes[2:]]

    assert drawn("slide.momentum", "force_n")[-1] == "slide velocity (m/s)"
    assert drawn("chamber_a.mass", "mass_flow_kg_s")[-1] == "valve command (V)"
    assert len(drawn("slide.momentum", "force_n")) == 3


@pytest.mark.parametrize(
    ("balance", "term", "names", "label"),
    [
        ("bellows.mass", "mass_flow_kg_s", ["valve.pwm", "rate of valve.pwm"], "valve pwm"),
        ("joint.momentum", "torque_n_m", ["joint.velocity_rad_s"], "joint velocity (deg/s)"),
        ("bellows.mass", "mass_flow_kg_s", ["rate of valve.pwm"], "rate of valve pwm (1/s)"),
        ("bellows.mass", "mass_flow_kg_s", ["rate of valve.command_v"],
         "rate of valve command (V/s)"),
    ],
)  # fmt: skip
def test_so_it_is_on_plants_whose_valve_has_no_volts_and_whose_joint_turns(
    balance, term, names, label
):
    """Four that explain more stand before it; a rate alone is no command."""
    where, bins = diagnosis().where, np.array([[0.0, 1.0], [1.0, 2.0], [0.1, 0.1]])
    rate = names[0].startswith("rate of ")
    others = [f"chamber_{k}.pressure_pa" for k in range(4)]
    against = tuple(Dependence(n, 0.5, bins) for n in (names + others if rate else others + names))
    found = replace(where, balance=balance, term_name=term, against=against)

    drawn = [axes.get_xlabel() for axes in missing_term_figure(found).axes[2:]]
    assert len(drawn) == 3 and label in drawn
    pytest.importorskip("bokeh", reason="the page needs bokeh (extra `page`)")
    (shown,) = [d for d in against if d.variable == names[0]]
    chart = on_page(shown, 1.0, "l/min")
    assert chart.xaxis.axis_label == label
    assert chart.title.text == f"follows {label.partition(' (')[0]}: 50 %"


def test_what_is_not_known_of_a_missing_term_has_no_line():
    found = diagnosis()
    bare = replace(found, where=replace(found.where, against=(), by_regime={}))

    assert "follows" in diagnosis_text(found, UNITS) and "regimes overlap" in diagnosis_text(
        found, UNITS
    )
    text = diagnosis_text(bare, UNITS)
    assert "where: " in text and "follows" not in text and "regimes overlap" not in text


def test_the_legend_of_the_missing_term_stands_above_it():
    where = diagnosis().where
    swings = replace(where, term=1e-4 * np.cos(3.0 * where.time_s), term_deviation=0 * where.term)
    figure = missing_term_figure(swings)
    with styled():
        FigureCanvasAgg(figure).draw()
    axes = figure.axes[0]

    highest = axes.transData.transform((0.0, max(axes.lines[0].get_ydata())))[1]
    assert axes.get_legend().get_window_extent().y0 > highest


@pytest.mark.parametrize("size", [1e-16, 1e-12])
def test_a_signal_at_its_limit_is_one_bin_however_it_is_rounded(size):
    """Half of the time a bristle is bent to one end or the other, but for the last digits."""
    random = np.random.default_rng(4)
    bent = np.clip(swept(), -0.7, 0.7)
    values = bent + size * random.standard_normal(len(bent))
    term = np.sin(3.0 * bent) + 0.3 * random.standard_normal(len(bent))

    (exact,), (found,) = (dependences({PLACE: row}, {}, term, term) for row in (bent, values))

    assert found.explains == pytest.approx(exact.explains, rel=1e-9)
    assert found.bins.shape == exact.bins.shape
    assert exact.bins[0, [0, -1]] == pytest.approx([-0.7, 0.7], abs=1e-3)
