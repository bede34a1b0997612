"""What does the same to a recording, in the order of the likelihood of the errors that are left."""

from dataclasses import replace

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


def with_errors(row, factor):
    """A row whose fit leaves so many times the errors."""
    at = row.fit.derivatives
    fit = replace(row.fit, derivatives=replace(at, residual=factor * at.residual))
    return replace(row, fit=fit)


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


def test_errors_alike_are_decided_by_what_the_parameters_had_to_move(crowd):
    dearer = replace(crowd[0], fit=replace(crowd[0].fit, cost=crowd[0].fit.cost + 1.0))
    assert surprise(dearer, dearer) == pytest.approx(surprise(crowd[0], crowd[0]) + 1.0)
    assert names_of(likeliest_first((dearer, *crowd[1:])))[3] == dearer.candidate.name


def test_held_out_errors_count_too(crowd):
    at = crowd[0].validation.derivatives
    held_out = replace(crowd[0].validation, derivatives=replace(at, residual=2.0 * at.residual))
    worse = replace(crowd[0], validation=held_out)
    assert names_of(likeliest_first((worse, *crowd[1:])))[3] == worse.candidate.name


def test_what_fails_a_criterion_stays_behind_however_small_its_errors(crowd):
    refused = with_errors(replace(crowd[1], accepted=False), 0.1)
    found = likeliest_first((crowd[0], refused, *crowd[2:]))
    assert found[3].candidate == refused.candidate


def test_one_alone_and_what_was_not_refitted_stay_as_they_are(crowd):
    alone = (replace(crowd[0], tied_with=(), crowd=()), *crowd[4:])
    assert likeliest_first(alone) == alone
    unfitted = (crowd[0], replace(crowd[1], fit=None, validation=None), *crowd[2:])
    assert likeliest_first(unfitted) == unfitted
