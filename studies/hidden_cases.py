"""Cases whose hidden effect can be seen: the last rule of the draw, which needs the model.

The first twelve effects have sizes drawn log-uniform in 15 to 60 % of typical, such that
the refit with the true effect removes more than 30 % of the misfit that is left without it.  Below
that the small differences of the truth are what a recording shows.  The truth itself knows no
model, so the rule stands here and not in ``studies/truth``; the rule there (differences below 20 %
of the hidden effect, in open-loop windows) holds again after each redraw.

``python -m studies.hidden_cases spool_leak:2`` measures stored cases, draws those that break the
rule again, and stores them (about ten minutes).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from multiprocessing import Pool
from pathlib import Path

from studies.hidden_benches import BENCHES, SERVO_DRIVE, bench_of
from studies.hidden_effects import recordings
from studies.truth.case import Case, generator, resized
from studies.truth.cases import read_cases, write_cases
from workbench.diagnosis.refit import refit
from workbench.diagnosis.rough import rough_fit
from workbench.diagnosis.scan import scan
from workbench.fitting.gauss_newton import fit_windows
from workbench.fitting.linearised import Point
from workbench.fitting.problem import BELIEVED, pose, staged, training_drop
from workbench.fitting.start_states import carried
from workbench.recording import Recording

LEAST_SHARE = 0.30
LARGER = 1.25  # times a size that was too small: the next one to be measured
MOST_ROUNDS, MOST_DRAWS = 8, 200
ITERATIONS = 14


def visible(
    cases: Sequence[Case],
    recorded: Sequence[tuple[Recording, Recording]],
    store: Callable[[Sequence[Case]], None],
) -> None:
    """Draw cases again until their hidden effect can be seen; stored after every round.

    ``recorded`` are the recordings of the cases as they come.  Cases with nothing of the catalogue
    hidden stay.

    Raises
    ------
    RuntimeError
        If a case does not meet the rule after so many rounds.
    """
    done = list(cases)
    todo = [(k, train) for k, (train, _) in enumerate(recorded) if _hides(cases[k])]
    for _ in range(MOST_ROUNDS):
        with Pool() as several:
            found = several.starmap(removed_share, [(done[k], r) for k, r in todo], chunksize=1)
        for (k, _), share in zip(todo, found, strict=True):
            print(f"{done[k].hidden:<22}{done[k].seed:>5}{done[k].size:>11.3g}{share:>7.2f}")
        store(done)
        again = [k for (k, _), share in zip(todo, found, strict=True) if share <= LEAST_SHARE]
        if not again:
            return
        larger = bench_of(cases[0]).truth.scaled([_larger(done[k]) for k in again])
        for k, case in zip(again, larger, strict=True):
            done[k] = case
        pairs = recordings(larger)
        todo = [(k, train) for k, (train, _) in zip(again, pairs, strict=True)]
    names = ", ".join(f"{done[k].hidden} seed {done[k].seed}" for k, _ in todo)
    raise RuntimeError(f"{names}: not seen after {MOST_ROUNDS} rounds")


def _hides(case: Case) -> bool:
    return bench_of(case).public_name(case) is not None


def _larger(case: Case) -> Case:
    """The case with the next drawn size a quarter above its own, or more.

    Raises
    ------
    RuntimeError
        If the range ends before one is drawn.
    """
    least, draw_size = LARGER * abs(case.size), bench_of(case).truth.draw_size
    for _ in range(MOST_DRAWS):
        rng = generator(case.hidden, case.seed, f"size {case.redraws}")
        case = resized(case, draw_size(case.hidden, rng))
        if abs(case.size) > least:
            return case
    raise RuntimeError(f"{case.hidden} seed {case.seed}: {least / LARGER:.3g} is not seen yet")


def removed_share(case: Case, train: Recording) -> float:
    """Share of the misfit that the refit with the true effect removes.

    The refit begins at the true size, with all else at its prior and where the base left it, and
    where that is not enough as a diagnosis does.
    """
    bench = bench_of(case)
    problem = pose(bench.user_rig(case), [train], believed=BELIEVED)
    base, candidate = problem.base, problem.whole.candidates[bench.public_name(case)]
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
    share = training_drop(base, min(fits, key=lambda each: each.cost))
    if share > LEAST_SHARE:
        return share
    (profile,) = scan(
        problem.whole, base.windows, base.unknowns, base.point, [candidate], base.derivatives
    )
    return max(share, refit(problem, rough_fit(problem, profile)).drop_train)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, draw again and store; see the module."""
    parser = argparse.ArgumentParser(prog="python -m studies.hidden_cases", description=__doc__)
    parser.add_argument("cases", nargs="+", metavar="EFFECT:SEED")
    parser.add_argument("--plant", choices=BENCHES, default=SERVO_DRIVE.plant)
    parser.add_argument("-o", "--output", type=Path, help="instead of the plant's stored cases")
    asked = parser.parse_args(arguments)
    file = BENCHES[asked.plant].truth.stored
    stored = read_cases(file)
    named = [(name, int(seed)) for name, _, seed in (case.partition(":") for case in asked.cases)]

    def store(done: Sequence[Case]) -> None:
        stored.update(zip(named, done, strict=True))
        write_cases(stored.values(), asked.output or file)

    cases = [stored[key] for key in named]
    visible(cases, recordings(cases), store)


if __name__ == "__main__":
    main()
