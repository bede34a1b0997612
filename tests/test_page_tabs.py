"""The tabs of the page without a browser: what they show of a session, and how they act on it."""

import numpy as np
import pytest
from page_files import drive_files

pytest.importorskip("bokeh", reason="the page needs bokeh (extra `page`)")

from bokeh.document import Document

from linearize.standard import standard_modes
from studies.cuts_file import modes_by_cuts
from studies.design_numbers import design_numbers
from studies.page import tasks
from studies.page.control_tasks import ModeChoice, modes_of
from studies.page.control_verbs import with_offers
from studies.page.mode_cuts import boundaries, cuts_of, cuts_text, moved
from studies.page.offers import mode_offers
from studies.page.pages import TABS, all_tabs
from studies.page.residual_tests import ResidualTests
from studies.page.session import Role, Session, recordings, with_opened, with_rig, with_role
from studies.page.verbs import with_compared
from studies.page.view import Page
from studies.specification import read_specification
from workbench.comparison.independence import Independence
from workbench.errors import InputError
from workbench.rig import default_rig


def quiet(_):
    pass


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return drive_files(tmp_path_factory.mktemp("tabs"))


@pytest.fixture(scope="module")
def compared(folder):
    """A session with one recording that was compared."""
    begun = with_rig(Session(), str(folder / "rig.toml"))
    opened = tasks.open_recordings(begun.now.rig, (str(folder / "train.csv"),), quiet)
    session = with_opened(begun, opened)
    return with_compared(session, tasks.compare(session.now.rig, recordings(session.used), quiet))


