"""Commands on modes and closed loops: modes, design, check."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from studies.command_line.application import (
    NO,
    Figures,
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
from studies.command_line.files import read_all, writable, write_json

if TYPE_CHECKING:
    from controllers.design_file import Design
    from studies.closed_loop_check import Check
    from studies.following_check import FollowingCheck
    from studies.shift_check import ShiftCheck
    from studies.specification import Specification
    from studies.verdicts import Judged
    from workbench.rig import Rig

DesignFile = Annotated[Path, typer.Argument(metavar="DESIGN", help="What `design` wrote.")]
Several = Annotated[int, typer.Option("--runs", metavar="N", min=1, help="Plants to draw.")]
Spec = Annotated[
    Path | None, typer.Option("--spec", metavar="SPEC.toml", help="What the loop is asked for.")
]
CHECK = "workbench check rig.toml lq.toml --estimator mhe --scenario step --spec spec.toml"


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

        writable(json, folders=[export])
        limits = trusted(horizon, tolerance)
        known = load_rig(rig)
        recordings = read_all(known, place, say)
        say("linearising")
        hybrid = chosen_modes(known, recordings, number, regimes, cuts)
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
            help="pid, lq, mpc, cascade, nonlinear-mpc for a drive; axis-lq, axis-pid, "
            "feedback-linearisation for any axis; joint-lq, pressure, hybrid-mpc.",
        ),
    ],
    output: Output,
    spec: Spec = None,
    quiet: Quiet = False,
) -> None:
    """One design per mode, written as a file that `check` reads.

    A specification gives the design its numbers and limits, and a verdict per line on the rig.
    """
    with answering(quiet) as say:
        from controllers.design_file import design as design_controller
        from controllers.design_file import gains, write_design
        from studies.specification import design_numbers, read_specification
        from workbench.rig import load_rig

        writable(output)
        known = load_rig(rig)
        asked = read_specification(spec, known) if spec else None
        numbers = design_numbers(asked, controller, known.plant) if asked else {}
        say(f"designing {controller}")
        found = design_controller(controller, known.plant, numbers)
        write_design(found, output)
        for name, gain in gains(found.controller):
            typer.echo(f"{name}: {gain}")
        if found.method == "hybrid-mpc":
            from studies.design_text import search_text

            typer.echo(search_text(found.controller))
        else:
            _certify(found, say)
        typer.echo(f"wrote {output}")
        if asked and asked.asked:
            from studies.verdicts import judge

            checked = _closed_loop(known, output, (), (), 1, say)
            judged = judge(asked, known, checked, (known.plant,))
            typer.echo("\n" + judged.text)
            _tell_missed(judged)


def _closed_loop(
    rig: "Rig",
    design: Path,
    estimators: Iterable[str],
    scenarios: Iterable[str],
    runs: int,
    say: Callable[[str], None],
) -> "Check | ShiftCheck | FollowingCheck":
    """A design in the scenarios of its plant; a gearbox brings its own estimator."""
    from studies.checking import check_follower, check_gears, check_rig, follows, shifts_gears
    from workbench.errors import InputError, Message

    if follows(rig):
        return check_follower(rig, [design], estimators or ["ekf"], scenarios, runs, say)
    if not shifts_gears(rig):
        return check_rig(rig, [design], estimators or ["ekf"], scenarios, runs, say)
    if estimators:
        what = f"{rig.name} has an estimator of its own: leave --estimator out"
        raise InputError(Message(what))
    return check_gears(rig, [design], scenarios, runs, say)


def _certify(found: "Design", say: Callable[[str], None]) -> None:
    """Print the margins of each mode, and what is certified across modes."""
    from controllers.certificate import certificate
    from controllers.margins import loops, margins, unforeseen_s
    from studies.design_text import NO_LAWS, certificate_text, margins_text

    made, delay_s = found.controller, unforeseen_s(found.plant)
    if not hasattr(made, "laws") and not hasattr(made, "regulators"):
        typer.echo(NO_LAWS)
        return
    for part in getattr(made, "regulators", (made,)):
        axis = getattr(part, "axis", None)
        loop = (found.hybrid, part.laws, made.sample_time_s, delay_s, axis)
        typer.echo(margins_text(margins(*loop), delay_s))
        say("looking for a certificate across modes")
        typer.echo(certificate_text(certificate(loops(*loop), made.sample_time_s)))


@app.command(cls=Spread, epilog=example(CHECK))
def check(
    rig: RigFile,
    design: DesignFile,
    estimator: Annotated[
        list[str] | None,
        typer.Option(
            "--estimator", metavar="NAME", help="ekf (usual), ukf, imm, mhe; not for shifts."
        ),
    ] = None,
    scenario: Annotated[
        list[str] | None,
        typer.Option(
            "--scenario", metavar="NAME", help="step, sine; n-h, h-n, ...; as named; all."
        ),
    ] = None,
    runs: Several = 1,
    spec: Spec = None,
    figures: Figures = None,
    json: Json = None,
    quiet: Quiet = False,
) -> None:
    """Closed loop against the full nonlinear plant; exit code 1 where the goal is missed.

    The goal is the specification, where one is given: a verdict per line, and with --runs the
    share of plants that meet it and the worst one.

    A gearbox is judged by its four shifts, each beside the open loop on the same plant.

    With --runs N > 1 the plant's parameters are drawn from their uncertainty, and the estimator
    keeps the rig's own values.
    """
    with answering(quiet) as say:
        from studies.documents import check_document
        from workbench.rig import load_rig

        writable(json, folders=[figures])
        known = load_rig(rig)
        asked = _asked(spec, known, scenario or ()) if spec else None
        found = _closed_loop(known, design, estimator or (), scenario or (), runs, say)
        judged = _judged(asked, known, found, runs) if asked else None
        document = check_document(known.name, found) | (judged.document if judged else {})
        write_json(json, document)
        if figures:
            from studies.checking import styled_figures
            from studies.figures.style import save_all

            save_all(styled_figures(found), figures, command_text())
            say(f"figures in {figures}")
        typer.echo(found.text)
        if judged:
            typer.echo("\n" + judged.text)
            _tell_missed(judged)
            if not judged.met:
                raise typer.Exit(NO)
        elif any(row.reached is False for row in found.rows):
            typer.echo(found.goal, err=True)
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


def _tell_missed(judged: "Judged") -> None:
    if not judged.met:
        typer.echo(f"out of specification: {', '.join(judged.missed)}", err=True)


def _judged(
    asked: "Specification", rig: "Rig", found: "Check | ShiftCheck | FollowingCheck", runs: int
) -> "Judged":
    from studies.checking import drawn_plants
    from studies.verdicts import judge

    return judge(asked, rig, found, drawn_plants(rig, runs))
