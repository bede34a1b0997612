"""Commands that find what a plant lacks and put it in: diagnose, add, improve, fit."""

from pathlib import Path
from typing import Annotated

import typer

from studies.command_line.application import (
    STOPPED,
    Figures,
    Json,
    Output,
    Quiet,
    RigFile,
    Spread,
    Train,
    Validate,
    answering,
    app,
    command_text,
    example,
)
from studies.command_line.files import (
    read_all,
    read_to_fit,
    warn_in_place,
    writable,
    write_json,
)

DIAGNOSE = "workbench diagnose rig.toml train.csv --validate validation.csv --json found.json"
ADD = (
    "workbench add rig.toml chamber_leak --at chamber_a --fit train.csv "
    "--validate validation.csv -o rig2.toml"
)
IMPROVE = "workbench improve rig.toml train.csv --validate validation.csv -o rig2.toml"
PLAYABLE = "with --figures DIR: its commands as a CSV, and what each rival would record as a figure"
LAW = "law"  # in place of an effect: the empirical law that explains most
FIT = "workbench fit rig.toml train.csv --validate validation.csv -o rig2.toml"


@app.command(cls=Spread, epilog=example(DIAGNOSE))
def diagnose(
    rig: RigFile,
    train: Train,
    validate: Validate = None,
    figures: Figures = None,
    json: Json = None,
    quiet: Quiet = False,
) -> None:
    """Which physical effect is missing: ranking of the catalogue, and where the plant fails.

    Without --validate the last third of each recording is held out, which is weaker evidence.
    """
    with answering(quiet) as say:
        from studies.documents import diagnosis_document
        from studies.text_of_results import diagnosis_text, unit_names
        from workbench.diagnosis.diagnose import diagnose as find_missing
        from workbench.rig import load_rig

        writable(json, folders=[figures], reads=[rig, *train, *(validate or ())])
        known = load_rig(rig)
        read = read_to_fit(known, train, say)
        held_out = read_all(known, validate, say)
        found = find_missing(known, read, held_out, say)
        units = unit_names(known.plant.measured + known.plant.optional_outputs)
        write_json(json, diagnosis_document(found, units))
        if figures:
            from studies.export import save_next_recording
            from studies.figures.diagnosis import diagnosis_figures
            from studies.figures.style import save_all

            save_all(diagnosis_figures(found), figures, command_text())
            save_next_recording(known, found.next_recording, figures, command_text())
            say(f"figures in {figures}")
        typer.echo(diagnosis_text(found, units))
        if not figures and found.next_recording and found.next_recording.predicted:
            typer.echo(PLAYABLE)


@app.command(cls=Spread, epilog=example(ADD))
def add(
    rig: RigFile,
    effect: Annotated[
        str, typer.Argument(metavar="EFFECT", help="As `workbench effects` lists, or a law.")
    ],
    fit: Annotated[
        list[Path], typer.Option("--fit", metavar="TRAIN...", help="Recordings to fit.")
    ],
    output: Output,
    at: Annotated[str | None, typer.Option("--at", metavar="PART", help="Its place.")] = None,
    validate: Validate = None,
    quiet: Quiet = False,
) -> None:
    """Add one effect, refit, and print the error before and after on both sets.

    EFFECT may be an empirical term of a diagnosis, such as "law[v|v|]@slide", or law: then the
    empirical law of up to three terms that explains most.  It is no physical effect, and the rig
    file says in which range it was seen.  Two effects that only work together are added as one,
    "constant_force + spring_force", each with its place behind an @.
    """
    with answering(quiet) as say:
        from studies.catalogue_text import candidate_name
        from studies.text_of_results import addition_text, unit_names
        from workbench.diagnosis.improve import add as add_effect
        from workbench.diagnosis.improve import add_law
        from workbench.rig import load_rig
        from workbench.rig_writing import write_rig

        writable(output, reads=[*fit, *(validate or ())])
        known = load_rig(rig)
        warn_in_place(output, rig)
        whole_law = effect == LAW and at is None
        name = "" if whole_law else candidate_name(known.plant, effect, at)
        read, held_out = read_to_fit(known, fit, say), read_all(known, validate, say)
        if whole_law:
            found = add_law(known, read, held_out, say)
        else:
            found = (add_effect(known, name, read, held_out, say),)
        write_rig(found[-1].rig, output)
        for step in found:
            text = addition_text(step, unit_names(known.plant.measured))
            typer.echo(f"{step.rig.notes[-1]}\n{text}\n")
        typer.echo(f"wrote {output}")


@app.command(cls=Spread, epilog=example(IMPROVE))
def improve(
    rig: RigFile,
    train: Train,
    validate: Validate,
    output: Output,
    report: Annotated[
        Path | None, typer.Option("--report", metavar="DIR", help="Report and figures.")
    ] = None,
    law: Annotated[
        bool, typer.Option("--law", help="In the end take an empirical law, if one passes.")
    ] = False,
    json: Json = None,
    quiet: Quiet = False,
) -> None:
    """Diagnose and add, again and again, until nothing in the catalogue earns its place.

    Then each effect is taken out once, and its rivals are tried in its place: what is no longer
    needed is dropped, and a clearly better rival takes over.  With --law an empirical law is taken
    in the end, where nothing of the catalogue earns its place and the law passes the same criteria.
    """
    with answering(quiet) as say:
        from studies.improvement_text import improvement_document, improvement_text
        from studies.text_of_results import unit_names
        from workbench.diagnosis.improve import improve as improve_rig
        from workbench.rig import load_rig
        from workbench.rig_writing import write_rig

        writable(output, reads=[*train, *(validate or ())])
        writable(json, folders=[report], reads=[rig, *train, *(validate or ())], besides=[output])
        known = load_rig(rig)
        warn_in_place(output, rig)
        read, held_out = read_to_fit(known, train, say), read_all(known, validate, say)
        found = improve_rig(known, read, held_out, say, law)
        units = unit_names(known.plant.measured + known.plant.optional_outputs)
        write_rig(found.rig, output)
        write_json(json, improvement_document(found, units))
        typer.echo(improvement_text(found, units))
        typer.echo(f"wrote {output}")
        if report:
            from studies.report.improvement import report_improvement

            say(f"report in {report_improvement(found, report, command_text())}")
        if found.stopped:
            raise typer.Exit(STOPPED)


@app.command(cls=Spread, epilog=example(FIT))
def fit(
    rig: RigFile,
    train: Train,
    output: Output,
    validate: Validate = None,
    only: Annotated[
        list[str] | None,
        typer.Option("--only", metavar="NAMES", help="Parameters to fit, others stay."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Estimate parameters with their priors; standard deviations, correlations, flat directions."""
    with answering(quiet) as say:
        from studies.catalogue_text import full_names
        from studies.text_of_results import fit_text, unit_names
        from workbench.fitting.fit import fit as fit_rig
        from workbench.rig import load_rig
        from workbench.rig_writing import write_rig

        writable(output, reads=[*train, *(validate or ())])
        known = load_rig(rig)
        warn_in_place(output, rig)
        names = full_names(known.plant, only or ())
        read, held_out = read_to_fit(known, train, say, names), read_all(known, validate, say)
        found = fit_rig(known, read, held_out, only=names, progress=say)
        write_rig(found.rig, output)
        typer.echo(fit_text(found, unit_names(known.plant.measured)))
        typer.echo(f"wrote {output}")
