"""What one-step errors still hold: spectrum against the noise floor, and autocorrelation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import BLUE, GREY, PAGE_IN, RED, headline, new_figure, styled
from studies.text import outside_band
from workbench.comparison.compare import ONE_STEP, PLAIN
from workbench.units import display_scale, display_unit, public_name

ROOM = 1.4  # of a correlation above zero, for what is said of it

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from workbench.comparison.compare import RecordingComparison
    from workbench.comparison.residuals import Residual


def residual_figure(each: RecordingComparison) -> Figure:
    """One row per output: spectral density on the left, autocorrelation on the right."""
    horizon = ONE_STEP if ONE_STEP in each.simulated else PLAIN
    with styled():
        figure = new_figure(PAGE_IN, 0.9 + 1.3 * len(each.residuals))
        panels = figure.subplots(len(each.residuals), 2, sharex="col", squeeze=False)
        for (name, residual), (left, right) in zip(each.residuals.items(), panels, strict=True):
            _draw_spectrum(left, name, residual)
            _draw_correlation(right, name, residual)
        panels[-1, 0].set_xlabel("frequency (Hz)")
        panels[-1, 1].set_xlabel("lag (s)")
        panels[0, 0].set_title("spectral density")
        panels[0, 1].set_title("autocorrelation; 95 % of white noise within the band")
        figure.suptitle(headline(f"{each.name}: error, {horizon}", PAGE_IN), fontsize=8)
        pairs = [axes.get_legend_handles_labels() for axes in panels[0]]
        (lines, words), (more, others) = pairs
        figure.legend(lines + more, words + others, loc="outside lower center", ncols=4)
    return figure


def _draw_spectrum(axes: Axes, name: str, residual: Residual) -> None:
    from matplotlib.ticker import NullFormatter

    per = 1.0 / display_scale(name).factor ** 2
    axes.loglog(
        residual.frequency_hz[1:], per * residual.density[1:], "-", color=BLUE, label="error"
    )
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_formatter(NullFormatter())
    axes.axhline(per * residual.floor, color=RED, linestyle="--", label="noise alone")
    axes.set_ylabel(f"{_words(name)}\n({_squared(display_unit(name))}/Hz)")


def _draw_correlation(axes: Axes, name: str, residual: Residual) -> None:
    lags, values, bands = (a[1:] for a in (residual.lag_s, residual.correlation, residual.bands))
    axes.fill_between(lags, -bands, bands, color=GREY, alpha=0.5, linewidth=0, label="band")
    axes.plot(lags, values, "o-", color=BLUE, markersize=1.5, linewidth=0.5, label="correlation")
    most = 1.15 * max(np.max(np.abs(values), initial=0.0), np.max(2.0 * bands, initial=0.0))
    axes.set_ylim(-(most or 1.0), ROOM * (most or 1.0))
    axes.set_ylabel("correlation (-)")
    axes.annotate(
        outside_band(residual.outside),
        (0.98, 0.96),
        xycoords="axes fraction",
        ha="right",
        va="top",
        fontsize=7,
    )


def _words(name: str) -> str:
    return public_name(name).replace(".", " ").replace("_", " ")


def _squared(unit: str) -> str:
    return rf"{unit}$^2$" if unit else "-"
