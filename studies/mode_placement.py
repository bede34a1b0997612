"""Study ``mode-placement``: how few modes predict a plant, and where their points should lie.

The modes are placed on two recordings and judged on others, over 50 ms, with the plant's own
simulation under the recorded commands as the truth.  One recording is not enough: modes that were
placed on it alone do as well on one other, and not on a third that goes elsewhere.
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
from linearize.visits import Visited, Windows, joined, visited, windows
from studies.demo import DATA
from studies.figures.prediction import placement_figure, point_figure
from studies.gearbox_driving import Driving, driven, driving_table
from studies.hidden_effects import recordings
from studies.mode_pictures import STEP_S, Step, map_figure, step_figure, step_of
from studies.modes_text import region_table
from studies.study import Claim, Extent, Outcome, Study
from studies.text import columns
from studies.truth.cases import read_cases
from workbench.comparison.run import simulate
from workbench.reading import read_recording
from workbench.recording import Recording
from workbench.rig import Rig, load_rig

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLACED_ON, JUDGED_ON = "train", "validation"
ALSO_PLACED_ON, FRESH = 6, 1  # seeds of the hidden-effects truth that hides nothing
SAMPLES = 4000  # of both recordings together
NUMBERS = {
    Extent.QUICK: (3, 4, 6, 8, 10, 14, 18, 22, 27, 35),
    Extent.FULL: (3, 4, 5, 6, 8, 10, 12, 14, 18, 22, 27, 35, 45, 60, 80),
}
THIRD = 1.0 / 3.0
DRIFT = 0.1  # of the way: nothing holds a free run of a place that only integrates
Errors = Mapping[str, Mapping[int, PredictionError]]  # by recording and number of modes
Others = Mapping[str, Mapping[str, PredictionError]]  # by what else is judged, and recording

PLACED, STANDARD = "placed modes", "standard modes"


def run(folder: Path, extent: Extent, say: Callable[[str], None]) -> Outcome:
    """Place, judge, and draw."""
    say("the plant under the recorded commands")
    rig = load_rig(DATA / "rig.toml")
    hybrid = standard_modes(rig.plant)
    seen = _seen(rig, hybrid)
    judged = {name: windows(each) for name, each in seen.items()}
    say("single linear models")
    singles = {name: fitted_single(hybrid, each) for name, each in judged.items()}
    say("modes, one more each time")
    wanted = NUMBERS[extent]
    placed = {}
    for each in growing_modes(hybrid, seen[PLACED_ON], SAMPLES):
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


def _seen(rig: Rig, hybrid: HybridModel) -> dict[str, Visited]:
    """What the plant visits: both recordings to place on as one, then those to judge on."""
    lean = rig.plant.lean()

    def gone(recording: Recording) -> Visited:
        return visited(hybrid.model, lean, simulate(rig, recording))

    own = [gone(read_recording(rig, DATA / f"{name}.csv")) for name in (PLACED_ON, JUDGED_ON)]
    cases = read_cases()
    (more, _), fresh = recordings([cases[None, ALSO_PLACED_ON], cases[None, FRESH]])
    seen = {PLACED_ON: joined([own[0], gone(more)]), JUDGED_ON: own[1]}
    return seen | {f"fresh {k + 1}": gone(each) for k, each in enumerate(fresh)}


def _error(hybrid: HybridModel, judged: Windows) -> PredictionError:
    return prediction_of(sampled_hybrid(hybrid, STEP_S), judged)


def _best_alone(hybrid: HybridModel, judged: Windows) -> PredictionError:
    """The mode that predicts best when it is taken for the whole plant."""
    each = (prediction_of(single_of(hybrid, mode, STEP_S), judged) for mode in hybrid.modes)
    return min(each, key=lambda error: error.total)


def _curve(errors: Errors, found: Others, number_of_standard: int) -> Figure:
    numbers = [*errors[JUDGED_ON]]
    curves = {
        "placed, on the recordings they were placed on": errors[PLACED_ON],
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
    shares = {
        name: row[n].total / found["single"][name].total
        for name, row in errors.items()
        if name != PLACED_ON
    }
    claim = f"{n} placed modes: error over 50 ms at most a third of the best single model's"
    told = ", ".join(f"{share:.2f} on {name}" for name, share in shares.items())
    yield Claim(claim, told, max(shares.values()) <= THIRD)
    placed = errors[JUDGED_ON][n].total
    standard = found["standard"][JUDGED_ON].total
    claim = "placed modes err at most half as much as as many standard ones"
    yield Claim(claim, f"{placed / standard:.2f}", placed <= 0.5 * standard)
    share = step.end_share(PLACED)
    claim = f"through a whole step the placed modes end within {DRIFT:.0%} of the plant's way"
    yield Claim(claim, f"{share:.1%}", share <= DRIFT)


def _gearbox_claim(found: Driving) -> Claim:
    n, worst = len(found.hybrid.modes), found.worst
    claim = f"gearbox, {n} placed modes: at most a third of the best single model's, too"
    told = f"at worst {worst.placed.total:.4f} of {worst.single.total:.4f}, {worst.share:.2f}"
    return Claim(claim, told, worst.share <= THIRD)


def _error_table(errors: Errors, found: Others) -> str:
    head = ("modes", *(f"on {name}" for name in errors), "over the single model's, at worst")
    rows = {f"placed {n}": [row[n] for row in errors.values()] for n in errors[JUDGED_ON]}
    rows |= {
        "standard": [*found["standard"].values()],
        "one mode alone, the best": [*found["alone"].values()],
        "one linear model, fitted": [*found["single"].values()],
    }
    singles = [each.total for each in found["single"].values()]
    lines = []
    for label, row in rows.items():
        totals = [each.total for each in row]
        worst = max(t / s for t, s in zip(totals[1:], singles[1:], strict=True))
        lines.append((label, *(f"{total:.4f}" for total in totals), f"{worst:.2f}"))
    return columns(head, lines)


STUDY = Study(
    name="mode-placement",
    question="how few linear modes predict a drive or a gearbox over 50 ms, and where are they?",
    source="issue of the hybrid modes; paper 003 Sec. V; physics.md 4.3",
    run=run,
    plants=("servo_drive", "gearbox"),
    seeds="1 and 6 of the truth that hides nothing; of each manoeuvre, in its name",
)
