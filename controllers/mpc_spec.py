"""The numbers of linear and nonlinear MPC."""

from __future__ import annotations

from dataclasses import dataclass, field

from controllers.positioning import PositioningSpec
from controllers.spec import ranged

LONGEST = 500  # samples ahead; the program is dense, and grows with the square


@dataclass(frozen=True, kw_only=True)
class MpcSpec:
    """Tolerable deviations, each worth a cost of one, horizon, limits and clock.

    Attributes
    ----------
    move_v
        Tolerable change of the opening from sample to sample.
    force_n_m_s
        Force by which the target pressures shift per integral of the position error.
    margin_m
        The position stays this far from the end stops.
    lowest_m, below_end_m
        Soft limits of the position where they are tighter, the upper one as its distance from the
        end of the stroke.
    lowest_pa, below_supply_pa
        Soft limits of the pressures, the upper one as its distance from the supply pressure.
    fastest_m_s, rate_v_s
        Soft limits of the speed, and of how fast the opening changes.
    slack_weight
        Cost of violating a limit by 1 mm, 0.1 m/s, 0.1 bar or 1 V per sample; grows as the square.
    slack_price
        Cost of violating a limit by 10 mm, 0.1 m/s, 0.1 bar or 0.1 V per sample; grows in
        proportion, so that a limit is kept wherever keeping it costs less.
    """

    sample_time_s: float = 2e-3
    horizon: int = ranged(20, least=1, most=LONGEST)
    position_m: float = 1e-3
    velocity_m_s: float = 0.1
    pressure_pa: float = 1e6
    opening_v: float = 0.3
    move_v: float = 3.0
    force_n_m_s: float = ranged(5e4)
    margin_m: float = ranged(2e-3)
    lowest_m: float = ranged(0.0)
    below_end_m: float = ranged(0.0)
    lowest_pa: float = 1.2e5
    below_supply_pa: float = ranged(1e4)
    fastest_m_s: float = 2.0
    rate_v_s: float = 2.5e3
    slack_weight: float = 1e3
    slack_price: float = ranged(1e4)
    positioning: PositioningSpec = field(default_factory=PositioningSpec)
