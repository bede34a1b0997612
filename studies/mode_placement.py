"""Study ``mode-placement``: how few modes predict a plant, and where their points should lie.

The modes are placed on one recording and judged on another, over 50 ms, with the plant's own
simulation under the recorded commands as the truth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from linearize.hybrid_simulation import sampled_hybrid
from linearize.modes import HybridModel
from linearize.placement import growing_modes
from linearize.prediction import PredictionError, fitted_single, prediction_of, single_of
from linearize.regions import validity
from linearize.standard import POSITION, VELOCITY, standard_modes
from linearize.visits import Windows, visited, windows
from studies.demo import DATA
from studies.figures.prediction import placement_figure, point_figure
from studies.gearbox_driving import Driving, driven, driving_table
from studies.mode_pictures import STEP_S, Step, map_figure, step_figure, step_of
from studies.modes_text import region_table
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns
from workbench.comparison.run import run as run_rig
from workbench.reading import read_recording
from workbench.rig import load_rig

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLACED_ON, JUDGED_ON = "train", "validation"
NUMBERS = {
    Extent.QUICK: (3, 4, 6, 8, 10, 14, 18, 22, 27, 35),
    Extent.FULL: (3, 4, 5, 6, 8, 10, 12, 14, 18, 22, 27, 35, 45, 60, 80),
}
THIRD = 1.0 / 3.0
Errors = Mapping[str, Mapping[int, PredictionError]]  # by recording and number of modes
Others = Mapping[str, Mapping[str, PredictionError]]  # by what else is judged, and recording

PLACED, STANDARD = "placed modes", "standard modes"


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Place, judge, and draw."""
    say("the plant under the recorded commands")
    rig = load_rig(DATA / "rig.toml")
    hybrid, lean = standard_modes(rig.plant), rig.plant.lean()
    seen = {
        name: visited(hybrid.model, lean, run_rig(rig, read_recording(rig, DATA / f"{name}.csv")))
        for name in (PLACED_ON, JUDGED_ON)
    }
    judged = {name: windows(each) for name, each in seen.items()}
    say("single linear models")
    singles = {name: fitted_single(hybrid, each) for name, each in judged.items()}
    say("modes, one more each time")
    wanted = NUMBERS[extent]
    placed = {}
    for each in growing_modes(hybrid, seen[PLACED_ON]):
        if len(each.modes) in wanted:
            placed[len(each.modes)] = each
        if len(each.modes) >= wanted[-1]:
            break
    errors = {
        name: {n: _error(each, judged[name]) for n, each in placed.items()} for name in judged
    }
    same = placed[len(hybrid.modes)]
    say("the regions in which the standard modes predict")
    regions = [validity(hybrid, mode) for mode in hybrid.modes]
    step = step_of({PLACED: same, STANDARD: hybrid})
    found = {
        "standard": {name: _error(hybrid, each) for name, each in judged.items()},
        "single": {name: prediction_of(singles[name], each) for name, each in judged.items()},
        "alone": {name: _best_alone(hybrid, each) for name, each in judged.items()},
    }
    gearbox = driven(say)
    tables = (
        _error_table(errors, found),
        driving_table(gearbox),
        region_table(regions, "standard mode"),
    )
    figures = {
        "error_by_number": _curve(errors, found, len(hybrid.modes)),
        "map_standard": map_figure(sampled_hybrid(hybrid, STEP_S)),
        "map_placed": map_figure(sampled_hybrid(same, STEP_S)),
        "step": step_figure(step),
        "poles_placed": point_figure(same, VELOCITY, POSITION),
    }
    numbers = {
        "placed": {name: {str(n): e.total for n, e in row.items()} for name, row in errors.items()},
        **{label: {name: e.total for name, e in row.items()} for label, row in found.items()},
    }
    numbers["gearbox"] = {
        name: {"placed": each.placed.total, "single": each.single.total}
        for name, each in gearbox.judged.items()
    }
    claims = (*_claims(errors, found, hybrid, step), _gearbox_claim(gearbox))
    return Outcome("\n\n".join(tables), claims, figures, numbers)


def _error(hybrid: HybridModel, judged: Windows) -> PredictionError:
    return prediction_of(sampled_hybrid(hybrid, STEP_S), judged)


def _best_alone(hybrid: HybridModel, judged: Windows) -> PredictionError:
    """The mode that predicts best when it is taken for the whole plant."""
    each = (prediction_of(single_of(hybrid, mode, STEP_S), judged) for mode in hybrid.modes)
    return min(each, key=lambda error: error.total)


def _curve(errors: Errors, found: Others, number_of_standard: int) -> Figure:
    numbers = [*errors[JUDGED_ON]]
    curves = {
        "placed, on the recording they were placed on": errors[PLACED_ON],
        "placed, on another recording": errors[JUDGED_ON],
    }
    standard, single = found["standard"][JUDGED_ON].total, found["single"][JUDGED_ON].total
    return placement_figure(
        numbers,
        {label: [row[n].total for n in numbers] for label, row in curves.items()},
        {"standard modes": (number_of_standard, standard)},
        {"best single linear model": single, "a third of it": single / 3.0},
    )


def _claims(errors: Errors, found: Others, hybrid: HybridModel, step: Step) -> Iterator[Claim]:
    n = len(hybrid.modes)
    placed, single = errors[JUDGED_ON][n].total, found["single"][JUDGED_ON].total
    claim = f"{n} placed modes: error over 50 ms at most a third of the best single model's"
    told = f"{placed:.4f} of {single:.4f}, {placed / single:.2f}"
    yield Claim(claim, told, placed <= THIRD * single)
    standard = found["standard"][JUDGED_ON].total
    claim = "placed modes err at most half as much as as many standard ones"
    yield Claim(claim, f"{placed / standard:.2f}", placed <= 0.5 * standard)
    share = step.end_share(PLACED)
    claim = "through a whole step the placed modes end within 5 % of the plant's way"
    yield Claim(claim, f"{share:.1%}", share <= 0.05)


def _gearbox_claim(found: Driving) -> Claim:
    n, worst = len(found.hybrid.modes), found.worst
    claim = f"gearbox, {n} placed modes: at most a third of the best single model's, too"
    told = f"at worst {worst.placed.total:.4f} of {worst.single.total:.4f}, {worst.share:.2f}"
    return Claim(claim, told, worst.share <= THIRD)


def _error_table(errors: Errors, found: Others) -> str:
    head = ("modes", f"error on {PLACED_ON}", f"on {JUDGED_ON}", "over the single model's")
    single = found["single"][JUDGED_ON].total
    rows = {f"placed {n}": [errors[name][n] for name in errors] for n in errors[JUDGED_ON]}
    rows |= {
        "standard": [*found["standard"].values()],
        "one mode alone, the best": [*found["alone"].values()],
        "one linear model, fitted": [*found["single"].values()],
    }
    return columns(
        head,
        [
            (label, *(f"{e.total:.4f}" for e in row), f"{row[-1].total / single:.2f}")
            for label, row in rows.items()
        ],
    )


STUDY = Study(
    name="mode-placement",
    question="how few linear modes predict a drive or a gearbox over 50 ms, and where are they?",
    source="issue of the hybrid modes; paper 003 Sec. V; physics.md 4.3",
    run=run,
)
