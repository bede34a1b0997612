"""Command on closed loops: check."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from studies.command_line.application import (
    NO,
    Figures,
    Json,
    ProcessCount,
    Quiet,
    RigFile,
    Scheduler,
    Spread,
    answering,
    app,
    command_text,
    example,
    workers_of,
)
from studies.command_line.files import writable, write_json

if TYPE_CHECKING:
    from studies.checked_runs import CheckedRuns
    from studies.specification import Specification
    from workbench.rig import Rig

DesignFile = Annotated[Path, typer.Argument(metavar="DESIGN", help="What `design` wrote.")]
Spec = Annotated[
    Path | None, typer.Option("--spec", metavar="SPEC.toml", help="What the loop is asked for.")
]
CHECK = "workbench check rig.toml lq.toml --estimator mhe --scenario step --spec spec.toml"


@app.command(cls=Spread, epilog=example(CHECK))
def check(
    rig: RigFile,
    design: DesignFile,
    estimator: Annotated[
        list[str] | None,
        typer.Option(
            "--estimator",
            metavar="NAME",
            help="ekf (usual), ukf, imm, mhe, kalman; by mode: ekf,ukf@stick; raw: the measurement "
            "itself, for axis-pid; not for shifts.",
        ),
    ] = None,
    scenario: Annotated[
        list[str] | None,
        typer.Option(
            "--scenario", metavar="NAME", help="step, sine; n-h, h-n, ...; as named. [default: all]"
        ),
    ] = None,
    runs: Annotated[int, typer.Option("--runs", metavar="N", min=1, help="Plants to draw.")] = 1,
    workers: ProcessCount = None,
    scheduler: Scheduler = "",
    keep: Annotated[
        Path | None,
        typer.Option("--keep", metavar="FILE.jsonl", help="Keep runs; a second start goes on."),
    ] = None,
    spec: Spec = None,
    figures: Figures = None,
    json: Json = None,
    quiet: Quiet = False,
) -> None:
    """Closed loop against the full nonlinear plant; exit code 1 where the goal is missed.

    The goal is the specification, where one is given: a verdict per line, and with --runs how
    often each is missed, the worst runs, and which parameters matter.

    A gearbox is judged by its four shifts, each beside the open loop on the same plant.

    With --runs N > 1 the plant's parameters are drawn from their uncertainty, and the estimator
    keeps the rig's own values.  Runs are the same whatever the number of workers; a loop that is
    lost counts as missed.  With --figures also tables as CSV and LaTeX, and a report.
    """
    with answering(quiet) as say:
        from studies.checked_runs import check_rig
        from studies.tables import noted_tables
        from workbench.rig import load_rig

        writable(json, keep, folders=[figures], reads=[rig, design, spec])
        where = workers_of(workers or (1 if runs == 1 and not scheduler else None), scheduler)
        known = load_rig(rig)
        asked = _asked(spec, known, scenario or ()) if spec else None
        found = check_rig(
            known, design, estimator or (), scenario or (),
            spec=asked, runs=runs, workers=where, keep=keep, say=say,
        )  # fmt: skip
        write_json(json, found.document)
        with noted_tables() as noted:
            typer.echo(found.text)
        if figures:
            from studies.report.checks import report_check

            say("drawing")
            say(f"figures, tables and {report_check(found, noted, figures, command_text())}")
        if found.judged:
            tell_missed(found)
        elif not found.met:
            typer.echo(found.found.goal, err=True)
        if not found.met:
            raise typer.Exit(NO)


def _asked(spec: Path, rig: "Rig", scenarios: Iterable[str]) -> "Specification":
    """What a specification asks for in these scenarios; one without a line asks for nothing."""
    from studies.specification import read_specification
    from workbench.errors import InputError, Message

    found = read_specification(spec, rig, scenarios)
    if not found.asked:
        expected = 'a line such as rise_time = "150 ms"'
        raise InputError(Message("asks for nothing", expected=expected, file=str(spec)))
    return found


def tell_missed(found: "CheckedRuns") -> None:
    """Name on stderr the steps that never come near, and the lines that some run does not meet."""
    if found.unreached:
        typer.echo(f"not reached: {', '.join(found.unreached)}", err=True)
    if found.judged and not found.judged.met:
        typer.echo(f"out of specification: {', '.join(found.judged.missed)}", err=True)
