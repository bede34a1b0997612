"""The page in a real browser, headless: the loop on the demo recordings with their hidden effect.

WORKBENCH_SCREENSHOTS names a folder that keeps the screenshots.
"""

import shutil

import pytest
from page_browser import NEEDED, Served, chromium, click, drag, no_wider_than_the_window
from page_files import drive_files

from studies.demo import DATA
from workbench.rig import load_rig

pytest.importorskip("bokeh", reason="the page needs bokeh (extra `page`)")
pytestmark = NEEDED


@pytest.fixture(scope="module")
def browser():
    with chromium() as found:
        yield found


@pytest.fixture
def served(browser, tmp_path):
    started = []

    def start(folder, *files):
        started.append(Served(browser, folder, *files))
        return started[-1]

    yield start
    for each in started:
        each.close()


def seen(page_of, page, name):
    """A screenshot at 1280 x 800 and at 200 %, with nothing that sticks out of the window."""
    for scale, width, height in ((1, 1280, 800), (2, 640, 400)):
        page.set_viewport_size({"width": width, "height": height})
        page.wait_for_timeout(500)
        assert no_wider_than_the_window(page), (name, scale)
        page_of.shot(page, name if scale == 1 else f"{name}_zoomed")
    page.set_viewport_size({"width": 1280, "height": 800})


def test_a_wrong_file_is_told_on_the_page_and_two_tabs_do_not_mix(served, tmp_path):
    page_of = served(drive_files(tmp_path), "rig.toml", "train.csv", "validation.csv")
    page, other = page_of.tab(), page_of.tab()
    page.wait_for_selector("text=Plausible?")
    other.wait_for_selector("text=Plausible?")

    page.get_by_label("Rig file (TOML)").fill("nowhere.toml")
    click(page, "Open rig")
    page.wait_for_selector("text=nowhere.toml: there is no such file")
    page.get_by_label("validation.csv is for").select_option("not used")
    page.wait_for_selector("text=validation = [workbench.read_recording(rig, path) for path in []]")

    assert other.get_by_label("validation.csv is for").input_value() == "validation"
    page_of.shot(page, "wrong_file")
    assert {url.split("/")[2] for url in page_of.asked} == {page_of.address.split("/")[2]}


@pytest.mark.slow
def test_a_box_drawn_with_the_mouse_lights_samples_up(served, tmp_path):
    page_of = served(drive_files(tmp_path), "rig.toml", "train.csv")
    page = page_of.tab()
    page.wait_for_selector("text=Plausible?")
    click(page, "2 Compare")
    click(page, "Compare")
    page.wait_for_selector("text=Errors of train")
    page.wait_for_timeout(1000)

    canvas = page.locator("canvas:visible").first
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    drag(page, box["x"] + 160, box["y"] + 40, 140)

    page.wait_for_selector("text=samples lit")
    page_of.shot(page, "brushed")


def modes_design_report(page_of, page):
    """Tabs 5 to 7: a boundary is moved, a method chosen for a mode, and all of it reported."""
    click(page, "5 Modes")
    click(page, "Linearise")
    page.wait_for_selector("text=prediction error over 50 ms")
    click(page, "Cut by hand")
    handle = page.locator(".noUi-handle:visible").nth(4)
    handle.focus()
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    page.wait_for_selector("text=(before")
    seen(page_of, page, "5_modes")

    click(page, "6 Design and check")
    method = page.get_by_label("Controller", exact=True)
    for _ in range(60):  # it goes back as long as the modes are being made
        method.select_option("per-mode")
        page.wait_for_timeout(2000)
        if method.input_value() == "per-mode":
            break
    page.wait_for_selector("text=stable: gain up to")
    page.get_by_label("charge a slide + middle", exact=True).select_option("cascade")
    click(page, "Design and check")
    page.wait_for_selector("text=certified is a dwell time")  # the cascade shares no function
    page.get_by_label("Specification").fill('rise_time = "1 ms"')
    page.wait_for_selector("text=specification missed: rise_time")
    seen(page_of, page, "6_design_and_check")

    click(page, "7 Report")
    click(page, "Write report")
    page.wait_for_selector("iframe")
    seen(page_of, page, "7_report")
    assert "The plant as modes" in (page_of.folder / "report" / "report.html").read_text()


