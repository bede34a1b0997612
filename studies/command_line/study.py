"""The command that runs studies."""

from pathlib import Path
from typing import Annotated

import typer

from studies.command_line.application import (
    NO,
    ProcessCount,
    Quiet,
    Scheduler,
    Spread,
    answering,
    app,
    command_text,
    example,
    workers_of,
)


@app.command(cls=Spread, epilog=example("workbench study hidden-effects -o studies_out"))
def study(
    name: Annotated[str, typer.Argument(metavar="NAME|all", help="A study, or all of them.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder to write into.")
    ] = Path("studies_out"),
    full: Annotated[
        bool, typer.Option("--full", help="The whole grid, which may take hours; it resumes.")
    ] = False,
    data: Annotated[
        Path | None, typer.Option("--data", metavar="DIR", help="Folder of the real recordings.")
    ] = None,
    workers: ProcessCount = None,
    scheduler: Scheduler = "",
    quiet: Quiet = False,
) -> None:
    """Run a study: its table, what it claims beside what came out, figures and numbers.

    Finished pieces stay in the folder; a second start goes on.  Exit code 1 where a claim fails.

    Draws go to all cores, or to a cluster.  Of all studies as many run at a time as there are
    cores; those that the same code has finished are not run again, and the report has all.
    """
    with answering(quiet) as say:
        from studies.command_line.files import writable
        from studies.report.studies import report_studies
        from studies.running import ALL, chosen, run_all, run_study
        from studies.study import Extent
        from studies.workers import working_with
        from workbench.recordings.folder import use_real_data

        writable(folders=[output])
        if data:
            use_real_data(data)
        extent = Extent.FULL if full else Extent.QUICK
        where, asked = workers_of(workers, scheduler), chosen(name)
        if name == ALL and not scheduler:
            failed = run_all(asked, output, extent, where.count, say, typer.echo, quiet)
        else:
            failed = []
            for each in asked:
                with working_with(where):
                    folder = output / each.name
                    failed += run_study(each, folder, extent, command_text(), say, typer.echo)
        typer.echo(f"\nwrote {report_studies(output, command_text())}")
    for told in failed:
        typer.echo(f"does not hold: {told}", err=True)
    if failed:
        raise typer.Exit(NO)
