"""Commands that show: the demo, and the report of a folder."""

from pathlib import Path
from typing import Annotated

import typer

from studies.command_line.application import Quiet, Spread, answering, app, command_text, example
from studies.command_line.files import writable


@app.command(cls=Spread, epilog=example("workbench demo -o demo"))
def demo(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder to write into.")
    ] = Path("demo"),
    quiet: Quiet = False,
) -> None:
    """The main job, end to end, on a recording that ships with the project.

    Compare, find the missing effect, add it, linearise, design, check in closed loop, report.
    """
    with answering(quiet) as say:
        from studies.demo import run_demo

        writable(folders=[output])
        run_demo(output, command_text(), say, typer.echo)


@app.command(cls=Spread, epilog=example("workbench report demo"))
def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A folder with results.")],
    quiet: Quiet = False,
) -> None:
    """One self-contained HTML file from what a folder holds."""
    with answering(quiet) as say:
        from studies.report import PAGE
        from studies.report.studies import render

        writable(folder / PAGE)
        say(f"reading {folder}")
        typer.echo(f"wrote {render(folder)}")
