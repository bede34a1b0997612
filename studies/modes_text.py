"""The modes of a rig as text: what they can do, where they predict, what is left out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from linearize.listing import jumps, left_out, no_modes, table
from studies.text import columns, number, shown
from workbench.units import public_name

if TYPE_CHECKING:
    from linearize.modes import HybridModel
    from linearize.regions import Validity


def modes_text(hybrid: HybridModel, regions: Sequence[Validity]) -> str:
    """The table of modes, that of their regions, and what is in neither."""
    parts = [table(hybrid)]
    if regions:
        parts.append(region_table(regions))
    parts.append(f"left out of the modes:\n{left_out(hybrid) or 'nothing'}")
    if hybrid.no_modes:
        parts.append(f"no modes of their own:\n{no_modes(hybrid)}")
    if hybrid.jumps:
        parts.append(f"jumps between modes:\n{jumps(hybrid)}")
    return "\n\n".join(parts)


def region_table(regions: Sequence[Validity], what: str = "mode") -> str:
    """Half-widths of the boxes around the points in which modes predict, a line for each mode."""
    names = list(dict.fromkeys(name for each in regions for name in each.alone))
    head = (what, "error at its point", *map(public_name, names))
    rows = [
        (
            each.name,
            number(each.at_point, 2),
            *(shown(each.together[n], n, 2) if n in each.together else "held" for n in names),
        )
        for each in regions
    ]
    limit = f"{regions[0].tolerance:g} of any scale over {1e3 * regions[0].horizon_s:g} ms"
    told = f"half-widths of boxes in which a mode errs less than {limit}"
    return f"{told}\n{columns(head, rows)}"
