"""What the page answers to clicks that come too early, too late, or with nothing typed."""

from types import SimpleNamespace

import pytest
from page_files import RIG

pytest.importorskip("bokeh", reason="the page needs bokeh (extra `page`)")

from bokeh.document import Document

from studies.page import tasks
from studies.page.control_tasks import linearise
from studies.page.jobs import Told
from studies.page.look import NARROWEST
from studies.page.missing_tab import _bars
from studies.page.modes_tab import PLACED
from studies.page.pages import all_tabs
from studies.page.session import Session, with_rig
from studies.page.view import Page


@pytest.fixture
def page(tmp_path, monkeypatch):
    """A page on a rig without recordings, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Document, "add_timeout_callback", lambda _self, act, _ms: act())
    for name in ("rig.toml", "other.toml"):
        (tmp_path / name).write_text(RIG)
    found = Page(Document(), all_tabs)
    found.become(with_rig(Session(), "rig.toml"))
    return found


def look_at(page, name):
    titles = [tab.title for tab in page._tabs]
    page._choice.active = titles.index(name)
    page.refresh()
    return page._tabs[titles.index(name)]


class Waiting:
    """A job that has said one thing and goes on until it is cancelled."""

    elapsed_s, cancelled = 1.0, False

    def look(self):
        return Told(("prior fit",), (), self.cancelled, None, "cancelled")

    def cancel(self):
        self.cancelled = True


def test_a_click_while_something_runs_is_answered_beside_its_progress(page):
    before, job = page.session, Waiting()
    page.follow(job, lambda _: lambda session: session)

    assert not page.attempt(lambda _: Session())
    page._poll()

    assert page.session is before
    assert "prior fit" in page._status.text and "something is running" in page._status.text
    job.elapsed_s = 60.0
    page._poll()
    assert "something is running" not in page._status.text


def test_a_moved_boundary_takes_the_place_of_the_modes_under_way_and_of_nothing_else(page):
    job = Waiting()
    page.follow(job, lambda _: lambda session: session)
    page._task = tasks.diagnose

    page.supersede(linearise)
    assert not job.cancelled
    page._task = linearise
    page.supersede(linearise)
    assert job.cancelled and page._job is None


@pytest.mark.parametrize(
    ("press", "told"),
    [
        ("_open_rig", "no name; expected a name such as rig.toml"),
        ("_add", "no name; expected a name such as train.csv"),
    ],
)
def test_a_path_that_was_not_typed_is_asked_for(page, press, told):
    tab = look_at(page, "Recording")
    tab._rig.value = tab._file.value = " "

    getattr(tab, press)()

    assert told in page._status.text


def test_columns_are_asked_for_once_there_is_a_rig(page):
    page.become(Session())
    tab = look_at(page, "Recording")._mapping

    tab._fold()

    assert not tab._inner.visible and "no rig is open" in page._status.text


def test_the_name_to_save_under_follows_the_rig_unless_it_was_typed(page):
    tab = look_at(page, "Add and fit")
    assert tab._name.value == "rig_better.toml"

    page.attempt(lambda session: with_rig(session, "other.toml"))
    assert tab._name.value == "other_better.toml"
    tab._name.value = "mine.toml"
    page.attempt(lambda session: with_rig(session, "rig.toml"))
    assert tab._name.value == "mine.toml"


def test_the_name_of_the_only_effect_is_never_cut():
    named = SimpleNamespace(name="sensor_offset@chamber_b.pressure")
    row = SimpleNamespace(
        candidate=named, tied_with=(), blind=True, drop_train=0.5, drop_validation=0.4
    )
    bars = _bars((row,))

    assert bars.min_width >= bars.min_border_left + NARROWEST


def test_a_number_that_is_missing_is_asked_for(page):
    modes, design = look_at(page, "Modes"), look_at(page, "Design and check")
    modes._kind.value, modes._number.value, design._runs.value = PLACED, None, None

    for press, what in ((modes._linearise, "modes"), (design._check, "plants")):
        press()
        assert f"{what}: is no number of them" in page._status.text


def test_a_word_typed_as_a_specification_is_not_a_file(page):
    tab = look_at(page, "Design and check")

    tab._judge("soft")

    assert "spec:1" in tab._verdict.text and "no such file" not in tab._verdict.text