@pytest.fixture
def page(tmp_path, monkeypatch, compared):
    """A page on a session; its replay script goes into a folder of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Document, "add_timeout_callback", lambda _self, act, _ms: act())
    found = Page(Document(), all_tabs)
    found.become(compared)
    return found


def look_at(page, name):
    titles = [tab.title for tab in page._tabs]
    page._choice.active = titles.index(name)
    return page._tabs[titles.index(name)]


def test_every_tab_shows_a_session_with_and_without_results(page):
    for tab in TABS:
        look_at(page, tab.title)
    page.become(Session())
    for tab in TABS:
        look_at(page, tab.title)


def test_a_box_in_one_picture_lights_the_same_samples_in_all(page):
    tab = look_at(page, "Compare")
    rows = tab._traces.rows
    worst = np.nanargmax(np.abs(rows["e:slide.position_m"]))
    box = {"x0": rows["d:0"][worst] - 1, "x1": rows["d:0"][worst] + 1, "y0": -1e9, "y1": 1e9}

    tab._choose("d:0", "residual", box)

    lit = tab._traces.selected
    assert lit[worst] and 0 < lit.sum() < len(lit)
    sent = np.asarray(tab._traces.source.data["sample"])[tab._traces.source.selected.indices]
    assert np.array_equal(np.flatnonzero(lit), np.sort(sent))  # nothing is thinned in so short one
    assert "samples lit" in tab._lit.text
    tab._clear()
    assert not tab._traces.source.selected.indices


def test_the_worst_residuals_are_selected_without_a_mouse(page):
    tab = look_at(page, "Compare")

    tab._worst()

    error = np.abs(tab._traces.rows["e:slide.position_m"])
    lit = tab._traces.selected
    assert lit.mean() == pytest.approx(0.05, abs=0.005)
    assert error[lit].min() >= error[~lit].max()
    assert "samples lit" in tab._lit.text


def test_a_zoom_sends_the_samples_of_the_window_and_keeps_what_is_lit(page):
    traces = look_at(page, "Compare")._traces
    traces.select(traces.rows["time"] > 0.5)

    traces.range.update(start=0.4, end=0.6)

    time = np.asarray(traces.source.data["time"])
    assert time.min() >= 0.399 - 1e-9 and time.max() <= 0.601 + 1e-9
    lit = time[traces.source.selected.indices]
    assert lit.min() > 0.5 and len(lit) > 90


def test_errors_are_told_by_signal_horizon_and_regime(page, compared):
    tab = look_at(page, "Compare")

    for word in ("one step", "window", "free run", "slide.position", "fit %"):
        assert word in tab._errors.text
    assert "at rest" in tab._regimes.text or "moving forward" in tab._regimes.text
    shares = [each.share_of_error for each in compared.compared.regimes[0]["window"]]
    assert shares == sorted(shares, reverse=True) and min(shares) >= 0.0 and max(shares) <= 1.0


def test_the_test_of_independence_says_of_which_lags_it_tells(compared):
    """Those below zero, which show feedback, are drawn beside them and do not count."""
    (residual, *_) = compared.compared.comparison.recordings[0].residuals.values()
    lags = np.arange(-2.0, 3.0)
    against = Independence("valve.command_v", lags, 1.0 * (lags >= 0.0), np.full(5, 0.5))
    tests = ResidualTests()
    tests.build()
    tests.show("slide.position_m", residual, against)

    said = "from valve.command, from lag 0 on: 100 % of the lags outside"
    assert said in tests._titles[1].text


def test_what_is_wrong_is_said_on_the_page_and_changes_nothing(page):
    before = page.session

    page.attempt(lambda session: with_rig(session, "nowhere.toml"))

    assert "nowhere.toml: there is no such file" in page._status.text
    assert page.session is before


def test_two_pages_do_not_mix(page, compared):
    other = Page(Document(), all_tabs)
    other.become(compared)

    page.attempt(lambda s: with_role(s, s.files[0].opened.path, Role.ASIDE))

    assert page.session is not compared and other.session is compared
    assert page._replay != other._replay


def test_cuts_of_standard_modes_are_a_file_that_gives_them_again_and_move(tmp_path):
    plant = default_rig("servo_drive").plant
    cuts = cuts_of(standard_modes(plant))
    ends = [each for each in boundaries(cuts) if each.signal == "slide.position_m"]
    further = moved(cuts, [(ends[0], 0.11)])
    (tmp_path / "cuts.toml").write_text(cuts_text(further))

    found = cuts_of(modes_by_cuts(plant, tmp_path / "cuts.toml"))

    assert found == further
    assert found["slide.position_m"][0].upper == pytest.approx(0.11)
    assert found["valve.command_v"] == cuts["valve.command_v"]


def test_cuts_of_two_browser_tabs_do_not_mix_in_their_file(tmp_path):
    rig = default_rig("servo_drive")
    cuts = cuts_of(standard_modes(rig.plant))
    end = next(each for each in boundaries(cuts) if each.signal == "slide.position_m")
    one, other = (
        ModeChoice(
            cuts_file=str(tmp_path / "cuts.toml"), cuts=cuts_text(moved(cuts, [(end, place)]))
        )
        for place in (0.11, 0.13)
    )

    modes_of(rig, (), one)
    modes_of(rig, (), other)

    again = cuts_of(modes_of(rig, (), one))
    assert again["slide.position_m"][0].upper == pytest.approx(0.11)


def test_modes_that_are_no_product_of_intervals_have_no_cuts_to_move():
    assert cuts_of(standard_modes(default_rig("crr_rig").plant)) == {}


def test_methods_and_estimators_are_chosen_by_mode_and_stand_in_what_is_designed(page, compared):
    rig = compared.now.rig
    page.become(with_offers(compared, mode_offers(rig, quiet)))
    tab = look_at(page, "Design and check")
    assert not tab._by_mode._whole.visible

    tab._method.value = "per-mode"
    lines = tab._by_mode
    lines._methods["charge a slide + middle"].value = "cascade"
    lines._estimators["stick"].value = "kalman"
    spec, observers = lines.with_choices(tab._spec.value, ["ekf"])

    assert lines._whole.visible and len(lines._methods) == 6
    numbers = design_numbers(read_specification(spec, rig, ["step"]), "per-mode", rig.plant)
    assert numbers["modes"]["charge a slide + middle"] == "cascade"
    assert observers == ["ekf,kalman@stick"]
    told = [each.text for each in lines._lines.children[1].children if hasattr(each, "text")]
    assert len(told) == 1 and "stable: gain up to" in told[0]
    tab._method.value = "lq"
    assert tab._by_mode.with_choices("x", ["ekf"]) == ("x", ["ekf"])


def test_what_is_offered_is_for_the_plant(tmp_path, page):
    for plant, method, observers in (
        ("gearbox", "hybrid-mpc", []),
        ("crr_arm", "axis-lq", ["kalman", "ekf", "ukf", "imm", "mhe", "raw"]),
        ("closed_chamber", "", []),
    ):
        path = tmp_path / f"{plant}.toml"
        path.write_text(f'plant = "{plant}"\n')
        page.attempt(lambda session, path=path: with_rig(session, str(path)))
        tab = look_at(page, "Design and check")

        assert tab._method.value == method
        assert tab._observers.labels == observers
        look_at(page, "Report")
    look_at(page, "Design and check")._check()
    assert "no standard modes to control" in page._status.text


def test_a_second_comparison_takes_the_place_of_the_first(page, compared):
    tab = look_at(page, "Compare")
    before = tab._traces.source.data
    again = tasks.compare(compared.now.rig, recordings(compared.used), quiet)

    page.become(with_compared(compared, again))

    assert tab._of[0] is again
    assert tab._traces.source.data is not before


def test_a_tab_is_drawn_again_only_when_what_it_shows_is_another(page, compared):
    tab, drawn = look_at(page, "Compare"), []
    tab.show = drawn.append

    page.become(with_offers(compared, None))
    assert not drawn
    page.become(with_compared(compared, None))
    assert len(drawn) == 1


def test_an_effect_that_is_refused_or_cancelled_is_not_ticked(page, compared):
    tab = look_at(page, "Add and fit")
    page.become(with_role(compared, compared.files[0].opened.path, Role.ASIDE))
    tab._names, tab._ticks.labels = ["piston_leak"], ["piston_leak"]

    tab._ticks.active = [0]

    assert tab._ticks.active == [] and "no recording is for training" in page._status.text


def at_once(page):
    """Jobs of a page done where it stands, as far as they go."""

    def work(_action, then, task, *arguments, otherwise=quiet):
        try:
            found = task(*arguments, quiet)
        except InputError as error:
            page.complain(str(error))
        else:
            page.attempt(then(found))

    return work


def test_columns_in_a_wrong_unit_leave_the_rig_and_its_recordings(page, compared, tmp_path):
    page.work = at_once(page)
    tab = look_at(page, "Recording")._mapping
    tab._fold()
    tab._name.value = str(tmp_path / "columns.toml")
    (path,) = [each.opened.path for each in compared.files]
    page.become(with_role(compared, path, Role.VALIDATION))
    before, (_, unit) = page.session, tab._widgets["chamber_a.pressure_pa"]
    right = unit.value

    unit.value = "kg"
    tab._apply()
    assert "does not fit" in page._status.text and page.session is before
    unit.value = {"bar": "Pa", "Pa": "bar"}[right]
    tab._apply()
    assert "chamber_a.pressure" in page._status.text and page.session is before
    assert not (tmp_path / "columns.toml").exists()

    unit.value = right
    tab._apply()
    assert page.session.now.rig_file == str(tmp_path / "columns.toml")
    assert [each.role for each in page.session.files] == [Role.VALIDATION]
