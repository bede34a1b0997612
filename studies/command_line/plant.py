"""Commands on a plant and its recordings: simulate, compare."""

from pathlib import Path
from typing import Annotated

import typer

from studies.command_line.application import (
    Figures,
    Json,
    Output,
    Quiet,
    Recordings,
    RigFile,
    Spread,
    answering,
    app,
    command_text,
    example,
)
from studies.command_line.files import read_all, text_to_write, writable, write_json

TABLES = "tables"  # a folder inside that of the figures


@app.command(cls=Spread, epilog=example("workbench simulate rig.toml train.csv -o simulated.csv"))
def simulate(
    rig: RigFile,
    inputs: Annotated[Path, typer.Argument(metavar="INPUTS.csv", help="Recorded commands.")],
    output: Output,
    quiet: Quiet = False,
) -> None:
    """Run the nonlinear plant under recorded commands.

    It starts from the first recorded sample where outputs are recorded too, else from the plant's
    own initial state.
    """
    with answering(quiet) as say:
        from workbench.comparison.run import read_inputs
        from workbench.comparison.run import simulate as simulated
        from workbench.reading.writer import write_recording
        from workbench.rig import load_rig

        text_to_write(output)
        writable(output, reads=[rig, inputs])
        found = load_rig(rig)
        recording = read_inputs(found, inputs)
        say(f"simulating {len(recording)} samples of {recording.name}")
        write_recording(simulated(found, recording), output, ambient_pa=found.ambient_pa)
        typer.echo(f"wrote {output}")


@app.command(
    cls=Spread,
    epilog=example(
        "workbench compare rig.toml train.csv validation.csv --figures figures --json errors.json"
    ),
)
def compare(
    rig: RigFile,
    recordings: Recordings,
    figures: Figures = None,
    json: Json = None,
    quiet: Quiet = False,
) -> None:
    """Error by signal, horizon and regime, and where the plant fails.

    With --figures also the tables, as CSV and LaTeX, in a folder beside the figures.
    """
    with answering(quiet) as say:
        from studies.documents import comparison_document
        from studies.tables import noted_tables, write_tables
        from studies.text_of_comparison import comparison_text
        from workbench.comparison import compare
        from workbench.rig import load_rig

        writable(json, folders=[figures], reads=[rig, *recordings])
        found = load_rig(rig)
        read = read_all(found, recordings, say)
        say("comparing: one step, windows, free run")
        comparison = compare(found, read)
        write_json(json, comparison_document(comparison))
        with noted_tables() as noted:
            text = comparison_text(comparison)
        if figures:
            from studies.figures.comparison import comparison_figures
            from studies.figures.style import save_all

            save_all(comparison_figures(comparison), figures, command_text())
            write_tables(text, noted, figures / TABLES)
            say(f"figures in {figures}, tables in {figures / TABLES}")
        typer.echo(text)
