"""The command that runs a study."""

from pathlib import Path
from typing import Annotated

import typer

from studies.command_line.application import Quiet, Spread, answering, app, command_text, example


@app.command(cls=Spread, epilog=example("workbench study hidden-effects -o studies_out"))
def study(
    name: Annotated[str, typer.Argument(metavar="NAME|all", help="A study, or all of them.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder to write into.")
    ] = Path("studies_out"),
    full: Annotated[
        bool, typer.Option("--full", help="The whole grid, which may take hours; it resumes.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Run a study: its table, what it claims beside what came out, figures and numbers.

    Finished pieces stay in the folder; a second start goes on.  Exit code 1 where a claim fails.
    """
    with answering(quiet) as say:
        from studies.command_line.files import writable
        from studies.running import chosen, run_study
        from studies.study import Extent

        writable(folders=[output])
        extent = Extent.FULL if full else Extent.QUICK
        hold = [
            run_study(each, output / each.name, extent, command_text(), say, typer.echo)
            for each in chosen(name)
        ]
    if not all(hold):
        raise typer.Exit(1)
