"""Which terms a law takes: those that the recording asks for, in every half of it, without a name.

The truth of the bench is written in plain numpy, here and in ``test_diagnosis``.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_diagnosis import bench, nothing

from workbench.diagnosis import diagnose as diagnosing
from workbench.diagnosis import law_addition
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.judge import share_removed
from workbench.diagnosis.law import _at_once, better_base, empirical_law, standing, with_terms
from workbench.diagnosis.law_addition import NO_LAW, add_law
from workbench.diagnosis.law_choice import worth_scanning
from workbench.diagnosis.law_told import law_of
from workbench.diagnosis.refit import refit_from
from workbench.diagnosis.result import LawTerm, Verdict
from workbench.diagnosis.scan import scan_catalogue
from workbench.diagnosis.size import Size, distinct
from workbench.effects.law_features import Factor, Here, product, written
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.problem import pose
from workbench.law_scales import scales
from workbench.plants import PLANTS
from workbench.rig import load_rig
from workbench.rig_laws import is_law, law_terms, with_laws
from workbench.rig_writing import rig_text

BARE = 'name = "bench"\nplant = "cylinder_bench"\n[values]\n"chamber.area" = "518.7 mm^2"\n'
STROKE_M, WAVE_N = 0.06, 5.0  # the bench moves by 30 mm to either side
SINE, CURVED = "law[sin(2 pi x/L)]@rod", "law[(x - mid)^2]@rod"


def made(seed, force_n, gauge_pa=3e5):
    """The bench, where the rod is pushed by a force of its place (m) and speed (m/s) too."""
    found = bench(seed, nothing, gauge_pa=gauge_pa)
    x, v = found["rod.position_m"], found["rod.velocity_m_s"]
    channels = {**found.channels, "rod.force_n": found["rod.force_n"] - force_n(x, v)}
    return replace(found, channels=channels)


def wavy(x, v):
    return WAVE_N * np.sin(2 * np.pi * x / STROKE_M)


def recorded(force_n):
    """What is trained and what is held out."""
    return [made(1, force_n), made(3, force_n, 1e5)], [made(2, force_n, 4e5)]


def posed(force_n):
    return pose(load_rig(BARE), *recorded(force_n))


def asked_law(problem):
    return empirical_law(problem, scan_catalogue(problem))


def test_a_force_of_magnets_along_the_stroke_is_a_sine_of_it():
    law = asked_law(posed(wavy))

    assert law.balances == ("rod.momentum",)
    assert [*law.terms] == [f"{SINE}.size_n"]
    size = law.terms[f"{SINE}.size_n"]
    assert size.value == pytest.approx(WAVE_N, rel=0.03)
    assert 0.0 < size.deviation < 0.1 * WAVE_N
    assert law.text.endswith(f"of {size.value:.3g} ± {size.deviation:.2g} N")
    assert law.ranges["rod.position_m"] == pytest.approx((-0.03, 0.03), abs=1e-4)
    assert law.drop_validation > 0.95


def test_a_law_of_two_terms_names_both():
    law = asked_law(posed(lambda x, v: wavy(x, v) - 6e3 * x**2))

    assert {step.candidate.name for step in law.steps} == {SINE, CURVED}
    assert law.drop_train > 0.95


def test_a_law_is_told_where_an_effect_that_passes_leaves_most():
    """A force that stood for a curve was called found, at 18 times the noise and without a word."""
    found = diagnose(load_rig(BARE), *recorded(lambda x, v: wavy(x, v) - 6e3 * x**2))

    assert found.ranking[0].accepted and found.ranking[0].drop_train < 0.5
    assert found.verdict is Verdict.NOT_IN_CATALOGUE
    assert {step.candidate.name for step in found.law.steps} == {SINE, CURVED}


def test_where_no_balance_gains_by_an_unknown_input_there_is_no_law(monkeypatch):
    """A constant flow at the noise of a joint that lacked nothing was one: it creeps a little."""
    monkeypatch.setattr(diagnosing, "empirical_law", lambda *asked: pytest.fail("asked"))

    assert diagnosing._law(None, (), [], SimpleNamespace(certain=False), lambda said: None) is None


def test_a_new_term_is_written_into_a_rig_and_read_back_as_the_same_model():
    train, held_out = [made(1, wavy), made(3, wavy, 1e5)], [made(2, wavy, 4e5)]
    (step,) = add_law(load_rig(BARE), train, held_out)
    again = load_rig(rig_text(step.rig))

    assert again.added == (SINE,)
    assert again.plant == step.rig.plant
    assert again.plant.values[f"{SINE}.stroke_m"] == pytest.approx(STROKE_M, rel=1e-3)
    assert again.seen == step.rig.seen


@pytest.mark.parametrize(
    ("force_n", "term"),
    [
        (lambda x, v: 9.0 + 0.0 * x, "law[1]@rod"),
        (lambda x, v: -8.0 * np.sign(v), "law[sign v]@rod"),
    ],
    ids=["constant force", "friction"],
)
def test_what_the_catalogue_has_a_name_for_is_no_term(force_n, term):
    problem = posed(force_n)
    whole = with_terms(problem)
    terms = [c for c in whole.whole.candidates.values() if is_law(c.name)]
    _, nameless = worth_scanning(whole, terms, scan_catalogue(problem))
    chosen, all_of_them = worth_scanning(whole, terms, ())

    assert term in [c.name for c in all_of_them] and chosen[0].name == term
    assert term not in [c.name for c in nameless]
    assert CURVED in [c.name for c in nameless]


def test_where_nothing_is_missing_there_is_no_law():
    assert asked_law(posed(lambda x, v: 0.0 * x)) is None


def stopped_early(problem, deviations=2.0):
    """The same with a prior fit that lies so many prior deviations from its best place."""
    base = problem.base
    off = Point(base.unknowns.clipped(base.point.t + deviations), base.point.starts)
    return problem.with_base(fit_windows(base.windows, base.unknowns, off, iterations=0))


def law_with(problem, name):
    """The law of one term, fitted from a tenth of a newton."""
    problem = with_terms(problem)
    term = next(c for c in problem.whole.candidates.values() if c.name == name)
    found = refit_from(problem, term, {**problem.base.plant.values, term.strength: 0.1})
    drops = found.drop_train, found.drop_validation
    return law_of(found, [LawTerm(term, found.fit, found.validation, *drops)])


def asked_first_at(monkeypatch, module, problem, law):
    """Lets a module pose such a problem and find such a law in it; further ones are its own.

    Returns the problems in which a law is sought, one after the other.
    """
    asked = []

    def found(problem, *known, **more):
        asked.append(problem)
        return law if len(asked) == 1 else empirical_law(problem, *known, **more)

    monkeypatch.setattr(module, "pose", lambda *_, **__: problem)
    monkeypatch.setattr(module, "empirical_law", found)
    return asked


def test_a_law_gets_no_credit_for_a_prior_fit_that_stopped_early(monkeypatch):
    def nothing_missing(x, v):
        return 0.0 * x

    early = stopped_early(posed(nothing_missing))
    law = law_with(early, SINE)
    asked_first_at(monkeypatch, law_addition, early, law)

    assert share_removed(law) > 0.9
    assert better_base(early, law).base.cost < early.base.cost - 0.9 * early.misfit
    assert standing(early, law) is None
    with pytest.raises(ValueError, match=NO_LAW):
        add_law(load_rig(BARE), *recorded(nothing_missing))


def test_a_law_that_is_there_counts_from_the_better_prior_fit_that_it_found(monkeypatch):
    problem = posed(wavy)
    early = stopped_early(problem, 15.0)
    asked = asked_first_at(monkeypatch, law_addition, early, law_with(early, SINE))
    law = asked_law(problem)
    (step,) = add_law(load_rig(BARE), *recorded(wavy))
    first, then = (each.base.cost for each in asked)

    assert standing(problem, law) is law
    assert step.candidate.name == SINE
    assert then == pytest.approx(problem.base.cost, rel=1e-3) and first > then + 0.03 * then


def test_a_diagnosis_begins_again_from_the_prior_fit_that_a_law_found(monkeypatch):
    problem = posed(wavy)
    early = stopped_early(problem, 15.0)
    asked = asked_first_at(monkeypatch, diagnosing, early, law_with(early, SINE))
    monkeypatch.setattr(diagnosing, "improved_base", lambda *_: None)  # refits find nothing here
    found = diagnose(load_rig(BARE), *recorded(wavy))

    assert found.verdict is Verdict.NOT_IN_CATALOGUE
    assert len(asked) == 2
    assert found.base.cost == pytest.approx(problem.base.cost, rel=1e-3)
    assert [*found.law.terms] == [f"{SINE}.size_n"]


def test_each_term_of_a_law_that_is_read_off_is_there(monkeypatch):
    """A term that is not only bends what the others do."""
    problem = with_terms(posed(wavy))
    terms = {c.name: c for c in problem.whole.candidates.values()}
    sine, curved = terms[SINE], terms[CURVED]
    both = {sine.strength: WAVE_N, curved.strength: 0.0}
    asked = [((curved,), {curved.strength: 1.0}), ((curved, sine), both)]
    monkeypatch.setattr("workbench.diagnosis.law.seeds", lambda *_: asked)

    assert _at_once(problem, [sine, curved], None) is None
    monkeypatch.setattr("workbench.diagnosis.law.seeds", lambda *_: [((sine,), both), asked[1]])
    assert [*_at_once(problem, [sine, curved], None).terms] == [sine.strength]


def test_what_is_at_a_bound_has_no_deviation_that_could_refuse_it():
    assert distinct(Size(1.0, 0.7, float("nan"))) and distinct(Size(1.0, 0.7, 0.5))
    assert not distinct(Size(1.0, 0.7, 0.6)) and not distinct(Size(1.0, 0.2, 0.2), null=0.9)


def test_features_are_what_they_are_written_as():
    here = Here(speed=-0.5, place=0.5, pressure=0.8, command=-0.25)
    assert {
        written(feature): float(product(feature, here))
        for feature in (
            (), (Factor.SPEED, Factor.PLACE), (Factor.SPEED_SIGN, Factor.DIFFERENCE),
            (Factor.SINE,), (Factor.COSINE_HALF,), (Factor.COMMAND_SIZE, Factor.PRESSURE),
        )
    } == {
        "1": 1.0,
        "v x": -0.25,
        "sign v dp": pytest.approx(-0.8, rel=1e-3),
        "sin(2 pi x/L)": 1.0,
        "cos(pi x/L)": pytest.approx(np.cos(np.pi / 4)),
        "|u| p": pytest.approx(0.2, rel=1e-3),
    }  # fmt: skip


def test_scales_are_what_was_recorded():
    plant = PLANTS["servo_drive"]()
    names = ["law[sign v dp]@slide", "law[|v| p]@chamber_b", "law[|u|]@chamber_a"]
    laws = [e for e in with_laws(plant, names).effects if e.name in names]
    t = 1e-3 * np.arange(2000)
    recorded = replace(
        bench(1, nothing),
        sample_time_s=1e-3,
        channels={
            "slide.position_m": 0.1 + 0.05 * np.sin(4.0 * t),
            "chamber_a.pressure_pa": np.full(2000, 6e5),
            "chamber_b.pressure_pa": 4e5 + 1e5 * np.sin(4.0 * t),
        },
    )
    found = scales(laws, [recorded])

    assert found["law[sign v dp]@slide.stroke_m"] == pytest.approx(0.1, rel=1e-3)
    assert found["law[sign v dp]@slide.middle_m"] == pytest.approx(0.1, rel=1e-3)
    assert found["law[|v| p]@chamber_b.speed_m_s"] == pytest.approx(0.2, rel=0.02)
    assert found["law[sign v dp]@slide.pressure_pa"] == pytest.approx(3e5, rel=1e-3)
    assert found["law[|v| p]@chamber_b.pressure_pa"] == pytest.approx(5e5, rel=1e-3)
    valve = next(law for law in laws if law.name == names[2])
    assert (valve.command, valve.rest, valve.span) == ("valve.command_v", 4.95, 5.05)


def test_terms_over_the_atmosphere_need_one_and_those_over_a_command_one_alone():
    assert "law[p]@chamber" in law_terms(PLANTS["closed_chamber"]())
    assert not any("[u" in name or "[|u" in name for name in law_terms(PLANTS["gearbox"]()))
    assert "law[|u| p]@reservoir" in law_terms(PLANTS["servo_reservoir"]())
