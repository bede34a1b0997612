"""What a diagnosis says besides its verdict: why not, what strains the fit, what is not seen."""

from dataclasses import replace
from math import inf

import pytest
from test_report import LAG, LEAK, UNITS, diagnosis, ranked

from studies.documents import diagnosis_document
from studies.improvement_text import _taken_instead
from studies.text_of_ranking import ranking_text, reasons
from studies.text_of_results import diagnosis_text, moved_text
from workbench.diagnosis.judge import HELD_OUT_REASON, SHARE_REASON
from workbench.diagnosis.result import Verdict
from workbench.diagnosis.verdict import (
    BLIND_SHOWN,
    more_missing,
    refused_rivals,
    unexplained,
    worsened,
)
from workbench.diagnosis.warned import Of, Warned
from workbench.fitting.errors import SignalError
from workbench.fitting.posterior import Moved

FAR = ("slide.position 12 times its noise",)


def refused(*why, train, held_out, plain=1.0):
    row = ranked(LEAK, train)
    return replace(row, drop_validation=held_out, plain_validation=plain, reasons=why)


@pytest.mark.parametrize(
    ("row", "told"),
    [
        (refused(SHARE_REASON, train=0.206, held_out=0.144), "(17.5 % as the mean of both sets)"),
        (refused(SHARE_REASON, train=0.08, held_out=0.6), "(less than 10 % in training)"),
        (
            refused(HELD_OUT_REASON, train=0.2, held_out=0.176, plain=1.23),
            "(plain squared error x 1.23)",
        ),
        (refused(HELD_OUT_REASON, train=0.2, held_out=-0.3, plain=1.5), ""),
        (refused("its size is negligible", train=0.2, held_out=0.1), ""),
    ],
)
def test_a_reason_that_a_share_beside_it_seems_to_contradict_says_its_number(row, told):
    (said,) = reasons(row)
    assert said == f"{row.reasons[0]} {told}".strip()


def test_an_output_that_pays_for_another_is_told():
    def errors(position_m, pressure_pa, noise_pa=400.0):
        told = {
            "slide.position": SignalError(position_m, 90.0, 3e-5),
            "chamber_a.pressure": SignalError(pressure_pa, 90.0, noise_pa),
        }
        return {"train": told}

    (worse,) = map(str, worsened(errors(1e-3, 1000.0), errors(1e-4, 2500.0)))
    assert worse == "what is named makes errors larger: chamber_a.pressure in train (x 2.5)"
    assert worsened(errors(1e-3, 1000.0), errors(1e-4, 1400.0)) == ()
    assert worsened(errors(1e-3, 1000.0, noise_pa=2e3), errors(1e-4, 2500.0)) == ()
    assert worsened(errors(1e-3, 1000.0), {}) == ()


def test_the_plain_error_stands_in_the_json():
    found = diagnosis()
    rows = (replace(found.ranking[0], plain_validation=0.4), *found.ranking[1:])
    told = diagnosis_document(replace(found, ranking=rows), UNITS)["ranking"]
    assert [each["plain_error_validation"] for each in told] == [0.4, None]


def test_what_the_prior_fit_strains_is_told():
    moved = Moved("command_delay.delay_s", 0.0, 0.012, 5e-4, 0.004)
    found = replace(diagnosis(), strained=(moved,))

    assert "command_delay.delay 0 s to 0.012 s (3 prior deviations)" in diagnosis_text(found, UNITS)
    assert "suspects" not in diagnosis_text(diagnosis(), UNITS)
    (told,) = diagnosis_document(found, UNITS)["strained"]
    assert (told["name"], told["unit"]) == ("command_delay.delay", "s")
    assert told["prior_deviations_moved"] == pytest.approx(3.0)


def test_what_is_held_by_belief_is_not_told_to_be_at_the_end_of_its_range():
    ended = Moved("rod.mass_kg", 2.0, 2.5, float("nan"), 0.1)

    assert "at its bound; 5 prior deviations away" in moved_text([ended])
    held = moved_text([replace(ended, held=True)])
    assert "held by what is believed of it; 5 prior deviations away" in held
    assert "bound" not in held


def test_the_farthest_of_the_strained_come_first_and_the_rest_is_counted():
    rows = [Moved(f"p{k}.mass_kg", 1.0, 1.0 + 0.01 * k, 0.1, 0.001) for k in range(7)]
    text = diagnosis_text(replace(diagnosis(), strained=tuple(rows)), UNITS)
    (line,) = (each for each in text.splitlines() if "suspects" in each)
    assert line.index("p6.mass") < line.index("p5.mass") and line.endswith("and 3 more")
    assert "p0.mass" not in line


def test_a_no_beside_large_errors_names_what_the_recording_could_not_show():
    blind = [replace(ranked(LAG, 0.1), visible_from=3.0)] * (BLIND_SHOWN + 2)
    seen = replace(ranked(LEAK, 0.1), visible_from=0.2)

    (told,) = map(str, unexplained(FAR, Verdict.NOTHING_MISSING, [seen, *blind]))
    assert told.startswith(f"unexplained errors remain on held-out windows: {FAR[0]}; ")
    assert "would not show valve_lag" in told and "and 2 more" in told
    assert "chamber_leak" not in told
    (plain,) = map(str, unexplained(FAR, Verdict.NOTHING_MISSING, [seen]))
    assert plain.endswith(FAR[0])
    assert unexplained(FAR, Verdict.FOUND, blind) == ()
    assert unexplained(FAR, Verdict.SMALL_PROXY, [seen]) == (Warned(plain, Of.ERRORS_LEFT),)
    assert unexplained((), Verdict.NOTHING_MISSING, blind) == ()


