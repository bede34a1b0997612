"""With which fit an empirical law is told: that of its own errors, where it still has the law."""

import numpy as np
import pytest
from test_law_terms import SINE, asked_law, posed, wavy

from workbench.diagnosis import law_told
from workbench.diagnosis.law_told import settled_law
from workbench.diagnosis.size import sizes
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.own_errors import effective_by_output


def mean_square(fit):
    """The squared error of a sample by the weights of its own fit."""
    return float(np.sum(fit.residual**2) / np.sum(effective_by_output(fit.windows)))


def test_a_law_is_told_as_its_own_errors_weigh_it():
    problem = posed(wavy)
    law = asked_law(problem)
    told = settled_law(problem, law)
    (step,) = told.steps

    assert mean_square(law.fit) < 0.05 and mean_square(law.validation) < 0.05
    assert mean_square(told.fit) == pytest.approx(1.0, rel=0.2)
    assert mean_square(told.validation) == pytest.approx(1.0, rel=0.2)
    assert (step.fit, step.validation) == (told.fit, told.validation)
    assert (told.drop_train, told.drop_validation) == (law.drop_train, law.drop_validation)
    assert told.terms == sizes(told.fit, [*law.terms])


def test_a_law_is_not_told_with_a_fit_that_has_it_no_more(monkeypatch):
    problem = posed(wavy)
    law = asked_law(problem)
    gone = law.fit.point.t.copy()
    gone[law.fit.unknowns.names.index(f"{SINE}.size_n")] = 0.0
    none = Point(gone, law.fit.point.starts)
    without = fit_windows(law.fit.windows, law.fit.unknowns, none, iterations=0)
    monkeypatch.setattr(law_told, "settled_leader", lambda *_: without)

    assert settled_law(problem, law) == law
