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
from studies.command_line.files import read_all, warn_in_place, writable, write_json

IDENTIFY = "workbench identify friction drive4.toml run_*.csv stick_*.csv -o drive5.toml"


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
    into: Annotated[
        Path | None,
        typer.Option(
            "--into", metavar="RIG", help="Another rig that -o takes: a tank's valve on a drive."
        ),
    ] = None,
    tank: Annotated[
        str | None,
        typer.Option("--tank", metavar="VOLUME", help="Of dead-volume's tank; 0.344 l."),
    ] = None,
    figures: Figures = None,
    json: Json = None,
    quiet: Quiet = False,
) -> None:
    """Dead zone, flow, dead volumes, wall heat or friction from recordings made for them.

    Without PROCEDURE: what there is, in the order in which it is to be done.  With PROCEDURE
    alone: what to do and to record for it.
    """
    with answering(quiet) as say:
        from studies.identification_text import (
            guide_text,
            identification_document,
            identified_text,
            known_procedure,
            procedures_text,
        )

        if procedure is None or rig is None:
            typer.echo(procedures_text() if procedure is None else guide_text(procedure))
            return
        from workbench.errors import InputError, Message
        from workbench.rig import load_rig
        from workbench.rig_writing import write_rig

        chosen = known_procedure(procedure, tank)
        if not recordings:
            raise InputError(Message("needs recordings", procedure, chosen.manoeuvre))
        if into and not output:
            raise InputError(Message("writes nothing without -o", "--into", "-o FILE"))
        writable(output, reads=recordings)
        writable(json, folders=[figures], reads=[rig, into, *recordings], besides=[output])
        known, other = load_rig(rig), load_rig(into) if into else None
        warn_in_place(output, rig, into)
        read = read_all(known, recordings, say)
        say(f"identifying {chosen.gives}")
        found = chosen.run(known, read)
        better = found.improved(other, chosen.note(found, read, other)) if output else known
        write_json(json, identification_document(chosen, found))
        if figures:
            from studies.figures.identification import identification_figures
            from studies.figures.style import save_all

            save_all(identification_figures(found), figures, command_text())
            say(f"figures in {figures}")
        typer.echo(identified_text(chosen, found))
        if output:
            write_rig(better, output)
            typer.echo(f"wrote {output}")
