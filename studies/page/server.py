"""The server of the page: on this machine alone, for whoever has the token of its address.

Every path begins with the token.  A request without it is refused, and so is one whose Host or
Origin is not this very server: another site in the same browser can neither read nor act.  Nothing
is fetched from anywhere else.
"""

from __future__ import annotations

import secrets
import signal
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.core.validation import silence
from bokeh.core.validation.warnings import EMPTY_LAYOUT
from bokeh.document import Document
from bokeh.resources import Resources
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.server.util import bind_sockets
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.ioloop import IOLoop
from tornado.web import RequestHandler

from studies.page import tasks
from studies.page.jobs import STOPPED, Job, Told, end_all
from studies.page.pages import all_tabs
from studies.page.session import Session, with_opened, with_rig
from studies.page.template import TEMPLATE
from studies.page.view import Page
from workbench.errors import InputError, Message

ADDRESS = "127.0.0.1"
PLACE = "http://127.0.0.1:{}/{}/"
NAMES = (ADDRESS, "localhost")
PORT = 5006
FORGET_MS = 15_000  # a session without a browser
LARGEST = 256 * 2**20  # bytes of a message of the browser
SCRIPTS = "bokeh", "bokeh-widgets"
REFUSED = "refused: the address of the page holds a token; take it from the terminal\n"


class _Refusal(RequestHandler):
    """Answers whatever has no business here."""

    def prepare(self) -> None:
        self.set_status(403)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(REFUSED)


class _Guarded(BokehTornado):
    """The application of the server behind its token."""

    def __init__(self, page: Application, token: str, port: int) -> None:
        self._hosts = {f"{name}:{port}" for name in NAMES}
        self._within = f"/{token}"
        super().__init__(
            {"/": page},
            prefix=token,
            use_index=False,
            redirect_root=False,
            extra_websocket_origins=sorted(self._hosts),
            unused_session_lifetime_milliseconds=FORGET_MS,
            check_unused_sessions_milliseconds=FORGET_MS // 3,
            websocket_max_message_size_bytes=LARGEST,
        )

    def resources(self, absolute_url: str | bool | None = None) -> Resources:
        """The scripts that the page uses: without formulas, tables and WebGL, 2.3 MB less."""
        return super().resources(absolute_url).clone(components=list(SCRIPTS))

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> Any:
        """The handler of a request; a refusal where it lacks the token or comes from elsewhere."""
        origin = request.headers.get("Origin")
        own = origin is None or (
            urlsplit(origin).scheme == "http" and urlsplit(origin).netloc in self._hosts
        )
        path = request.path
        inside = path == self._within or path.startswith(self._within + "/")
        if inside and own and request.headers.get("Host") in self._hosts:
            return super().find_handler(request, **kwargs)
        return self.get_handler_delegate(request, _Refusal)


class PageServer:
    """The page of a rig and recordings, which every browser tab begins with.

    Raises
    ------
    InputError
        If the port is taken.
    """

    def __init__(self, rig: str = "", recordings: Sequence[str] = (), port: int | None = None):
        self._first = Session()
        if rig:
            self._first = with_rig(self._first, rig)
        self._reading = (
            Job(tasks.open_recordings, self._first.now.rig, tuple(recordings))
            if recordings
            else None
        )
        self.token = secrets.token_urlsafe(24)
        sockets, self.port = _bound(port)
        app = Application(FunctionHandler(self._open))
        tornado = _Guarded(app, self.token, self.port)
        http = HTTPServer(tornado)
        http.add_sockets(sockets)
        self._server = BaseServer(IOLoop.current(), tornado, http)

    @property
    def address(self) -> str:
        """Where the page is, token and all."""
        return PLACE.format(self.port, self.token)

    def run(self, ready: Callable[[], None] = lambda: None) -> None:
        """Serve until it is interrupted."""
        self._server.start()
        self._server.io_loop.add_callback(ready)
        self._server.io_loop.add_callback(Page, Document(), all_tabs)  # imports what a page needs
        try:
            self._server.io_loop.start()
        except KeyboardInterrupt:
            pass
        finally:
            self.close()

    def close(self) -> None:
        """End what still runs."""
        end_all()
        self._server.stop()

    def _open(self, document: Any) -> None:
        """A browser tab: a session of its own that begins with the rig and its recordings."""
        document.template = TEMPLATE
        page = Page(document, all_tabs)
        page.become(self._first)
        if self._reading:
            page.follow(_Shared(self._reading), lambda found: lambda s: with_opened(s, found))


class _Shared:
    """A job that several browser tabs look at; a cancel ends it for one of them alone."""

    def __init__(self, job: Job) -> None:
        self._job, self._left = job, False

    def look(self) -> Told:
        """What it has said until now."""
        told = self._job.look()
        return replace(told, ended=True, refused=STOPPED) if self._left and not told.ended else told

    def cancel(self) -> None:
        """Look no longer."""
        self._left = True

    @property
    def elapsed_s(self) -> float:
        return self._job.elapsed_s


def _bound(port: int | None) -> tuple[list[Any], int]:
    """Sockets on this machine alone; any free port where the usual one is taken."""
    for tried in [port] if port is not None else [PORT, 0]:
        try:
            return bind_sockets(ADDRESS, tried)
        except OSError as error:
            last = error
    raise InputError(Message(f"port {port} cannot be used: {last.strerror}", "--port"))


def serve(rig: Path | None, recordings: Sequence[Path], port: int | None, show: Callable) -> None:
    """The page until it is interrupted; ``show`` gets its address once it answers."""
    silence(EMPTY_LAYOUT, True)  # tabs wait for results in empty columns
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a kill ends it as Ctrl-C does
    server = PageServer(str(rig or ""), [*map(str, recordings)], port)
    server.run(lambda: show(server.address))
