"""Figures of the identification procedures, one per result."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from studies.figures.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREY,
    ORANGE,
    PAGE_IN,
    PURPLE,
    RED,
    headline,
    new_figure,
    styled,
    thinned,
)
from workbench.identification.dead_volume import DeadVolumes
from workbench.identification.dead_zone import DeadZoneLimits
from workbench.identification.friction import FrictionMap
from workbench.identification.result import Identified
from workbench.identification.tank_curves import FlowFit, TankCurve
from workbench.identification.wall_heat import WallHeatFit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PA_PER_BAR = 1e5
GOAL_BAR = 0.04  # what paper 002 reports
SHOWN_M2 = 1e-7  # below, a path is closed and its shape is not seen
LABELS_APART = 2.2  # ratio of half times below which two labels would touch
SMOOTHED = 50  # samples of a residual


def flow_figure(found: FlowFit) -> Figure:
    """Tank curves with their fits, area, b, a and m over command, and MAE over command."""
    with styled():
        figure = new_figure(PAGE_IN, 6.4)
        panels = figure.subplots(3, 2)
        for axes, charging in zip(panels[0], (True, False), strict=True):
            _tank_curves(axes, [c for c in found.curves if c.charging == charging])
            axes.set_title("charging" if charging else "discharging")
        panels[0, 0].set_ylabel("reservoir pressure (bar)")
        rows = (
            (panels[1, 0], "area_m2", "effective area (mm²)", 1e6),
            (panels[1, 1], "critical_ratio", "critical ratio b (-)", 1.0),
            (panels[2, 0], "subsonic_index", "subsonic index m (-)", 1.0),
        )
        for axes, key, label, scale in rows:
            _over_command(axes, found, key, scale)
            axes.set_ylabel(label)
        panels[1, 0].legend()
        _errors_of_curves(panels[2, 1], found)
    return figure


def _tank_curves(axes: Axes, curves: list[TankCurve]) -> None:
    """Some nine curves over the logarithm of time; those that lie apart bear their command."""
    labelled_s = 0.0
    chosen = curves[:: max(len(curves) // 8, 1)]
    for curve in sorted(chosen, key=_half_time_s):
        time_s, measured, fitted = (
            column[1:] for column in thinned(curve.along, curve.measured, curve.fitted)
        )
        names = ("_", "_") if labelled_s else ("measured", "fitted")
        axes.plot(time_s, measured / PA_PER_BAR, "-", color=GREY, linewidth=2.0, label=names[0])
        axes.plot(time_s, fitted / PA_PER_BAR, "--", color=BLUE, label=names[1])
        half_s = _half_time_s(curve)
        if half_s < LABELS_APART * labelled_s:
            continue
        labelled_s = half_s
        level = float(np.interp(half_s, curve.along, curve.fitted)) / PA_PER_BAR
        white = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none"}
        where = {"ha": "center", "va": "center", "fontsize": 6, "bbox": white}
        axes.annotate(f"{curve.command_v:.1f} V", (half_s, level), **where)
    axes.set_xscale("log")
    axes.set_xlabel("time from the opening (s)")
    axes.legend(loc="upper left" if curves and curves[0].charging else "lower left")


def _half_time_s(curve: TankCurve) -> float:
    """When the pressure has gone half its way."""
    way = (curve.fitted - curve.fitted[0]) / (curve.fitted[-1] - curve.fitted[0])
    return float(curve.along[np.argmax(way > 0.5)])


def _over_command(axes: Axes, found: FlowFit, key: str, scale: float) -> None:
    """One flow parameter of every curve with a path open, with its standard deviations."""
    limits = [curve for curve in found.curves if curve.area_m2.value > SHOWN_M2]
    for charging, style, colour, name in (
        (False, "s", RED, "exhaust path"),
        (True, "o", BLUE, "supply path"),
    ):
        chosen = [c for c in limits if c.charging == charging]
        axes.errorbar(
            [c.command_v for c in chosen],
            [scale * getattr(c, key).value for c in chosen],
            [scale * getattr(c, key).deviation for c in chosen],
            fmt=style,
            color=colour,
            markersize=2.5,
            elinewidth=0.6,
            label=name,
        )
    axes.set_xlabel("command (V)")


def _errors_of_curves(axes: Axes, found: FlowFit) -> None:
    curves = sorted(zip(found.curves, found.rig_errors_pa, strict=True), key=_command)
    command_v = [curve.command_v for curve, _ in curves]
    own = [curve.mean_absolute_error / PA_PER_BAR for curve, _ in curves]
    rig = [error_pa / PA_PER_BAR for _, error_pa in curves]
    axes.plot(command_v, own, "o-", color=BLUE, markersize=2.5, label="a fit per curve")
    axes.plot(command_v, rig, "s--", color=RED, markersize=2.5, label="the improved rig")
    axes.axhline(GOAL_BAR, color=BLACK, linestyle=":", label="paper 002")
    axes.set_ylabel("MAE (bar)")
    axes.set_xlabel("command (V)")
    axes.set_ylim(0.0, 1.6 * max(*own, *rig, GOAL_BAR))
    axes.legend(loc="upper center", ncols=3)


def _command(row: tuple) -> float:
    return row[0].command_v


def dead_zone_figure(found: DeadZoneLimits) -> Figure:
    """Pressure over command with the fitted limits."""
    with styled():
        figure = new_figure(COLUMN_IN, 2.8)
        axes = figure.subplots()
        axes.axvspan(found.lower_v, found.upper_v, color=ORANGE, alpha=0.2, label="dead zone")
        for k, curve in enumerate(found.curves):
            command, measured, fitted = thinned(curve.along, curve.measured, curve.fitted)
            labels = ({"label": "measured"}, {"label": "fitted"}) if not k else ({}, {})
            axes.plot(command, measured / PA_PER_BAR, "-", color=GREY, linewidth=2.5, **labels[0])
            axes.plot(command, fitted / PA_PER_BAR, "--", color=BLUE, **labels[1])
        for limit_v, name, style in (
            (found.lower_v, "lower limit", ":"),
            (found.upper_v, "upper limit", "-."),
        ):
            axes.axvline(limit_v, color=RED, linestyle=style, label=f"{name} {limit_v:.3f} V")
        axes.set_xlabel("command (V)")
        axes.set_ylabel("reservoir pressure (bar)")
        figure.legend(loc="outside lower center", ncols=3)
    return figure


def wall_heat_figure(found: WallHeatFit) -> Figure:
    """Each decay with its exponential and with the fitted heat law, and their residuals."""
    pairs = list(zip(found.curves[::2], found.curves[1::2], strict=True))
    with styled():
        width_in = COLUMN_IN if len(pairs) == 1 else PAGE_IN
        figure = new_figure(width_in, 3.6)
        panels = figure.subplots(2, len(pairs), sharex="col", height_ratios=(2, 1), squeeze=False)
        for (upper, lower), (exponential, law) in zip(panels.T, pairs, strict=True):
            time_s, measured = thinned(law.along, law.measured)
            upper.plot(time_s, measured / PA_PER_BAR, color=GREY, linewidth=2.5, label="measured")
            for curve, name, colour, style in (
                (exponential, "exponential", ORANGE, "--"),
                (law, "heat law", BLUE, ":"),
            ):
                fitted = thinned(law.along, curve.fitted / PA_PER_BAR)
                upper.plot(*fitted, linestyle=style, color=colour, label=name)
                smooth = np.convolve(curve.residual, np.ones(SMOOTHED) / SMOOTHED, mode="valid")
                middle = law.along[SMOOTHED // 2 :][: len(smooth)]
                lower.plot(*thinned(middle, smooth), linestyle=style, color=colour)
            upper.set_title(headline(law.label.rpartition(",")[0], width_in / len(pairs)))
            lower.set_xlabel("time from the stop (s)")
        panels[0, 0].set_ylabel(f"{found.chamber.replace('_', ' ')} pressure (bar)")
        panels[1, 0].set_ylabel(f"residual (Pa)\nmean of {SMOOTHED}")
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def friction_figure(found: FrictionMap) -> Figure:
    """Friction over speed with runs and fitted curve; break-aways over where the piston rested."""
    with styled():
        figure = new_figure(PAGE_IN, 2.8)
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
        left.plot(*found.shape, "-", color=BLUE, label="fitted")
        speed = [run.velocity_m_s for run in found.runs]
        force = [run.force_n for run in found.runs]
        spread = [run.deviation_n for run in found.runs]
        left.errorbar(speed, force, spread, fmt="o", color=BLACK, markersize=3, label="runs")
        left.set_xlabel("velocity (m/s)")
        left.set_ylabel("friction (N)")
        left.legend()
        for forward, marker, colour, name in (
            (True, "^", RED, "forward"),
            (False, "v", PURPLE, "backward"),
        ):
            chosen = [each for each in found.break_aways if each.forward == forward]
            side = 1.0 if forward else -1.0
            places = [1e3 * each.position_m for each in chosen]
            right.plot(
                places,
                [side * each.force_n for each in chosen],
                marker,
                color=colour,
                markersize=4,
                linestyle="none",
                label=f"break-away, {name}",
            )
            level_n = side * found[f"static_{name}_n"].value
            right.axhline(level_n, color=BLUE, linewidth=0.7)
        right.set_xlabel("position of the rest (mm)")
        right.legend(loc="center")
    return figure


def dead_volume_figure(found: DeadVolumes) -> Figure:
    """Pressure of each chamber with the flat window and its line back to the release."""
    with styled():
        figure = new_figure(COLUMN_IN, 0.6 + 1.7 * len(found.curves))
        panels = figure.subplots(len(found.curves), 1, sharex=True, squeeze=False)[:, 0]
        for axes, curve, release in zip(panels, found.curves, found.releases, strict=True):
            time_s, measured, fitted = thinned(curve.along, curve.measured, curve.fitted)
            axes.plot(time_s, measured / PA_PER_BAR, color=GREY, linewidth=2.0, label="measured")
            axes.plot(time_s, fitted / PA_PER_BAR, "--", color=BLUE, label="line of the window")
            axes.axvspan(*release.window_s, color=ORANGE, alpha=0.25, label="flat window")
            top = max(release.after_pa, float(np.max(measured))) / PA_PER_BAR
            axes.set_ylim(top - 0.15, top + 0.05)
            axes.set_ylabel(f"{release.chamber.replace('_', ' ')}\npressure (bar)")
            dead = found[f"{release.chamber}.dead_volume_m3"]
            told = f"{1e6 * dead.value:.1f} ± {1e6 * dead.deviation:.1f} cm³"
            axes.set_title(f"dead volume {told}", loc="right")
        panels[-1].set_xlabel("time (s)")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(handles))
    return figure


FIGURES: dict[type[Identified], tuple[str, Callable[..., Figure]]] = {
    FlowFit: ("flow", flow_figure),
    DeadZoneLimits: ("dead_zone", dead_zone_figure),
    WallHeatFit: ("wall_heat", wall_heat_figure),
    FrictionMap: ("friction", friction_figure),
    DeadVolumes: ("dead_volume", dead_volume_figure),
}


def identification_figures(found: Identified) -> dict[str, Figure]:
    """The figure of a result, by file name."""
    name, draw = FIGURES[type(found)]
    return {name: draw(found)}
