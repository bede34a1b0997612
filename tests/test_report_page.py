"""The report: one page that needs no network, made again from its folder alone."""

import re
from math import nan

import numpy as np
import pytest

from studies.figures.style import new_figure, save, styled
from studies.page.reporting import Found, report
from studies.page.tasks import Accepted
from studies.report import Section, render_folder, write_report
from studies.text_of_results import ADDED, FITTED
from workbench.diagnosis.addition import Addition
from workbench.errors import InputError
from workbench.fitting.errors import SignalError
from workbench.fitting.fit import FitReport
from workbench.rig import default_rig


@pytest.fixture(scope="module")
def figures():
    """Two figures of a line each."""
    found = {}
    with styled():
        for name in ("poles", "budget"):
            found[name] = new_figure(3.5, 2.0)
            found[name].subplots().plot([0, 1], [0, 1], label=name)
    return found


@pytest.fixture
def page(figures, tmp_path):
    for name in ("poles", "budget"):
        save(figures[name], tmp_path / "figures" / name, "workbench demo")
    sections = [
        Section("Modes <&>", ("Some text.",), "a  b\n1  2", ("poles",)),
        Section("Error", figures=("budget",)),
    ]
    return write_report(tmp_path, "From a recording", "workbench demo", sections)


def test_a_page_holds_its_figures_and_needs_no_network(page):
    text = page.read_text()

    assert text.count("<svg") == 2
    assert "Modes &lt;&amp;&gt;" in text and "1  2" in text
    assert not re.search(r'(src|href)="(?!#)', text)
    assert not re.search(r"@import|url\((?!#)|<metadata", text)


def test_names_inside_a_page_are_its_own(page):
    assert_own_names(page.read_text())


def test_a_figure_of_a_recording_with_an_odd_name_is_whole_and_does_no_harm(figures, tmp_path):
    """A browser ends a reference at the first bracket and an attribute at the first quote."""
    for name in ("run_(1)", "run_[1]", 'a" onload="alert(1)', "<b>"):
        save(figures["poles"], tmp_path / name, "workbench compare")

    text = render_folder(tmp_path).read_text()
    assert_own_names(text)
    assert "onload=" not in text.replace("onload=&#34;", "") and "<b>" not in text


def assert_own_names(text):
    """Every name once, and every reference to one of them."""
    names = re.findall(r'\bid="([^"]+)"', text)
    used = re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', text)

    assert len(names) == len(set(names))
    assert {a or b for a, b in used} <= set(names)
    assert not any(set(name) & set("()<> ") for name in names)


def test_a_page_can_be_made_again_from_its_folder(page):
    before = page.read_bytes()
    page.unlink()

    assert render_folder(page.parent).read_bytes() == before


def test_a_folder_of_figures_alone_makes_a_page_too(figures, tmp_path):
    save(figures["budget"], tmp_path / "budget", "workbench improve")

    assert "<h2>1. budget</h2>" in render_folder(tmp_path).read_text()


def test_a_caption_names_the_files_where_they_are_and_the_command(figures, page, tmp_path):
    assert "figures/poles.pdf, figures/poles.svg, figures/poles.csv; " in page.read_text()

    alone = tmp_path / "alone"
    save(figures["budget"], alone / "budget", "workbench compare 'a b.csv'")
    (alone / "budget.pdf").unlink()

    assert (
        "<figcaption>budget.svg, budget.csv; made by "
        "<code>workbench compare &#39;a b.csv&#39;</code></figcaption>"
    ) in render_folder(alone).read_text()


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="nothing to report"):
        render_folder(tmp_path)


def test_a_report_of_others_is_refused(tmp_path):
    (tmp_path / "report.json").write_text('{"a": 1}')

    with pytest.raises(InputError, match="no report of ours"):
        render_folder(tmp_path)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe picture"])
def test_a_figure_that_is_no_svg_is_named(tmp_path, content):
    (tmp_path / "empty.svg").write_bytes(content)

    with pytest.raises(InputError, match=r"empty\.svg: is no SVG file"):
        render_folder(tmp_path)
    assert not (tmp_path / "report.html").exists()


def test_steps_of_the_page_are_told_in_the_words_of_their_commands(tmp_path):
    """Of the page itself, which keeps no fits, and of its replay script, which has them."""
    rig = default_rig("servo_drive")
    before, after = (
        {"train": {"slide.position": SignalError(rmse, nan, 1e-5)}} for rmse in (2e-3, 1e-3)
    )
    kept = Accepted("valve_lag", rig, before, after, (), "")
    refitted = Accepted("fit", rig, before, after, (), "", FITTED)
    added = Addition(rig, None, before, after, 0.5, 0.5, (), None, None)
    fitted = FitReport(rig, (), np.eye(0), before, after, True, None)

    written = report(
        tmp_path, "", "rig", Found(steps=(kept, refitted, added, fitted)), lambda _: None
    )

    tables = re.findall(r"RMSE (without it|as it came)\s+(with it|fitted)\s", written.read_text())
    assert tables == [ADDED, FITTED, ADDED, FITTED]
    for number, words in enumerate(tables, start=1):
        drawn = (tmp_path / "figures" / f"step_{number}.csv").read_text()
        assert all(f",{each}," in drawn for each in words)
