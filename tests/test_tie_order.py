"""What does the same to a recording, in the order of the likelihood of the errors that are left."""

from dataclasses import replace

import numpy as np
import pytest
from test_judgement import named
from test_ties import followed, problem, sound  # noqa: F401  (fixtures)

from workbench.diagnosis.ranking import ranked
from workbench.diagnosis.tie_order import likeliest_first, surprise


@pytest.fixture
def crowd(problem, followed, sound):  # noqa: F811
    """Four that do the same, with the same errors."""
    alike = [named(sound, followed, k) for k in range(3)]
    return ranked(problem, followed.profiles, [sound, *alike], [], {})


def with_errors(row, factor, of="validation"):
    """A row whose fit leaves so many times the errors, held out or in training."""
    fit = getattr(row, of)
    at = replace(fit.derivatives, residual=factor * fit.derivatives.residual)
    return replace(row, **{of: replace(fit, derivatives=at)})


def names_of(rows):
    return [row.candidate.name for row in rows]


def test_the_one_with_the_smallest_errors_leads_and_the_first_three_are_printed(crowd):
    order = (3, 1, 0, 2)
    factors = {k: 1.0 + 0.2 * place for place, k in enumerate(order)}
    rows = [with_errors(row, factors[k]) for k, row in enumerate(crowd[:4])]
    found = likeliest_first((*rows, *crowd[4:]))

    expected = [crowd[k].candidate.name for k in order]
    assert names_of(found[:4]) == expected
    assert found[0].crowd == (expected[3],)
    for k in range(3):
        assert {found[k].candidate.name, *found[k].tied_with} == set(expected[:3])
    assert found[3].tied_with == () and found[3].crowd == ()
    assert names_of(found[4:]) == names_of(crowd[4:])


def test_training_errors_count_as_if_they_were_as_many_as_those_held_out(crowd):
    row = crowd[0]
    trained, held_out = (with_errors(row, 3.0, of) for of in ("fit", "validation"))
    assert surprise(trained, row) == pytest.approx(surprise(held_out, row), rel=1e-9)
    assert surprise(trained, row) > surprise(row, row)


def test_errors_of_all_outputs_count_in_effective_samples(crowd):
    row = crowd[0]
    windows = row.validation.windows
    effective = ((windows.weight > 0) / windows.correlation[:, :, None]).sum(axis=(1, 2)).mean()
    outputs = windows.weight.shape[0]
    added = surprise(with_errors(row, 100.0), row) - surprise(with_errors(row, 10.0), row)
    assert added == pytest.approx(effective * outputs * np.log(100.0), rel=1e-6)


def test_what_fails_a_criterion_stays_behind_however_small_its_errors(crowd):
    refused = with_errors(replace(crowd[1], accepted=False), 0.1)
    found = likeliest_first((crowd[0], refused, *crowd[2:]))
    assert found[3].candidate == refused.candidate


def test_one_alone_and_what_was_not_refitted_stay_as_they_are(crowd):
    alone = (replace(crowd[0], tied_with=(), crowd=()), *crowd[4:])
    assert likeliest_first(alone) == alone
    unfitted = (crowd[0], replace(crowd[1], fit=None, validation=None), *crowd[2:])
    assert likeliest_first(unfitted) == unfitted
    with pytest.raises(ValueError, match="held out"):
        surprise(unfitted[1], crowd[0])
