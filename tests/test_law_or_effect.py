"""Where a law is told in place of an effect that would pass."""

from math import nan
from types import SimpleNamespace

import pytest

from workbench.diagnosis.diagnose import _leaves_less


@pytest.mark.parametrize(
    ("law", "effects", "less"),
    [
        ((0.9, 0.5), [(0.8, 0.5)], True),
        ((0.82, 0.5), [(0.8, 0.5)], False),
        ((1.6, 0.68), [(1.1, 0.38), (1.08, 0.3)], True),
        ((1.6, 0.68), [(1.1, 0.38), (0.98, 0.65)], False),
        ((1.05, 0.68), [(1.1, 0.38)], False),
        ((0.3, 0.1), [], True),
        ((0.1, 0.9), [], False),
        ((1.6, nan), [(1.1, 0.38)], False),
    ],
    ids=["a fifth less", "hardly less", "held out", "but for one", "more in training", "alone",
         "alone in what is held out", "nothing held out"],
)  # fmt: skip
def test_a_law_leaves_a_fifth_less_than_every_effect(law, effects, less):
    """In training, or held out where training leaves nothing for either to be told apart by."""
    law, *effects = (SimpleNamespace(drop_train=a, drop_validation=b) for a, b in (law, *effects))

    assert _leaves_less(law, effects) is less
