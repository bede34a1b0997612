"""Figures of the studies inside of the page: the same drawings, as SVG."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import TYPE_CHECKING

from studies.figures.style import styled
from studies.report.page import inline

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDEST = "max-width: 900px"


def drawings(figures: Mapping[str, Figure]) -> dict[str, str]:
    """SVG of figures by name, with names of their own inside."""
    found = {}
    for name, figure in figures.items():
        with styled():
            file = io.StringIO()
            figure.savefig(file, format="svg", metadata={"Date": None})
        found[name] = inline(file.getvalue(), name)
    return found


def as_html(svg: str) -> str:
    """A drawing as wide as the page lets it be."""
    scaled = svg.replace("<svg ", '<svg style="width: 100%; height: auto;" ', 1)
    return f'<div style="{WIDEST}">{scaled}</div>'
