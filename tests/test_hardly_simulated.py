"""An effect with which hardly anything can be simulated: no error of 0, and nothing is added."""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest
from test_diagnosis import bench, nothing

from studies.text_of_results import before_after_text, errors_text
from workbench.diagnosis.addition import add
from workbench.effect import Balance, Cause, Effect, Force, strength
from workbench.fitting.errors import require_simulated, signal_errors
from workbench.fitting.start_states import refit_starts
from workbench.fitting.windows import UNSEEN_PENALTY, cut_windows
from workbench.plants.cylinder_bench import cylinder_bench
from workbench.rig import default_rig

UNITS = {"rod.force": "rod.force_n"}


@dataclass(frozen=True, kw_only=True)
class Broken(Effect):
    """A force that is a number only where the rod is in one millimetre of its stroke."""

    causes = (
        Cause(
            name="broken",
            strength="amplitude_n",
            balance=Balance.MOMENTUM,
            drivers=("position",),
            shown_by="nothing",
            source="this test",
        ),
    )
    amplitude_n: float = strength(typical=5.0, lower=-100.0, upper=100.0)

    def terms(self, now):
        yield Force("rod", self.amplitude_n * ca.log(now["rod"].position_m - 0.029))


@pytest.fixture(scope="module")
def fit():
    plant = cylinder_bench().lean()
    return refit_starts(cut_windows(plant, [bench(1, nothing)], {"rod.force_n": 0.2}))


def losing(fit, which):
    """The fit without the samples (n_windows, L) that could not be simulated."""
    rows = np.where(which, UNSEEN_PENALTY, fit.residual[0])
    return replace(fit, derivatives=replace(fit.derivatives, residual=rows))


def all_but(fit, share):
    """Which samples are lost where the first ones of each window are not."""
    _, n, length = fit.residual.shape
    return np.tile(np.arange(length) >= share * length, (n, 1))


def test_where_hardly_anything_could_be_simulated_there_is_no_error(fit):
    hardly, half = (
        signal_errors(losing(fit, all_but(fit, share)))["rod.force"] for share in (0.04, 0.5)
    )
    (row,) = (
        line
        for line in before_after_text(
            {"train": signal_errors(fit)}, {"train": {"rod.force": hardly}}, UNITS
        ).splitlines()
        if line.startswith("train  rod.force")
    )

    assert np.isnan(hardly.rmse) and np.isnan(hardly.fit_percent) and hardly.left_out
    assert half.rmse == pytest.approx(0.2, rel=0.1)
    assert row.split()[-3] == "-" and row.split()[-1] == "-"
    told = errors_text({"train": {"rod.force": hardly}}, UNITS)
    assert "samples, the first at" in told and "which leaves too few for an RMSE" in told


def test_what_loses_most_samples_of_an_output_is_refused(fit):
    require_simulated("as it is", fit, None, losing(fit, all_but(fit, 0.5)))
    lost = losing(fit, all_but(fit, 0.4))

    with pytest.raises(ArithmeticError, match=r"rod\.force: with broken, \d+ of 2000 samples"):
        require_simulated("with broken", fit, lost)


def test_nothing_is_added_that_cannot_be_simulated():
    plant = cylinder_bench()
    plant = replace(plant, effects=(*plant.effects, Broken(name="broken")))

    with pytest.raises(ArithmeticError, match=r"with broken, .*the first at .* s of bench 1"):
        add(default_rig(plant), "broken", [bench(1, nothing)], [bench(2, nothing)])
