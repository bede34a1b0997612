"""Which of those that do the same to a recording leads, by the errors that each leaves."""

from dataclasses import replace

import pytest
from test_judgement import named
from test_ties import followed, problem, sound  # noqa: F401  (fixtures)

from workbench.diagnosis.dominance import dominant_first, dominates
from workbench.diagnosis.ranking import ranked


@pytest.fixture
def crowd(problem, followed, sound):  # noqa: F811
    """Four that do the same, with the same errors."""
    alike = [named(sound, followed, k) for k in range(3)]
    return ranked(problem, followed.profiles, [sound, *alike], [], {})


def leaving(row, trained, held_out):
    """A row whose fit leaves so many times the errors in training, and held out."""
    for of, factor in (("fit", trained), ("validation", held_out)):
        fit = getattr(row, of)
        at = replace(fit.derivatives, residual=factor * fit.derivatives.residual)
        row = replace(row, **{of: replace(fit, derivatives=at)})
    return row


def names_of(rows):
    return [row.candidate.name for row in rows]


def test_one_with_smaller_errors_throughout_leads_from_the_end_of_a_crowd_too(crowd):
    rows = [*map(leaving, crowd[:4], (9.0, 8.9, 8.0, 7.0), (9.0, 8.9, 8.0, 7.0))]
    found = dominant_first((*rows, *crowd[4:]))

    before = names_of(crowd)
    assert names_of(found) == [before[3], *before[:3], *before[4:]]
    assert found[0].crowd == (before[2],)
    for row in found[:3]:
        assert {row.candidate.name, *row.tied_with} == {before[3], *before[:2]}
    assert found[3].tied_with == () and found[3].crowd == ()


@pytest.mark.parametrize(
    ("trained", "held_out"),
    [(6.0, 9.2), (9.2, 6.0), (8.9, 8.9), (9.0, 9.0)],
    ids=["in training alone", "held out alone", "hardly", "nowhere"],
)
def test_the_leader_stays_where_one_set_alone_speaks_against_it(crowd, trained, held_out):
    leader, other = leaving(crowd[0], 9.0, 9.0), leaving(crowd[1], trained, held_out)
    ranking = (leader, other, *crowd[4:])

    assert not dominates(other, leader)
    assert dominant_first(ranking) == ranking


def test_errors_below_the_noise_are_no_smaller_than_it(crowd):
    assert not dominates(leaving(crowd[1], 1e-3, 1e-4), leaving(crowd[0], 1e-2, 1e-3))


def test_what_fails_a_criterion_does_not_lead_however_small_its_errors(crowd):
    refused = leaving(replace(crowd[1], accepted=False), 0.1, 0.1)
    ranking = (crowd[0], refused, *crowd[2:])

    assert dominates(refused, crowd[0])
    assert dominant_first(ranking) == ranking


def test_one_alone_and_what_was_not_refitted_stay_as_they_are(crowd):
    alone = (replace(crowd[0], tied_with=(), crowd=()), *crowd[4:])
    unfitted = (crowd[0], replace(crowd[1], fit=None, validation=None), *crowd[2:])

    assert dominant_first(alone) == alone
    assert dominant_first(unfitted) == unfitted
