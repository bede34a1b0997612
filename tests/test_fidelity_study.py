"""Study of fidelity: what is taken away is gone, and the claims say what the numbers say."""

import numpy as np
import pytest

from studies.fidelity_study import DRAWS, JUDGED, LACKING, WHOLE, Poorer, outcome, worked
from studies.study import Extent
from studies.yardsticks import LARGE
from workbench.plants.servo_drive import servo_drive


def rows(**factors):
    """Every figure 1 with the whole model, and so many times as large without something."""
    named = {name.replace("_", " "): factor for name, factor in factors.items()}
    return {n: [dict.fromkeys(JUDGED, named.get(n, 1.0))] * 3 for n in LACKING}


WORTH = {"dead zone of the valve": 3.0, "dry friction": 4.0, "dead volumes": 2.1}


def test_every_lack_changes_the_plant_and_the_whole_one_nothing():
    plant = servo_drive()
    at = np.array([0.145, 0.2, 5e5, 2e-4, 5e5, 2e-4, 1e-5])

    def rates(one):
        model = one.lean().model
        x = dict(zip(plant.lean().model.states, at, strict=True))
        _, d, p = one.lean().nominal
        found = model.f([x[name] for name in model.states], [5.6], d, p)[0].full().ravel()
        return dict(zip(model.states, found, strict=True))

    whole = rates(plant)
    assert rates(LACKING[WHOLE](plant)) == whole
    for name, less in LACKING.items():
        poorer = rates(less(plant))
        if name != WHOLE:
            assert any(not np.isclose(poorer[s], whole[s], rtol=1e-6) for s in poorer), name


def test_claims_hold_where_the_numbers_say_so():
    assert all(claim.holds for claim in outcome(rows() | worth(WORTH)).claims)


@pytest.mark.parametrize(
    ("factors", "fails"),
    [
        ({"dry friction": 1.5}, "without dry friction"),
        ({"dead volumes": 1.9}, "without dead volumes"),
        ({"heat of the walls": 1.3}, "heat of the walls is not"),
        ({"stiction": 0.8}, "no model that lacks something"),
    ],
)
def test_a_claim_that_the_numbers_refute_fails(factors, fails):
    said = outcome(rows() | worth({**WORTH, **factors})).claims

    assert [claim.claim.startswith(fails) for claim in said if not claim.holds] == [True]


def worth(factors):
    return {n: [dict.fromkeys(JUDGED, f)] * 3 for n, f in factors.items()}


def test_a_loop_without_a_figure_counts_as_infinitely_worse():
    lost = {"dry friction": [dict.fromkeys(JUDGED)] * DRAWS[Extent.QUICK]}
    found = outcome(rows() | worth(WORTH) | lost)

    assert "- (- x)" in found.text
    assert found.claims[1].holds


@pytest.mark.slow
def test_a_model_without_dry_friction_follows_a_sine_worse():
    whole, poorer = (worked(Poorer(name, 0))["found"][LARGE] for name in (WHOLE, "dry friction"))

    assert poorer > 5.0 * whole
