"""One self-contained HTML file from results: no network, figures as inline SVG."""

from studies.report.page import Section, render_folder, write_report

__all__ = ["Section", "render_folder", "write_report"]
