"""How far a spool opens a path, as a share of its full area."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from workbench.effect import Expression

FADING = 1e-3  # of the command's range: a stuck band narrower than this fades out
EDGE = 5e-3  # of the command's range: a spool that comes loose opens over this travel


@dataclass(frozen=True)
class SmoothOpening:
    """A path that begins to open softly and never shuts: eps/range smax(travel/eps), at most 1.

    smax(x) = (sqrt(x^2 + 1) + x)/2.  ``corner`` is eps, the length over which the edge is rounded.

    Source: paper 004, smax with the length scale that it lacks there (erratum E004-6).
    """

    def __call__(self, travel: Expression, span: Expression, corner: Expression) -> Expression:
        relative = travel / corner
        return ca.fmin(corner / span * (ca.sqrt(relative**2 + 1.0) + relative) / 2.0, 1.0)


@dataclass(frozen=True)
class SharpOpening:
    """A path that opens in proportion to the travel, from a sharp edge on."""

    def __call__(self, travel: Expression, span: Expression, corner: Expression) -> Expression:
        return ca.fmin(ca.fmax(travel, 0.0) / span, 1.0)


OpeningLaw = SmoothOpening | SharpOpening


def area_share(opening: Expression, exponent: Expression) -> Expression:
    """Share of the full area, 1 - (1 - s)^e: with e = 1 the opening s itself.

    Source: physics.md 2.4; the exponent is chosen there.
    """
    return 1.0 - ca.fmax(1.0 - opening, 1e-12) ** exponent


def shut_while_stuck(travel: Expression, band: Expression) -> Expression:
    """1 while the travel towards a side has not left the band in which the spool sticks, then 0.

    Travel and band are shares of the command's range.

    Source: paper 004, the vent event near 250 s; physics.md 6 and 7 (stuck spool).
    """
    present = 1.0 - ca.exp(-band / FADING)
    return present * ca.fmin(ca.fmax((band + EDGE - travel) / EDGE, 0.0), 1.0)
