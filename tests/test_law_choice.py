"""Which term the votes of the windows choose: stable ones, within bounds, the plainer of two."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.diagnosis.law_choice import _numbers, _plainest, _Secants, _stable_gains
from workbench.plants import PLANTS
from workbench.rig_laws import with_laws


def secants(gains):
    """Terms that gain so much, in each window (rows) by themselves."""
    gains = np.asarray(gains, float)
    n_w, n = gains.shape
    grams = np.zeros((n_w, n + 1, n + 1))
    grams[:, range(n), range(n)] = 1.0
    grams[:, :n, -1] = grams[:, -1, :n] = -np.sqrt(gains)
    wide = np.full(n, 1e6)
    return _Secants(grams, -wide, wide, np.zeros((0, 0)), np.zeros(0))


def test_a_term_of_one_window_is_not_stable_however_much_it_gains():
    everywhere = np.column_stack([np.ones(20), np.zeros(20)])
    once = everywhere.copy()
    once[7, 1] = 1e6
    all_own = np.ones(2, bool)

    assert np.flatnonzero(_stable_gains(secants(everywhere), all_own)) == [0]
    assert secants(once).gains(np.arange(20))[0].argmax() == 1
    assert not _stable_gains(secants(once), all_own).any()
    assert not _stable_gains(secants(everywhere), np.array([False, True])).any()


def test_two_terms_that_are_all_but_one_share_the_votes():
    alike = np.column_stack([np.ones(20), np.ones(20)])
    alike[::2] *= (1.1, 0.9)
    alike[1::2] *= (0.9, 1.1)
    alike[0, 1] = 1.5

    assert _stable_gains(secants(alike), np.ones(2, bool)).argmax() == 1


def test_a_constant_is_told_in_place_of_what_gains_hardly_more_in_the_same_balance():
    names = ("law[p/p_s]@chamber_b", "law[constant]@chamber_a", "law[constant]@chamber_b")
    candidates = with_laws(PLANTS["servo_drive"](), names).candidates
    terms = [candidates[name] for name in names]

    assert _plainest(terms, np.array([1.0, 1.0, 0.96])) == 2
    assert _plainest(terms, np.array([1.0, 1.0, 0.94])) == 0


def test_a_gain_counts_within_the_bounds_of_a_coefficient():
    one = secants(np.ones((10, 1)))
    held = replace(one, most=np.array([0.5]))

    assert one.gains(np.arange(10))[0] == pytest.approx(10.0)
    assert held.gains(np.arange(10))[0] == pytest.approx(10 * (2 * 0.5 - 0.5**2))


@pytest.mark.parametrize("far", [1e160, np.inf, np.nan])
def test_a_term_that_loses_a_window_takes_no_others_with_it(far):
    """Its square overflowed, and what the others gain was no number either."""
    changes = np.random.default_rng(3).standard_normal((3, 4, 20))
    kept = changes.copy()
    changes[1, 2, 7], kept[1] = far, 0.0

    assert (_numbers(changes) == kept).all()
