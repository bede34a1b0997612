"""The next recording as text and as a document: what to do, how it is played, what it brings."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.plain import plain
from studies.text import columns, number, shown
from workbench.units import display_unit, public_name, si_unit, suffix

if TYPE_CHECKING:
    from workbench.diagnosis.result import NextRecording
    from workbench.manoeuvres.conduct import Conduct, Loop, Start

SPEED = {"m": "velocity_m_s", "rad": "velocity_rad_s"}  # of a position by its suffix
TOLD_STARTS = 3  # of recordings
LAW = (
    "speed dr/dt + w (r - y), limited to plus and minus `fastest` and given by the speed map, "
    "renewed every `update_s`; within `rest_within` of a resting reference the resting command; "
    "without a reference the loop is off and the command is the resting one"
)
LOOP_OFF = (
    "where the file has no reference (nan) the loop is off and the command is the resting one"
)
OPEN_LOOP = "the commands of the file alone, played without that loop, drift away"


def next_recording_text(asked: NextRecording) -> str:
    """What to record next, what that is expected to bring, and how it is played."""
    told = f"it tells apart {', '.join(asked.separates)}"
    if isfinite(asked.expected_gain):
        told += f": the right one gains about {number(asked.expected_gain, 3)} of chi2"
        told += " if nothing more is missing where it goes"
    told += "".join(f"; {one} and {other} stay alike" for one, other in asked.alike)
    return "\n".join((f"next recording: {asked.what}", told, *conduct_lines(asked)))


def conduct_lines(asked: NextRecording) -> list[str]:
    """Where it starts, which stops it comes to, what gives the commands and when, a line each."""
    known = asked.conduct
    if known is None:
        return []
    starts = ", ".join(_start(name, each) for name, each in known.starts.items())
    lines = [f"it starts with {starts}"]
    if known.contacts:
        met = " and ".join(
            f"{public_name(each.output)} to or within {shown(each.within, each.output, 2)} of "
            f"{shown(each.at, each.output)} at up to {shown(each.speed, _speed(each.output), 2)}"
            for each in known.contacts
        )
        lines.append(f"it comes to stops: {met}, as predicted")
    if known.loop:
        lines.append(_loop(known.loop))
    if any(np.isnan(row).any() for row in asked.reference.values()):
        lines.append(LOOP_OFF)
    return lines


def _loop(loop: Loop) -> str:
    """The position loop that it was rehearsed with."""
    limited = " and ".join(
        f"{public_name(output)} limited to ±{shown(fastest, _speed(output), 3)}, at rest within "
        f"{shown(loop.rest_within[output], output, 2)} of a resting reference"
        for output, fastest in loop.fastest.items()
    )
    return (
        "its loop gives the command that moves the plant at dr/dt + w (r - y), "
        f"w = {number(loop.bandwidth_rad_s, 2)} rad/s, renewed every "
        f"{number(1e3 * loop.update_s, 3)} ms, {limited}, where it gives the resting command; "
        f"{OPEN_LOOP}"
    )


def _start(name: str, each: Start) -> str:
    """Where one output has to be, and where recordings had it if that is elsewhere."""
    at = shown(each.at, name)
    own = list(dict.fromkeys(shown(value, name) for value in each.recorded if isfinite(value)))
    more = ", ..." if len(own) > TOLD_STARTS else ""
    elsewhere = f" (recordings start at {', '.join(own[:TOLD_STARTS])}{more})"
    return f"{public_name(name)} at {at}{elsewhere if own not in ([], [at]) else ''}"


def _speed(output: str) -> str:
    """The full name of the speed of a position or an angle."""
    body = output.rpartition(".")[0]
    return f"{body}.{SPEED[suffix(output)]}"


def instructions(asked: NextRecording) -> str:
    """The same with the speed map of each axis: what a loop at the rig needs."""
    parts = [next_recording_text(asked)]
    loop = asked.conduct.loop if asked.conduct else None
    for (output, speeds), command in zip(
        loop.maps.items() if loop else (), asked.commands, strict=False
    ):
        head = (
            f"{public_name(command)} ({display_unit(command)})",
            f"speed of {public_name(output)} ({display_unit(_speed(output))})",
        )
        rows = [
            (shown(u, command).split()[0], shown(v, _speed(output)).split()[0])
            for u, v in zip(speeds.command, speeds.speed, strict=True)
        ]
        parts += ["", columns(head, rows)]
    return "\n".join(parts) + "\n"


def conduct_document(known: Conduct) -> dict[str, Any]:
    """How it is played, in SI."""
    loop = known.loop
    return {
        "starts": {
            public_name(name): {
                "at": plain(each.at),
                "recordings": [plain(value) for value in each.recorded],
                "unit": si_unit(name),
            }
            for name, each in known.starts.items()
        },
        "contacts": [
            {
                "output": public_name(each.output),
                "at": plain(each.at),
                "within": plain(each.within),
                "unit": si_unit(each.output),
                "speed": plain(each.speed),
                "speed_unit": si_unit(_speed(each.output)),
            }
            for each in known.contacts
        ],
        "loop": _loop_document(loop) if loop else None,
    }


def _loop_document(loop: Loop) -> dict[str, Any]:
    """The position loop, its axes by public name."""
    return {
        "law": LAW,
        "bandwidth_rad_s": plain(loop.bandwidth_rad_s),
        "update_s": plain(loop.update_s),
        "axes": {
            public_name(output): {
                "fastest": plain(fastest),
                "speed_unit": si_unit(_speed(output)),
                "rest_within": plain(loop.rest_within[output]),
                "unit": si_unit(output),
            }
            for output, fastest in loop.fastest.items()
        },
        "speed_maps": {
            public_name(output): {
                "command": [plain(value) for value in speeds.command],
                "speed": [plain(value) for value in speeds.speed],
            }
            for output, speeds in loop.maps.items()
        },
    }
