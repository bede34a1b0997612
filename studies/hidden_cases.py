"""Cases whose hidden effect can be seen: the last rule of the draw, which needs the model.

A size is drawn log-uniform in 15 to 60 % of typical, and drawn again until the refit with the true
effect, begun at its true size, removes more than 30 % of the misfit that is left without it.  Below
that the small differences of the truth are what a recording shows.  The truth itself knows no
model, so the rule stands here and not in ``studies/truth``; the rule there (differences below 20 %
of the hidden effect, in open-loop windows) holds again after each redraw.

``python -m studies.hidden_cases --seeds 1 2 3`` draws all cases anew and stores them (half an
hour); with ``--keep`` it starts from the stored cases.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing import Pool
from pathlib import Path

from studies.hidden_effects import public_name, recordings, user_rig
from studies.truth.cases import STORED, drawn_cases, read_cases, write_cases
from studies.truth.draw import HIDDEN, Case, draw_size, generator, resized
from studies.truth.misfit import scaled
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.problem import pose, staged
from workbench.fitting.start_states import carried

LEAST_SHARE = 0.30
MOST_DRAWS = 30
ITERATIONS = 14


@dataclass(frozen=True)
class Drawn:
    """A case that meets the rule, and the share of the misfit that the true effect removes."""

    case: Case
    share: float


def visible(case: Case) -> Drawn:
    """The case, drawn again until its hidden effect can be seen.

    A size no larger than one that was too small is not measured again.

    Raises
    ------
    RuntimeError
        If no size of that many draws meets the rule.
    """
    if case.hidden not in HIDDEN:
        return Drawn(case, float("nan"))
    too_small = 0.0
    for _ in range(MOST_DRAWS):
        if abs(case.size) > too_small:
            share = removed_share(case)
            if share > LEAST_SHARE:
                return Drawn(case, share)
            too_small = abs(case.size)
            print(
                f"{case.hidden} seed {case.seed}: {case.size:.3g} removes {share:.0%}", flush=True
            )
        rng = generator(case.hidden, case.seed, f"size {case.redraws}")
        case = resized(case, draw_size(case.hidden, rng))
        if abs(case.size) > too_small:
            (case,) = scaled([case])
    raise RuntimeError(f"{case.hidden} seed {case.seed}: no size of the range can be seen")


def removed_share(case: Case) -> float:
    """Share of the misfit that the refit with the true effect removes, from its true size."""
    ((train, _),) = recordings([case])
    problem = pose(user_rig(case), [train])
    base, candidate = problem.base, problem.whole.candidates[public_name(case)]
    windows = base.windows
    if candidate.strength not in windows.plant.values:
        windows = windows.with_plant(staged(problem.whole, candidate.member))
    unknowns = problem.unknowns(windows.plant, candidate)
    starts = carried(base.point.starts, base.windows, windows)
    fits = []
    for moved in (0.0, 1.0):  # nuisances at their priors, and where the base left them
        nominal = base.unknowns.values(moved * base.point.t)
        values = {**windows.plant.values, **nominal, candidate.strength: case.size}
        point = Point(unknowns.clipped(unknowns.scaled(values)), starts)
        fits.append(fit_windows(windows, unknowns, point, ITERATIONS))
    return (base.cost - min(fit.cost for fit in fits)) / problem.misfit


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw and store; see the module."""
    parser = argparse.ArgumentParser(prog="python -m studies.hidden_cases", description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument("--keep", action="store_true", help="start from the stored cases")
    parser.add_argument("-o", "--output", type=Path, default=STORED)
    asked = parser.parse_args(arguments)
    if asked.keep:
        cases = [case for (_, seed), case in read_cases().items() if seed in asked.seeds]
    else:
        cases = drawn_cases(asked.seeds)
    with Pool() as several:
        found = several.map(visible, cases, chunksize=1)
    for each in found:
        print(f"{each.case.hidden or 'nothing':<22}{each.case.seed:>5}{each.case.size:>11.3g}"
              f"{each.share:>7.2f}")  # fmt: skip
    write_cases([each.case for each in found], asked.output)


if __name__ == "__main__":
    main()
