"""What is said of an unstable loop: by its poles, not always that it oscillates."""

import numpy as np
import pytest

from studies.instability_text import growth_of, unstable_text

DT = 2e-3
TURN = 0.25 * np.array([[0.0, -1.0], [1.0, 0.0]])  # per sample: 19.9 Hz


def grown(factor, turn=0.0 * TURN):
    """A loop whose largest poles have this size and turn by this."""
    from scipy.linalg import block_diag, expm

    return block_diag(factor * expm(turn), 0.5)


@pytest.mark.parametrize(
    ("closed", "said"),
    [
        (grown(1.02, TURN), "an oscillation of 19.9 Hz grows, by e in 0.101 s"),
        (grown(1.02), "it runs away without oscillating, by e in 0.101 s"),
        (grown(-1.02), "an oscillation of 250 Hz grows"),
        (grown(1.0), "it drifts, nothing brings it back in time (a pole at one)"),
        (grown(-1.0), "an oscillation of 250 Hz hardly grows, poles of size one"),
        (grown(1.00007, TURN), "an oscillation of 19.9 Hz hardly grows, by e in 28.6 s"),
        (grown(1.00007, 1e-3 * TURN), "it drifts, nothing brings it back in time (by e in 28.6 s)"),
    ],
)
def test_an_unstable_loop_is_worded_by_its_largest_pole(closed, said):
    first, *_, last = unstable_text({"slide +": growth_of(closed, DT)}).split("\n")

    assert first.startswith(f"unstable: slide +: {said}")
    assert "workbench check" in last


def test_a_stable_loop_grows_nowhere():
    assert growth_of(grown(0.99, TURN), DT) is None
