"""Commands on modes and controllers: modes, design."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from studies.command_line.application import (
    Json,
    Output,
    Quiet,
    RigFile,
    Spread,
    answering,
    app,
    command_text,
    example,
)
from studies.command_line.closed_loop import Spec, tell_missed
from studies.command_line.files import read_all, writable, write_json


@app.command(cls=Spread, epilog=example("workbench modes rig.toml --export modes"))
def modes(
    rig: RigFile,
    place: Annotated[
        list[Path] | None,
        typer.Option("--place", metavar="REC...", help="Put the points where recordings go."),
    ] = None,
    number: Annotated[
        int | None, typer.Option("--number", metavar="N", min=1, help="Modes to place.")
    ] = None,
    regimes: Annotated[
        bool, typer.Option("--regimes", help="By flow regimes and stops, where there are fewer.")
    ] = False,
    cuts: Annotated[
        Path | None, typer.Option("--cuts", metavar="CUTS.toml", help="Intervals of your own.")
    ] = None,
    method: Annotated[
        str, typer.Option("--for", metavar="METHOD", help="Those that a design by it names.")
    ] = "",
    horizon: Annotated[
        str | None, typer.Option("--horizon", metavar="TIME", help="To predict; '50 ms'.")
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option("--tolerance", metavar="SHARE", help="Of a state's scale; 0.05.")
    ] = None,
    no_validity: Annotated[
        bool, typer.Option("--no-validity", help="Without the regions in which modes predict.")
    ] = False,
    json: Json = None,
    export: Annotated[
        Path | None,
        typer.Option("--export", metavar="DIR", help="MAT and NumPy file, table, figures."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """The hybrid state-space modes: poles, controllability, observability, error, validity."""
    with answering(quiet) as say:
        from studies.documents import modes_document
        from studies.mode_choice import chosen_modes, regions_of, trusted
        from studies.modes_text import modes_text
        from workbench.rig import load_rig

        writable(json, folders=[export], reads=[rig, cuts, *(place or ())])
        limits = trusted(horizon, tolerance)
        known = load_rig(rig)
        recordings = read_all(known, place, say)
        say("linearising")
        hybrid = chosen_modes(known, recordings, number, regimes, cuts, method)
        regions = () if no_validity else regions_of(hybrid, *limits, say)
        text = modes_text(hybrid, regions)
        if json:
            write_json(json, modes_document(known.name, hybrid, regions))
        if export:
            from studies.export import export_modes

            export_modes(hybrid, export, command_text(), text)
            say(f"modes in {export}")
        typer.echo(text)


@app.command(cls=Spread, epilog=example("workbench design rig.toml --controller lq -o lq.toml"))
def design(
    rig: RigFile,
    controller: Annotated[
        str,
        typer.Option(
            "--controller",
            metavar="METHOD",
            help="pid, lq, mpc, cascade, per-mode, nonlinear-mpc for a drive; axis-lq, axis-pid, "
            "feedback-linearisation for any axis; joint-lq, pressure, hybrid-mpc.",
        ),
    ],
    output: Output,
    spec: Spec = None,
    json: Json = None,
    quiet: Quiet = False,
) -> None:
    """One design per mode, written as a file that `check` reads.

    A specification gives the design its numbers and limits, and a verdict per line on the rig.  A
    table [axis-pid.gains] with proportional, integral and derivative takes the place of the tuning;
    the papers' gains are 250, 200, 8 on crr_rig and 4, 4, 0.4 on crr_arm.
    """
    with answering(quiet) as say:
        from controllers.design_file import design as design_controller
        from controllers.design_file import gains, write_design
        from studies.design_document import design_document
        from studies.design_doubts import design_doubts
        from studies.design_numbers import design_numbers
        from studies.design_report import design_report
        from studies.design_text import design_texts
        from studies.sample_times import require_multiple
        from studies.specification import read_specification
        from workbench.errors import listed
        from workbench.rig import load_rig

        writable(output, json, reads=[rig, spec])
        known = load_rig(rig)
        asked = read_specification(spec, known) if spec else None
        if asked and asked.numbers and controller not in asked.numbers:
            tables, are = asked.numbers, "are" if len(asked.numbers) > 1 else "is"
            told = f"{listed([f'[{name}]' for name in tables])} {are} not for {controller}"
            typer.echo(f"warning: {spec}: {told}, and not used", err=True)
        say(f"designing {controller}")
        with _placed_in(spec):
            numbers = design_numbers(asked, controller, known.plant) if asked else {}
            found = design_controller(controller, known.plant, numbers)
            time_s, name = found.controller.sample_time_s, f"{controller}.sample_time_s"
            require_multiple(known.plant, time_s, name)
        report = design_report(found, say)  # before the file: what cannot be told is not written
        write_design(found, output)
        if json:
            write_json(json, design_document(known.name, report))
        for name, gain in gains(found.controller):
            typer.echo(f"{name}: {gain}")
        for part in design_texts(report):
            typer.echo(part)
        for doubt in design_doubts(report):
            typer.echo(f"warning: {doubt}", err=True)
        typer.echo(f"wrote {output}")
        if asked and asked.asked:
            from studies.checked_runs import check_rig

            checked = check_rig(known, output, spec=asked, say=say)
            typer.echo("\n" + checked.judged.text)
            tell_missed(checked)


@contextmanager
def _placed_in(spec: Path | None) -> Iterator[None]:
    """Complaints of a design with their lines in the specification, where they are of it."""
    from workbench.errors import InputError
    from workbench.rig_text import RigText, read_text

    try:
        yield
    except InputError as error:
        if spec is None:
            raise
        text = RigText(read_text(spec)[0], str(spec), "a specification")
        raise text.placed(error, lambda message: _place(message.name)) from error


def _place(name: str) -> tuple[str, ...]:
    """Where a specification has a number of a design, or the limit of a state."""
    table, _, state = name.partition(".")
    return (table, state) if table == "limits" else tuple(name.split("."))
