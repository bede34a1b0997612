"""What an error of a measurement costs: squared, absolute, or squared up to a size (Huber).

Errors are in units of their standard deviation.  A Gauss-Newton step takes every loss as a weighted
square, with the weight rho'(e) / (2 e) at the error that the last step left (iterated reweighting).

Source: Huber and Ronchetti 2009, "Robust statistics", 7.8, for the weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca


@dataclass(frozen=True)
class Squared:
    """rho(e) = e^2: what Gaussian noise asks for."""

    def cost(self, error: ca.SX) -> ca.SX:
        return error**2

    def weight(self, error: ca.SX) -> ca.SX:
        return ca.SX.ones(error.shape)


@dataclass(frozen=True)
class Huber:
    """rho(e) = e^2 up to ``bend``, then the straight line 2 bend |e| - bend^2.

    Raises
    ------
    ValueError
        If the bend is not above zero.
    """

    bend: float = 1.345  # 95 % as efficient as the square where noise is Gaussian

    def __post_init__(self) -> None:
        if not self.bend > 0.0:
            raise ValueError(f"Huber: bend is {self.bend}, expected above 0")

    def cost(self, error: ca.SX) -> ca.SX:
        size = ca.fabs(error)
        return ca.if_else(size <= self.bend, error**2, 2.0 * self.bend * size - self.bend**2)

    def weight(self, error: ca.SX) -> ca.SX:
        return self.bend / ca.fmax(ca.fabs(error), self.bend)


@dataclass(frozen=True)
class Absolute:
    """rho(e) = 2 |e|, rounded by a square within ``corner`` of zero, where it has no slope.

    Raises
    ------
    ValueError
        If the corner is not above zero.
    """

    corner: float = 0.05

    def __post_init__(self) -> None:
        if not self.corner > 0.0:
            raise ValueError(f"Absolute: corner is {self.corner}, expected above 0")

    def cost(self, error: ca.SX) -> ca.SX:
        size = ca.fabs(error)
        return ca.if_else(size <= self.corner, error**2 / self.corner, 2.0 * size - self.corner)

    def weight(self, error: ca.SX) -> ca.SX:
        return 1.0 / ca.fmax(ca.fabs(error), self.corner)


Loss = Squared | Huber | Absolute
