"""Commands that list what there is: plants, effects, studies."""

from typing import Annotated

import typer

from studies.command_line.application import Quiet, Spread, answering, app, example


@app.command(cls=Spread, epilog=example("workbench plants"))
def plants(quiet: Quiet = False) -> None:
    """List the plants, one line each."""
    with answering(quiet):
        from studies.catalogue_text import plants_text

        typer.echo(plants_text())


@app.command(cls=Spread, epilog=example("workbench effects servo_drive"))
def effects(
    plant: Annotated[str | None, typer.Argument(metavar="[PLANT]", help="A plant.")] = None,
    quiet: Quiet = False,
) -> None:
    """List the effects of the catalogue, or those that a plant may lack, with what is known.

    With PLANT also null value, typical size, unit, balance and source of each.
    """
    with answering(quiet):
        from studies.catalogue_text import effects_of_plant_text, effects_text

        typer.echo(effects_text() if plant is None else effects_of_plant_text(plant))


@app.command(cls=Spread, epilog=example("workbench studies"))
def studies(quiet: Quiet = False) -> None:
    """List the studies, one line each."""
    with answering(quiet):
        from studies.catalogue_text import studies_text

        typer.echo(studies_text())
