"""The command that serves the local page."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from studies.command_line.application import Quiet, Spread, answering, app, example
from studies.command_line.files import read_all


@app.command(cls=Spread, name="app", epilog=example("workbench app rig.toml train.csv"))
def serve_page(
    rig: Annotated[
        Path | None, typer.Argument(metavar="[RIG]", help="Rig file (TOML).", show_default=False)
    ] = None,
    recordings: Annotated[
        list[Path] | None, typer.Argument(metavar="[REC...]", help="Recordings.")
    ] = None,
    port: Annotated[
        int | None, typer.Option("--port", metavar="N", min=1, max=65535, help="Usually 5006.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """The same loop as a local page: this machine alone, an address with a token of its own."""
    with answering(quiet) as say:
        from studies.page.jobs import begin
        from workbench.errors import InputError, Message

        if not find_spec("bokeh"):
            what = "the page needs the package bokeh, which is not installed"
            raise InputError(Message(what, expected="`pip install 'workbench[page]'`"))
        if rig:
            from workbench.rig import load_rig

            read_all(load_rig(rig), recordings, say)  # what is wrong is told here, not in a tab
        begin()  # beside the imports of the server
        from studies.page.server import serve

        said = "the page is at {}\nwhoever has this address can use it; Ctrl-C ends it"
        serve(rig, recordings or (), port, lambda address: typer.echo(said.format(address)))
