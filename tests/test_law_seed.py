"""A law read off the smoothed missing term: which terms, how large, and when there is none."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from test_report import diagnosis

from workbench.diagnosis import law
from workbench.diagnosis.law_seed import seeds
from workbench.diagnosis.law_told import _balances
from workbench.diagnosis.missing_term import Course
from workbench.plants import PLANTS
from workbench.rig_laws import is_law, law_terms, with_laws

STEP_S, SAMPLES = 5e-3, 2000
MIDDLE_M, STROKE_M = 0.145, 0.2
PLAIN = PLANTS["servo_drive"]()
WHOLE = with_laws(PLAIN, law_terms(PLAIN))
WHOLE = WHOLE.with_values(
    {
        name: {"middle_m": MIDDLE_M, "stroke_m": STROKE_M}[name.rpartition(".")[2]]
        for name in WHOLE.parameters
        if is_law(name) and name.endswith(("middle_m", "stroke_m")) and "@slide" in name
    }
)
TERMS = [c for c in WHOLE.candidates.values() if is_law(c.name)]


def place_m():
    """A slide that is moved to and fro over its stroke, never twice in the same way."""
    time_s = STEP_S * np.arange(SAMPLES)
    waves = sum(np.sin(2 * np.pi * f * time_s + f) for f in (0.31, 0.83, 1.7))
    return MIDDLE_M + 0.5 * STROKE_M * waves / np.abs(waves).max()


def read_off(force_n):
    """Seeds of a missing force on the slide that was smoothed with 1 N of noise."""
    x = np.tile(PLAIN.lean().initial[:, None], SAMPLES)
    states = list(PLAIN.lean().state_list)
    x[states.index("slide.position_m")] = place_m()
    x[states.index("slide.velocity_m_s")] = np.gradient(place_m(), STEP_S)
    u, d, _ = PLAIN.nominal
    fed = (np.tile(values[:, None], SAMPLES) for values in (u, d))
    course = Course("slide.velocity_m_s", "missing@slide.momentum.flow", x, *fed)
    noise = np.random.default_rng(5).standard_normal(SAMPLES)
    where = replace(diagnosis().where, rest=force_n + noise, course=course)
    return seeds(WHOLE, where, TERMS, 3)


def test_the_terms_come_one_by_one_with_their_sizes():
    s = 2 * (place_m() - MIDDLE_M) / STROKE_M
    found = read_off(12.0 * np.sin(np.pi * s) - 6.0 * np.cos(2 * np.pi * s))

    assert [len(terms) for terms, _ in found] == [1, 2]
    terms, sizes = found[-1]
    assert [t.name for t in terms] == ["law[sin(2 pi x/L)]@slide", "law[cos(4 pi x/L)]@slide"]
    assert list(sizes.values()) == pytest.approx([12.0, -6.0], rel=0.05)


def test_a_force_at_one_place_is_three_terms_that_none_of_them_is_alone():
    s = (place_m() - 0.13) / 0.026
    found = read_off(-27.0 * s * np.exp((1.0 - s**2) / 2.0))

    assert [len(terms) for terms, _ in found] == [1, 2, 3]
    assert all("x" in term.cause.drivers[0] for term in found[-1][0])
    assert all(one[0] == other[0][: len(one[0])] for one, other in pairwise(found))


def test_what_no_term_explains_gives_no_law():
    assert read_off(10.0 * np.random.default_rng(7).standard_normal(SAMPLES)) == []


def test_a_term_that_the_rig_has_is_none_to_look_for(monkeypatch):
    """What is missing of it is no coefficient of its own."""
    there, absent = TERMS[:2]
    looked_for = []
    problem = SimpleNamespace(whole=WHOLE, added=(there,))
    monkeypatch.setattr(law, "with_terms", lambda problem: problem)
    for way in ("_term_by_term", "_at_once"):
        monkeypatch.setattr(law, way, lambda problem, terms, *of: looked_for.append(terms))

    assert law.empirical_law(problem, ()) is None
    assert all(absent in terms and there not in terms for terms in looked_for)
    assert len(looked_for) == 2


def test_a_force_on_a_rod_is_in_the_balance_of_its_joint():
    plant = PLANTS["crr_arm"]()
    names = ("law[v|v|]@rod", "law[constant]@cap")
    terms = [
        c for name, c in with_laws(plant, law_terms(plant)).candidates.items() if name in names
    ]

    assert {*_balances(plant, terms)} == {"joint.momentum", "cap.mass"}
