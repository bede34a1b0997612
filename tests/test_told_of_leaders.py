"""What follows for a leader: which fit it is told with, and what it is to be told from next."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from test_report import LAG, LEAK, ranked

from workbench.diagnosis import next_recording, settle
from workbench.diagnosis.judge import HELD_OUT_REASON, SHARE_REASON
from workbench.diagnosis.next_recording import recommended
from workbench.diagnosis.result import Verdict
from workbench.diagnosis.showing import NOTHING

PROBLEM = SimpleNamespace(
    base=SimpleNamespace(unknowns=SimpleNamespace(names=())),
    base_validation="before",
    validated=lambda fit: f"{fit} held out",
)


@pytest.fixture(autouse=True)
def judged_on_what_all_share(monkeypatch):
    """No recording stands behind these fits."""
    monkeypatch.setattr(settle, "on_its_own_yardstick", lambda found: found)


def proxy(candidate, *reasons):
    return replace(ranked(candidate, 0.15), reasons=reasons, fit=candidate.name)


@pytest.mark.parametrize(
    ("reasons", "rival"),
    [((SHARE_REASON,), LAG.name), ((SHARE_REASON, HELD_OUT_REASON), NOTHING)],
)
def test_a_proxy_is_to_be_told_from_others_that_explain_as_little(monkeypatch, reasons, rival):
    """A leak stood second behind a dead volume; the recording asked for did not tell them apart."""
    asked = []
    monkeypatch.setattr(next_recording, "next_recording", lambda fits: asked.append([*fits]))
    plant = SimpleNamespace(plant=SimpleNamespace(commands=("one",)))
    problem = SimpleNamespace(base=SimpleNamespace(windows=plant))
    ranking = (proxy(LEAK, SHARE_REASON), proxy(LAG, *reasons))

    recommended(problem, Verdict.SMALL_PROXY, ranking, lambda said: None)

    assert asked == [[LEAK.name, rival]]


@pytest.mark.parametrize(("plain", "told"), [(0.8, "settled"), (1.01, "settled"), (1.3, "judged")])
def test_a_leader_is_told_with_the_fit_that_predicts(monkeypatch, plain, told):
    """Errors that rise on what is held out beside a verdict that they fall are no answer."""
    row = replace(ranked(LEAK, 0.5, accepted=True), fit="judged", plain_validation=0.9)
    monkeypatch.setattr(settle, "settled_leader", lambda fit, candidate: "settled")
    monkeypatch.setattr(settle, "plain_ratio", lambda before, after: plain)
    monkeypatch.setattr(settle, "plain_chance", lambda before, after: 0.0)
    monkeypatch.setattr(settle, "sizes", lambda fit, names: {})

    (found,) = settle.with_settled_sizes(PROBLEM, (row,))

    assert found.fit == told


def test_a_leader_that_predicted_no_better_before_is_settled_all_the_same(monkeypatch):
    row = replace(ranked(LEAK, 0.5, accepted=True), fit="judged", plain_validation=1.5)
    monkeypatch.setattr(settle, "settled_leader", lambda fit, candidate: "settled")
    monkeypatch.setattr(settle, "plain_ratio", lambda before, after: 1.3)
    monkeypatch.setattr(settle, "plain_chance", lambda before, after: 0.0)
    monkeypatch.setattr(settle, "sizes", lambda fit, names: {})

    (found,) = settle.with_settled_sizes(PROBLEM, (row,))

    assert found.fit == "settled" and found.validation == "settled held out"


def test_what_is_added_keeps_the_fit_that_predicts(monkeypatch):
    """As the diagnosis tells it: an addition took the settled fit, whatever it did held out."""
    row = replace(ranked(LEAK, 0.5, accepted=True), fit="judged", plain_validation=0.9)
    monkeypatch.setattr(settle, "settled_leader", lambda fit, candidate: "settled")
    monkeypatch.setattr(settle, "plain_chance", lambda before, after: 0.0)
    monkeypatch.setattr(settle, "sizes", lambda fit, names: {})

    for plain, kept in ((1.3, "judged"), (0.8, "settled")):
        monkeypatch.setattr(settle, "plain_ratio", lambda before, after, plain=plain: plain)
        assert settle.settled_refit(PROBLEM, row).fit == kept


@pytest.mark.parametrize(("passed", "kept"), [((), "judged"), (("fails",), "settled")])
def test_what_is_added_keeps_the_size_that_was_accepted(passed, kept, monkeypatch):
    """As the diagnosis tells it; what failed its criteria before has no such size to lose."""
    row = replace(ranked(LEAK, 0.5, accepted=True), fit="judged", plain_validation=0.9)
    monkeypatch.setattr(settle, "settled_leader", lambda fit, candidate: "settled")
    monkeypatch.setattr(settle, "plain_ratio", lambda before, after: 0.8)
    monkeypatch.setattr(settle, "plain_chance", lambda before, after: 0.0)
    monkeypatch.setattr(settle, "sizes", lambda fit, names: {})
    monkeypatch.setattr(settle, "reasons_against", lambda base, found: passed)
    monkeypatch.setattr(settle, "size_reasons", lambda base, found: ["its size is at a bound"])

    assert settle.settled_refit(PROBLEM, row).fit == kept
