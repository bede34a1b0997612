"""The command on estimators: estimate."""

from typing import Annotated

import typer

from studies.command_line.application import (
    Figures,
    Json,
    Quiet,
    Recordings,
    RigFile,
    Spread,
    answering,
    app,
    command_text,
    example,
)
from studies.command_line.files import read_all, writable, write_json

With = Annotated[
    str | None,
    typer.Option("--with", metavar="NAMES", help="Of kalman, ekf, ukf, imm, mhe; with commas."),
]
Hide = Annotated[
    str | None,
    typer.Option("--hide", metavar="EFFECT", help="What the simulated plant has besides."),
]


@app.command(
    cls=Spread,
    epilog=example("workbench estimate rig.toml train.csv --with ekf,ukf --figures figures"),
)
def estimate(
    rig: RigFile,
    recordings: Recordings,
    with_: With = None,
    hide: Hide = None,
    figures: Figures = None,
    json: Json = None,
    quiet: Quiet = False,
) -> None:
    """The estimators side by side on recordings, and on the rig's own plant under their inputs.

    Error of what is foretold at several horizons, consistency, time per sample; where the truth is
    known, error of each state, with an effect hidden, and where data lack something: holes, slow
    sensors, outliers, an output that is late.  The first 3 s count.
    """
    with answering(quiet) as say:
        from studies.estimating import USUAL, estimate_rig
        from studies.text_of_estimates import estimates_document, estimates_text
        from workbench.rig import load_rig

        writable(json, folders=[figures], reads=[rig, *recordings])
        known = load_rig(rig)
        names = [name.strip() for name in with_.split(",")] if with_ is not None else USUAL
        read = read_all(known, recordings, say)
        found = estimate_rig(known, read, names, hide or "", say)
        write_json(json, estimates_document(known.name, found))
        if figures:
            from studies.figures.estimates import estimate_figures
            from studies.figures.style import save_all

            save_all(estimate_figures(found), figures, command_text())
            say(f"figures in {figures}")
        typer.echo(estimates_text(found))
