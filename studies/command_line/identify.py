"""The command on dedicated recordings: identify."""

from pathlib import Path
from typing import Annotated

import typer

from studies.command_line.application import (
    Figures,
    Json,
    Quiet,
    Spread,
    answering,
    app,
    command_text,
    example,
)
from studies.command_line.files import read_all, writable, write_json

IDENTIFY = "workbench identify friction drive.toml run_*.csv -o drive2.toml --figures figures"


@app.command(cls=Spread, epilog=example(IDENTIFY))
def identify(
    procedure: Annotated[
        str | None, typer.Argument(metavar="[PROCEDURE]", help="None lists them.")
    ] = None,
    rig: Annotated[Path | None, typer.Argument(metavar="RIG", help="Rig file (TOML).")] = None,
    recordings: Annotated[
        list[Path] | None, typer.Argument(metavar="REC...", help="Dedicated recordings.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="The rig with the values.")
    ] = None,
    tank: Annotated[
        str | None,
        typer.Option("--tank", metavar="VOLUME", help="Of dead-volume's tank; 0.344 l."),
    ] = None,
    figures: Figures = None,
    json: Json = None,
    quiet: Quiet = False,
) -> None:
    """Flow, dead zone, wall heat, friction or dead volumes from recordings made for them.

    Without PROCEDURE: what there is, and the recording that each needs.
    """
    with answering(quiet) as say:
        from studies.identification_text import identified_text, known_procedure, procedures_text

        if procedure is None:
            typer.echo(procedures_text())
            return
        from studies.documents import identification_document
        from workbench.errors import InputError, Message
        from workbench.rig import load_rig
        from workbench.rig_writing import write_rig

        chosen = known_procedure(procedure, tank)
        if rig is None or not recordings:
            raise InputError(Message("needs a rig and recordings", procedure, chosen.manoeuvre))
        writable(output, json, folders=[figures])
        known = load_rig(rig)
        read = read_all(known, recordings, say)
        say(f"identifying {chosen.gives}")
        found = chosen.run(known, read)
        write_json(json, identification_document(chosen.name, found))
        if figures:
            from studies.figures.identification import identification_figures
            from studies.figures.style import save_all

            save_all(identification_figures(found), figures, command_text())
            say(f"figures in {figures}")
        typer.echo(identified_text(found))
        if output:
            write_rig(found.improved(), output)
            typer.echo(f"wrote {output}")
