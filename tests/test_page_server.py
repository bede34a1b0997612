"""The server of the page: who is let in, and that each browser tab has a session of its own."""

import http.client
import threading

import pytest

pytest.importorskip("bokeh", reason="the page needs bokeh (extra `page`)")

from commands import call
from page_files import drive_files


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return drive_files(tmp_path_factory.mktemp("served"))


@pytest.fixture(scope="module")
def server(folder):
    """A running server in a thread of its own."""
    import asyncio

    from studies.page.server import PageServer

    found, ready = [], threading.Event()

    def serve():
        asyncio.set_event_loop(asyncio.new_event_loop())
        found.append(PageServer(str(folder / "rig.toml"), [str(folder / "train.csv")], port=0))
        found[0].run(ready.set)

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    assert ready.wait(60.0)
    yield found[0]
    loop = found[0]._server.io_loop
    loop.add_callback(loop.stop)
    thread.join(10.0)


def asked(server, path, **headers):
    """Status and text of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=120)
    connection.request("GET", path, headers={k.replace("_", "-"): v for k, v in headers.items()})
    answer = connection.getresponse()
    return answer.status, answer.read().decode("utf-8", errors="replace")


def test_the_page_answers_whoever_has_its_address_and_fetches_nothing_from_elsewhere(server):
    status, text = asked(server, f"/{server.token}/")

    assert status == 200 and 'lang="en"' in text
    addresses = [part.split('"')[0] for part in text.split('src="')[1:]]
    assert addresses and all(
        each.startswith(f"{server.token}/")
        or each.startswith(f"/{server.token}/")
        or each.startswith("static/")
        for each in addresses
    ), addresses


@pytest.mark.parametrize("path", ["/", "/static/js/bokeh.min.js", "/wrong-token/", "/ws", "/{}x/"])
def test_a_request_without_the_token_is_refused(server, path):
    status, text = asked(server, path.format(server.token))

    assert status == 403 and "token" in text


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://localhost:1"},
        {"Origin": "null"},
        {"Host": "elsewhere.example"},
        {"Origin": "https://127.0.0.1"},
    ],
)
def test_a_request_from_another_origin_is_refused_even_with_the_token(server, headers):
    for path in (f"/{server.token}/", f"/{server.token}/ws"):
        assert asked(server, path, **headers)[0] == 403


def test_tokens_differ_from_run_to_run_and_the_page_is_on_this_machine_alone(server):
    from studies.page.server import ADDRESS, PageServer

    other = PageServer(port=0)
    sockets = [s for s in server._server._http._sockets.values()]
    other.close()

    assert other.token != server.token and len(server.token) > 30
    assert {s.getsockname()[0] for s in sockets} == {ADDRESS}


def test_a_cancel_of_the_first_reading_is_of_one_browser_tab():
    from studies.page.jobs import Told
    from studies.page.server import _Shared

    class Reading:
        def look(self):
            return Told(("reading train.csv",))

    one, other = (_Shared(Reading()) for _ in range(2))

    one.cancel()

    assert "cancelled" in one.look().refused and not other.look().ended


def test_two_documents_have_sessions_of_their_own(server):
    from bokeh.document import Document

    from studies.page.pages import all_tabs
    from studies.page.session import Role, with_role
    from studies.page.view import Page

    one, other = (Page(Document(), all_tabs) for _ in range(2))
    one.become(server._first)
    other.become(server._first)

    one.attempt(lambda session: with_role(session, "train.csv", Role.ASIDE))

    assert one.session is not other.session
    assert other.session is server._first


def test_a_taken_port_and_a_wrong_rig_are_refused_with_one_message(server, folder):
    taken = call("app", folder / "rig.toml", "--port", server.port)
    wrong = call("app", folder / "nowhere.toml")

    assert taken.exit_code == 2 and f"port {server.port}" in taken.stderr
    assert wrong.exit_code == 2 and "nowhere.toml" in wrong.stderr


def test_without_bokeh_the_command_says_what_it_needs(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "bokeh", None)

    answer = call("app")

    assert answer.exit_code == 2
    assert answer.stderr.count("\n") == 1 and "workbench[page]" in answer.stderr


@pytest.mark.parametrize(
    ("content", "said"), [(None, "there is no such file"), ("time\n", "no rows of numbers")]
)
def test_a_recording_that_cannot_be_read_is_refused_before_anything_is_served(
    tmp_path, monkeypatch, content, said
):
    served = []
    monkeypatch.setattr("studies.page.server.serve", lambda *given: served.append(given))
    monkeypatch.setattr("studies.page.jobs.begin", lambda: None)
    (tmp_path / "rig.toml").write_text('plant = "servo_drive"\n')
    if content is not None:
        (tmp_path / "run.csv").write_text(content)

    answer = call("app", tmp_path / "rig.toml", tmp_path / "run.csv", "-q")

    assert answer.exit_code == 2 and not served
    assert said in answer.stderr and "reading" not in answer.stderr
