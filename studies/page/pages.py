"""The tabs of the page in the order of the loop; a new one is one line here."""

from __future__ import annotations

from studies.page.add_tab import AddTab
from studies.page.compare_tab import CompareTab
from studies.page.design_tab import DesignTab
from studies.page.missing_tab import MissingTab
from studies.page.modes_tab import ModesTab
from studies.page.recording_tab import RecordingTab
from studies.page.report_tab import ReportTab
from studies.page.view import Page, Tab

TABS = (RecordingTab, CompareTab, MissingTab, AddTab, ModesTab, DesignTab, ReportTab)


def all_tabs(page: Page) -> list[Tab]:
    """The tabs of one browser tab."""
    return [tab(page) for tab in TABS]