@pytest.mark.slow
def test_the_loop_on_the_demo_recording_from_files_to_a_saved_rig(served, tmp_path):
    for name in ("rig.toml", "train.csv", "validation.csv"):
        shutil.copy(DATA / name, tmp_path)
    page_of = served(tmp_path, "rig.toml", "train.csv", "validation.csv")
    page = page_of.tab()
    page.wait_for_selector("text=Plausible?")
    click(page, "Check before a fit")
    page.wait_for_selector("text=uncertain parameters")
    seen(page_of, page, "1_recording")

    click(page, "2 Compare")
    click(page, "Compare")
    page.wait_for_selector("text=Errors of train")
    seen(page_of, page, "2_compare")

    click(page, "3 Missing effect")
    click(page, "Diagnose")
    page.wait_for_selector("text=is missing: it removes")
    named = page.get_by_text("is missing: it removes").inner_text().split()[0]
    seen(page_of, page, "3_missing_effect")

    click(page, "4 Add and fit")
    page.get_by_label(named, exact=True).check()
    page.wait_for_selector("text=What moved")
    seen(page_of, page, "4_add_and_fit")
    rows = page.locator("table").filter(has_text="RMSE before").locator("tr").all_inner_texts()
    fits = [row.split("\t") for row in rows if row.startswith("validation")]
    assert len(fits) == 3
    assert all(float(row[5]) > float(row[4]) for row in fits), fits

    page.get_by_label("Rig file to save").fill("better.toml")
    click(page, "Save rig")
    page.wait_for_selector("text=workbench.write_rig(rig, 'better.toml')")
    assert named in load_rig(tmp_path / "better.toml").added

    modes_design_report(page_of, page)

    click(page, "4 Add and fit")
    page.get_by_label(f"1. {named}", exact=True).uncheck()
    page.get_by_text("What moved").wait_for(state="hidden")

    page.reload()
    page.get_by_label("Rig file (TOML)").fill("better.toml")
    click(page, "Open rig")
    page.wait_for_selector("text=rig = workbench.load_rig('better.toml')")
    assert list(tmp_path.glob("workbench_replay_*.py"))


@pytest.mark.slow
def test_a_browser_that_closes_in_the_middle_of_a_fit_leaves_the_server_well(served, tmp_path):
    page_of = served(drive_files(tmp_path, seconds=3.0), "rig.toml", "train.csv")
    page = page_of.tab()
    page.wait_for_selector("text=Plausible?")
    idle = len(page_of.children())
    click(page, "3 Missing effect")
    click(page, "Diagnose")
    for _ in range(300):
        if len(page_of.children()) > idle:
            break
        page.wait_for_timeout(100)
    assert len(page_of.children()) > idle
    page.close()

    again = page_of.tab()
    again.wait_for_selector("text=Plausible?")
    for _ in range(90):
        if len(page_of.children()) <= idle:
            break
        again.wait_for_timeout(500)

    assert len(page_of.children()) <= idle
    click(again, "3 Missing effect")
    click(again, "Diagnose")
    again.wait_for_selector("text=prior fit")
    click(again, "Cancel")
    again.wait_for_selector("text=cancelled; nothing was changed")


@pytest.mark.slow
def test_the_page_is_used_by_keyboard_and_read_at_two_sizes(served, tmp_path):
    page_of = served(drive_files(tmp_path), "rig.toml", "train.csv")
    for name, scale in (("1280", 1.0), ("zoomed", 2.0)):
        page = page_of.tab(scale=scale)
        page.wait_for_selector("text=Plausible?")
        assert no_wider_than_the_window(page)
        page_of.shot(page, f"size_{name}")

    reached = set()
    for _ in range(40):
        page.keyboard.press("Tab")
        reached.add(
            page.evaluate(
                """() => { let e = document.activeElement;
                    while (e.shadowRoot && e.shadowRoot.activeElement)
                        e = e.shadowRoot.activeElement;
                    return e.innerText || e.id || e.tagName; }"""
            ).strip()
        )
    assert {"2 Compare", "Open rig", "Add recording", "Check before a fit"} <= reached, reached
