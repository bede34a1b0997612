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
    RED,
    new_figure,
    styled,
    thinned,
)
from workbench.identification.dead_volume import DeadVolumes
from workbench.identification.dead_zone import DeadZoneLimits
from workbench.identification.friction import FrictionMap
from workbench.identification.result import Identified
from workbench.identification.tank_curves import FlowFit
from workbench.identification.wall_heat import WallHeatFit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PA_PER_BAR = 1e5
GOAL_BAR = 0.04  # what paper 002 reports


def flow_figure(found: FlowFit) -> Figure:
    """Tank curves with their fits, area over command, and MAE over command."""
    with styled():
        figure = new_figure(PAGE_IN, 4.6)
        panels = figure.subplots(2, 2)
        for axes, charging in zip(panels[0], (True, False), strict=True):
            chosen = [curve for curve in found.curves if curve.charging == charging]
            for k, curve in enumerate(chosen[:: max(len(chosen) // 8, 1)]):
                time_s, measured, fitted = thinned(curve.along, curve.measured, curve.fitted)
                once = {"label": "measured"} if not k else {}
                axes.plot(time_s, measured / PA_PER_BAR, "-", color=GREY, linewidth=2.0, **once)
                once = {"label": "fitted"} if not k else {}
                axes.plot(time_s, fitted / PA_PER_BAR, "--", color=BLUE, **once)
            axes.set_title("charging" if charging else "discharging")
            axes.set_xlabel("time from the opening (s)")
        panels[0, 0].set_ylabel("reservoir pressure (bar)")
        panels[0, 1].legend()
        curves = sorted(zip(found.curves, found.rig_errors_pa, strict=True), key=_command)
        command_v = [curve.command_v for curve, _ in curves]
        area_mm2 = [1e6 * curve.area_m2.value for curve, _ in curves]
        panels[1, 0].plot(command_v, area_mm2, "o-", color=BLUE, markersize=2.5)
        panels[1, 0].set_ylabel("effective area (mm²)")
        own = [curve.mean_absolute_error / PA_PER_BAR for curve, _ in curves]
        rig = [error_pa / PA_PER_BAR for _, error_pa in curves]
        axes = panels[1, 1]
        axes.plot(command_v, own, "o-", color=BLUE, markersize=2.5, label="a fit per curve")
        axes.plot(command_v, rig, "s--", color=RED, markersize=2.5, label="the improved rig")
        axes.axhline(GOAL_BAR, color=BLACK, linestyle=":", label="paper 002")
        axes.set_ylabel("MAE (bar)")
        axes.set_ylim(0.0, 1.6 * max(*own, *rig, GOAL_BAR))
        axes.legend(loc="upper center", ncols=3)
        for axes in panels[1]:
            axes.set_xlabel("command (V)")
    return figure


def _command(row: tuple) -> float:
    return row[0].command_v


def dead_zone_figure(found: DeadZoneLimits) -> Figure:
    """Pressure over command with the fitted limits."""
    with styled():
        figure = new_figure(COLUMN_IN, 2.6)
        axes = figure.subplots()
        for k, curve in enumerate(found.curves):
            command, measured, fitted = thinned(curve.along, curve.measured, curve.fitted)
            labels = ({"label": "measured"}, {"label": "fitted"}) if not k else ({}, {})
            axes.plot(command, measured / PA_PER_BAR, "-", color=GREY, linewidth=2.5, **labels[0])
            axes.plot(command, fitted / PA_PER_BAR, "--", color=BLUE, **labels[1])
        for limit_v, name, style in ((found.lower_v, "zms", ":"), (found.upper_v, "zmd", "-.")):
            axes.axvline(limit_v, color=RED, linestyle=style, label=f"{name} {limit_v:.3f} V")
        axes.set_xlabel("command (V)")
        axes.set_ylabel("reservoir pressure (bar)")
        figure.legend(loc="outside lower center", ncols=2)
    return figure


def wall_heat_figure(found: WallHeatFit) -> Figure:
    """Decay with the exponential and with the fitted heat law, and their residuals."""
    with styled():
        figure = new_figure(COLUMN_IN, 3.4)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        exponential, law = found.curves[:2]
        time_s, measured = thinned(law.along, law.measured)
        upper.plot(time_s, measured / PA_PER_BAR, color=GREY, linewidth=2.5, label="measured")
        tau = found["time_constant_s"].value
        for curve, name, colour, style in (
            (exponential, f"exponential, tau {tau:.3f} s", ORANGE, "--"),
            (law, "heat law", BLUE, ":"),
        ):
            (fitted,) = thinned(curve.fitted)
            upper.plot(time_s, fitted / PA_PER_BAR, linestyle=style, color=colour, label=name)
            smooth = np.convolve(curve.residual, np.ones(50) / 50, mode="same")
            (left,) = thinned(smooth)
            lower.plot(time_s[:-1], left[:-1], linestyle=style, color=colour)
        upper.set_ylabel(f"{found.chamber.replace('_', ' ')} pressure (bar)")
        upper.legend()
        lower.set_ylabel("residual (Pa)\nmean of 50")
        lower.set_xlabel("time from the stop (s)")
    return figure


def friction_figure(found: FrictionMap) -> Figure:
    """Friction over speed: runs, break-aways, and the fitted curve."""
    with styled():
        figure = new_figure(COLUMN_IN, 2.8)
        axes = figure.subplots()
        axes.plot(*found.shape, "-", color=BLUE, label="fitted")
        speed = [run.velocity_m_s for run in found.runs]
        force = [run.force_n for run in found.runs]
        axes.plot(speed, force, "o", color=BLACK, markersize=3, label="runs")
        starts = [each.force_n if each.forward else -each.force_n for each in found.break_aways]
        axes.plot(np.zeros(len(starts)), starts, "x", color=RED, markersize=5, label="break-aways")
        axes.set_xlabel("velocity (m/s)")
        axes.set_ylabel("friction (N)")
        axes.legend()
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
