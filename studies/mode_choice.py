"""Which modes a user wants of a rig: standard, by regimes, a controller's, or placed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from controllers import CONTROLLERS
from linearize.listing import trial_of
from linearize.modes import HybridModel
from linearize.placement import SAMPLES, placed_modes
from linearize.regions import HORIZON_S, TOLERANCE, Validity, validity
from linearize.shift_modes import driving_modes
from linearize.standard import regime_modes, standard_modes
from linearize.stopped import has_stops
from linearize.visits import joined, recorded_visits
from studies.cuts_file import modes_by_cuts
from workbench.errors import InputError, Message
from workbench.plant import require
from workbench.recording import Recording
from workbench.rig import Rig
from workbench.units import UnitError, quantity

FINE = {"gearbox": 10}  # samples of a simulation for each recorded one: it shifts in 10 ms
OFTEN = {"gearbox": 40_000}  # samples looked at: it rests between shifts
LIMITS = {"gearbox": (1e-3, 0.2)}  # horizon in s and tolerance: dry friction is left out there


def chosen_modes(
    rig: Rig,
    placed_on: Sequence[Recording] = (),
    number: int | None = None,
    regimes: bool = False,
    cuts: Path | None = None,
    method: str = "",
) -> HybridModel:
    """The modes of a rig's plant: standard, by regimes, by the cuts of a file, or placed.

    ``number`` of them are placed where the recordings go, as many as there are without it; with
    ``method`` they are those on which this controller is designed.

    Raises
    ------
    InputError
        If there are no such modes, or a number without a recording to place them on.
    UnknownNameError
        If there is no such method, or none for the plant.
    ValueError
        If the recordings do not carry so many modes.
    """
    asked = {"--place": placed_on, "--regimes": regimes, "--cuts": cuts, "--for": method}
    given = [name for name, value in asked.items() if value]
    if len(given) > 1:
        raise InputError(Message("each choose the regions", " and ".join(given), "one of them"))
    if number is not None and not placed_on:
        raise InputError(Message("needs a recording to place modes on", "--number", "--place REC"))
    if method:
        require((method,), CONTROLLERS, "the list of controllers")
        return CONTROLLERS[method].modes(rig.plant)
    if cuts:
        return modes_by_cuts(rig.plant, cuts)
    if not placed_on:
        return (regime_modes if regimes else standard_modes)(rig.plant)
    name = rig.plant.name
    base = driving_modes(rig.plant) if name == "gearbox" else standard_modes(rig.plant)
    seen = joined(
        [
            recorded_visits(rig, base.model, each, has_stops(base), FINE.get(name, 1))
            for each in placed_on
        ]
    )
    wanted = len(base.modes) if number is None else number
    return placed_modes(base, seen, wanted, OFTEN.get(name, SAMPLES))


def trusted(horizon: str | None, tolerance: float | None) -> tuple[float | None, float | None]:
    """Horizon in s and tolerance as a user typed them.

    Raises
    ------
    InputError
        If either is not positive, or the horizon is no time.
    """
    try:
        horizon_s = None if horizon is None else quantity(horizon, "horizon_s")
    except UnitError as error:
        raise InputError(Message(str(error), "--horizon", "a time such as '50 ms'")) from None
    limits = {"--horizon": horizon_s, "--tolerance": tolerance}
    wrong = [
        Message(f"is {value:g}", name, "more than zero")
        for name, value in limits.items()
        if value is not None and not value > 0.0
    ]
    if wrong:
        raise InputError(*wrong)
    return horizon_s, tolerance


def regions_of(
    hybrid: HybridModel,
    horizon_s: float | None,
    tolerance: float | None,
    say: Callable[[str], None],
) -> tuple[Validity, ...]:
    """The region in which each mode predicts, with progress where that takes long."""
    usual_s, usual = LIMITS.get(hybrid.plant.name, (HORIZON_S, TOLERANCE))
    found = []
    for k, mode in enumerate(hybrid.modes):
        if k % 20 == 0:
            say(f"where each mode predicts: {k} of {len(hybrid.modes)}")
        limits = (horizon_s or usual_s, tolerance or usual, trial_of(mode).sample_time_s)
        found.append(validity(hybrid, mode, *limits))
    return tuple(found)
