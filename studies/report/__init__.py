"""One self-contained HTML file from results: no network, figures as inline SVG."""

from studies.report.page import PAGE, Section, render_folder, write_report

__all__ = ["PAGE", "Section", "render_folder", "write_report"]
