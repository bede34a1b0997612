"""Study of delays: what it asks, and claims that say what the numbers say."""

import pytest

from studies.delay_study import COMPARED, CYCLE, DELAYS_MS, TRACKING, Late, outcome, pieces, worked

MARGINS_MS = [6.0, 7.0]


def rows(cycles_from_ms=6.0, at_redraws=(2.0, 4.0)):
    """A loop that rests up to a delay and cycles from there on; tracking worse with redraws."""
    asked = [*pieces(1)]
    at_1, at_10 = at_redraws
    found = []
    for piece in asked:
        cycle = 5.0 if piece.delay_ms >= cycles_from_ms else 0.01
        tracking = {0.0: 1.0, 1.0: at_1, 10.0: at_10}[piece.redraw_hz]
        margins = MARGINS_MS if piece.design == "lq" else []
        found.append({"found": {CYCLE: cycle, TRACKING: tracking}, "margins_ms": margins})
    return asked, found


def holding(said):
    return [claim.holds for claim in said.claims]


def test_every_delay_and_redraw_is_asked_of_every_design_once():
    keys = [piece.key for piece in pieces(2)]

    assert len(set(keys)) == len(keys)
    assert {piece.design for piece in pieces(1)} == set(COMPARED)


def test_claims_hold_where_the_loop_cycles_at_its_margin():
    said = outcome(*rows())

    assert all(holding(said))
    assert "delay margins of the modes of lq: 6 to 7 ms" in said.text


@pytest.mark.parametrize(
    ("options", "fails"),
    [
        ({"cycles_from_ms": 2.0}, 0),
        ({"cycles_from_ms": 99.0}, 1),
        ({"at_redraws": (4.0, 2.0)}, 2),
    ],
)
def test_a_claim_that_the_numbers_refute_fails(options, fails):
    assert not holding(outcome(*rows(**options)))[fails]


def test_a_lost_loop_counts_as_infinite():
    asked, found = rows()
    last = max(DELAYS_MS)
    for piece, row in zip(asked, found, strict=True):
        if piece.delay_ms == last:
            row["found"] = {CYCLE: None, TRACKING: None}

    assert all(holding(outcome(asked, found)))


def test_a_late_command_makes_the_drive_cycle():
    """12 ms against delay margins of 6 to 7.5 ms."""
    late = worked(Late("lq", 0, delay_ms=12.0))

    assert 6.0 < min(late["margins_ms"]) <= max(late["margins_ms"]) < 7.5
    assert late["found"][CYCLE] > 1.0