@pytest.mark.parametrize(
    ("share", "left", "warns"), [(0.3, FAR, True), (0.9, FAR, False), (0.3, (), False)]
)
def test_what_leaves_much_far_above_the_noise_is_said_to_be_not_all(share, left, warns):
    row = replace(ranked(LEAK, share, True), drop_validation=share)
    said = [str(each) for each in more_missing(left, row)]

    assert bool(said) is warns
    assert all(FAR[0] in each and "more is missing" in each for each in said)
    assert more_missing(left, None) == ()


@pytest.mark.parametrize(
    ("train", "why", "warns"),
    [
        (0.88, (HELD_OUT_REASON,), True),
        (0.7, (HELD_OUT_REASON,), False),
        (0.88, ("negligible",), False),
    ],
)
def test_a_rival_that_only_the_held_out_recording_refuses_is_said(train, why, warns):
    """Half of the demo's recording named a leak of the spool, which stood for the piston's."""
    named = replace(ranked(LAG, 0.32, True), fit="its fit")
    rival = replace(refused(*why, train=train, held_out=-0.02), fit="its fit")

    said = [str(each) for each in refused_rivals((named, rival), named)]
    assert bool(said) is warns
    assert all("chamber_leak@chamber_a (88%)" in each for each in said)
    assert refused_rivals((rival,), None) == ()


def test_a_balance_that_gains_hardly_anything_is_not_blamed():
    found = diagnosis()
    gains = {"chamber_a.mass": 2.9, "slide.momentum": 0.4}
    chance = replace(found, where=replace(found.where, by_balance=gains))

    said = diagnosis_text(chance, UNITS)
    assert "hardly more than chance" in said and "follows" not in said
    assert diagnosis_document(chance, UNITS)["where"]["certain"] is False
    assert "hardly more than chance" not in diagnosis_text(found, UNITS)
    assert diagnosis_document(found, UNITS)["where"]["certain"] is True


def test_a_blind_candidate_says_so_after_its_reasons():
    row = replace(refused(SHARE_REASON, train=0.1, held_out=0.1), visible_from=inf)
    text = diagnosis_text(replace(diagnosis(Verdict.NOTHING_MISSING), ranking=(row,)), UNITS)
    assert "(10.0 % as the mean of both sets); this recording cannot show it" in text
    (told,) = diagnosis_document(replace(diagnosis(), ranking=(row,)), UNITS)["ranking"]
    assert told["visible_from"] is None and told["blind"] is True


def test_what_is_named_and_does_not_act_where_an_unknown_input_helps_most_is_told():
    """As a leak of the cap side of the rig, of which the force on its rod tells most."""
    found, told = diagnosis(), f"{LEAK.name} acts elsewhere"
    gains = {"slide.momentum": 436.0, "chamber_a.mass": 34.0}
    other = replace(found.where, balance="slide.momentum", by_balance=gains)
    alike = replace(other, by_balance=gains | {"chamber_a.mass": 434.0})

    assert told in diagnosis_text(replace(found, where=other), UNITS)
    for where in (found.where, alike):
        assert told not in diagnosis_text(replace(found, where=where), UNITS)


def test_what_passes_alone_beside_what_explains_more_is_not_told_to_be_missing():
    """A table in which three effects were ``accepted`` read as if all of them were missing."""
    found = diagnosis()
    rows = (*found.ranking, ranked(LAG, 0.2, accepted=True))
    text = diagnosis_text(replace(found, ranking=rows), UNITS)

    assert text.count("accepted") == 1
    assert f"would pass, but {LEAK.name} explains more" in text


def test_what_passes_beside_a_law_or_a_contradiction_is_not_told_as_accepted():
    """It stood there as ``accepted`` below "nothing in the catalogue"."""
    outlawed = ranking_text(diagnosis(Verdict.NOT_IN_CATALOGUE, law=object()))
    withdrawn = ranking_text(replace(diagnosis(), contradicted=True))

    assert "would pass, but the law explains clearly more" in outlawed
    assert "passes, but recording and rig contradict each other" in withdrawn
    assert "accepted" not in outlawed + withdrawn

    short = replace(diagnosis(), contradicted=True, too_short=True)
    assert "passes, but too little was fitted to name it" in ranking_text(short)
    assert "contradict" not in ranking_text(short)
    assert diagnosis_document(short, UNITS)["too_short"] is True


def test_an_effect_that_comes_in_before_a_law_is_told_beside_the_law():
    law = diagnosis(Verdict.NOT_IN_CATALOGUE, law=object())
    alone = replace(law, ranking=(ranked(LEAK, 0.1),))

    assert _taken_instead(law).startswith(f"; {LEAK.name} passes every criterion")
    assert _taken_instead(alone) == _taken_instead(diagnosis()) == ""


def test_a_tie_says_what_its_order_rests_on():
    """The drops beside it may be larger further down."""
    found = diagnosis()
    leader = replace(found.ranking[0], tied_with=(LAG.name,))
    for passes in (True, False):
        rival = ranked(LAG, 0.2, accepted=passes)
        tied = ranking_text(replace(found, ranking=(leader, rival)))
        assert ("where parameters stay near their priors" in tied) is passes
    assert "near their priors" not in ranking_text(found)
