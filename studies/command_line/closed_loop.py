"""Command on closed loops: check."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from studies.command_line.application import (
    NO,
    Figures,
    Json,
    Quiet,
    RigFile,
    Spread,
    answering,
    app,
    command_text,
    example,
)
from studies.command_line.files import writable, write_json

if TYPE_CHECKING:
    from studies.specification import Specification
    from studies.verdicts import Judged
    from studies.workers import Workers
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
            help="ekf (usual), ukf, imm, mhe, kalman; not for shifts; by mode: ekf,ukf@stick.",
        ),
    ] = None,
    scenario: Annotated[
        list[str] | None,
        typer.Option(
            "--scenario", metavar="NAME", help="step, sine; n-h, h-n, ...; as named; all."
        ),
    ] = None,
    runs: Annotated[int, typer.Option("--runs", metavar="N", min=1, help="Plants to draw.")] = 1,
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="K", min=1, help="Processes; all cores.")
    ] = None,
    scheduler: Annotated[
        str, typer.Option("--scheduler", metavar="tcp://HOST:PORT", help="Of a Dask cluster.")
    ] = "",
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
    lost counts as missed.
    """
    with answering(quiet) as say:
        from studies.checked_runs import check_rig
        from workbench.rig import load_rig

        writable(json, keep, folders=[figures])
        where = _workers(workers, scheduler, runs)
        known = load_rig(rig)
        asked = _asked(spec, known, scenario or ()) if spec else None
        found = check_rig(
            known, design, estimator or (), scenario or (),
            spec=asked, runs=runs, workers=where, keep=keep, say=say,
        )  # fmt: skip
        write_json(json, found.document)
        if figures:
            from studies.figures.style import save_all

            say("drawing")
            save_all(found.figures(), figures, command_text())
            say(f"figures in {figures}")
        typer.echo(found.text)
        if found.judged:
            tell_missed(found.judged)
        elif not found.met:
            typer.echo(found.found.goal, err=True)
        if not found.met:
            raise typer.Exit(NO)


def _workers(processes: int | None, scheduler: str, runs: int) -> "Workers":
    """Where runs are worked on; one run in this process, unless there is a cluster."""
    from studies.workers import Workers
    from workbench.errors import InputError, Message

    if processes and scheduler:
        raise InputError(Message("a cluster has its own workers", "--workers", "no --scheduler"))
    return Workers(1 if runs == 1 else processes or 0, scheduler)


def _asked(spec: Path, rig: "Rig", scenarios: Iterable[str]) -> "Specification":
    """What a specification asks for in these scenarios; one without a line asks for nothing."""
    from studies.specification import read_specification
    from workbench.errors import InputError, Message

    found = read_specification(spec, rig, scenarios)
    if not found.asked:
        expected = 'a line such as rise_time = "150 ms"'
        raise InputError(Message("asks for nothing", expected=expected, file=str(spec)))
    return found


def tell_missed(judged: "Judged") -> None:
    """Name on stderr the lines that some run does not meet."""
    if not judged.met:
        typer.echo(f"out of specification: {', '.join(judged.missed)}", err=True)
