"""Recordings of the true drive: training and validation tables, as a person would hand them over.

python -m studies.truth.record --hidden valve_lag --seed 3 -o DIR
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from studies.truth.case import Case, generator
from studies.truth.draw import EFFECTS, HIDDEN, draw, drive_of
from studies.truth.manoeuvre import training_reference, validation_reference
from studies.truth.misfit import scaled
from studies.truth.run import Run, closed_loop, commanded

__all__ = ["HIDDEN", "Case", "Table", "draw", "record", "scaled", "write_csv"]

Table = Mapping[str, np.ndarray]
_FORMAT = {
    "time_s": "%.3f",
    "command_V": "%.6f",
    "position_mm": "%.4f",
    "pressure_a_bar": "%.6f",
    "pressure_b_bar": "%.6f",
    "supply_bar": "%.6f",
}


def record(cases: Sequence[Case]) -> list[tuple[Table, Table]]:
    """Training and validation table of every case, all integrated in one batch (10 s, 1 kHz).

    Channels: time_s, command_V, position_mm, pressure_a_bar, pressure_b_bar (absolute) and,
    unless the supply droops, supply_bar.
    """
    run = run_cases(cases)
    return [
        (table(run, 2 * i, case.supply_recorded), table(run, 2 * i + 1, case.supply_recorded))
        for i, case in enumerate(cases)
    ]


def run_cases(cases: Sequence[Case]) -> Run:
    """The batch behind `record`: columns 2 i (training) and 2 i + 1 (validation), in SI."""
    drives, references, generators = [], [], []
    for case in cases:
        for purpose, reference in (
            ("training", training_reference),
            ("validation", validation_reference),
        ):
            drives.append(drive_of(case))
            references.append(reference(generator(case.hidden, case.seed, purpose)))
            generators.append(generator(case.hidden, case.seed, purpose + " noise"))
    return closed_loop(drives, np.stack(references, axis=1), generators)


def played(
    case: Case, commands_v: np.ndarray, reference_m: np.ndarray | None, start_m: float
) -> Table:
    """What the true drive of a case records of commands, or of a reference in its own loop, (n,).

    The loop is that of the other recordings, with their unknown dead zone, not the rehearsal's; it
    rests where there is no reference (NaN).
    """
    drives = [drive_of(case)]
    generators = [generator(case.hidden, case.seed, "next noise")]
    if reference_m is None:
        run = commanded(drives, commands_v[:, None], generators, start_m)
    else:
        run = closed_loop(drives, reference_m[:, None], generators)
    return table(run, 0, case.supply_recorded)


def table(run: Run, column: int, supply_recorded: bool) -> Table:
    """One column of a batch as a person would hand it over."""
    r = {name: values[:, column] for name, values in run.readings.items()}
    found = dict(
        time_s=np.arange(len(r["command_v"])) * 1e-3,
        command_V=r["command_v"],
        position_mm=r["position_m"] * 1e3,
        pressure_a_bar=r["pressure_a_pa"] * 1e-5,
        pressure_b_bar=r["pressure_b_pa"] * 1e-5,
    )
    return {**found, "supply_bar": r["supply_pa"] * 1e-5} if supply_recorded else found


def write_csv(table: Table, path: Path | str) -> None:
    """Comma-separated, one header line, fixed digits: the same table gives the same bytes."""
    np.savetxt(
        path,
        np.column_stack(list(table.values())),
        fmt=[_FORMAT[n] for n in table],
        delimiter=",",
        header=",".join(table),
        comments="",
        newline="\n",
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Write train.csv, validation.csv and truth.json (the answer, for whoever checks)."""
    parser = argparse.ArgumentParser(prog="python -m studies.truth.record", description=__doc__)
    parser.add_argument("--hidden", choices=[*EFFECTS, "none"], default="none")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--unscaled", action="store_true", help="leave out the misfit rule")
    options = parser.parse_args(arguments)
    case = draw(None if options.hidden == "none" else options.hidden, options.seed)
    case = case if options.unscaled else scaled([case])[0]
    training, validation = record([case])[0]
    options.output.mkdir(parents=True, exist_ok=True)
    write_csv(training, options.output / "train.csv")
    write_csv(validation, options.output / "validation.csv")
    answer = json.dumps(asdict(case), indent=1)
    (options.output / "truth.json").write_text(answer + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
