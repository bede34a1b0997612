"""What a plant can be controlled and observed with, and what each method bears in each mode."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from controllers.foresight import foreseeing
from controllers.lags import behind_lags, not_reading, spool_lag
from controllers.margins import Margins, both_ways_s, margins_of
from controllers.per_mode import Method, PerModeSpec, per_mode
from controllers.scheduled import driven_modes
from estimators import ESTIMATORS
from estimators.raw import RAW
from linearize.standard import SHIFT_MODES, SLIDE_MODES, slide_modes
from studies.following import BENCHES
from workbench.plant import Plant
from workbench.rig import Rig
from workbench.rig_text import quoted

PER_MODE = "per-mode"
AT_REST = "stick"  # in the names of modes
SPEC = """\
rise_time   = "150 ms"
overshoot   = "2 %"
final_error = "0.2 mm"
"""

Say = Callable[[str], None]


@dataclass(frozen=True)
class Offers:
    """What each method bears in each mode in which the valve drives the motion, by both names."""

    margins: Mapping[str, Mapping[Method, Margins]] = field(repr=False)

    @property
    def modes(self) -> tuple[str, ...]:
        """The names of these modes, forward then backward."""
        return tuple(self.margins)


def observers_of(plant: Plant) -> list[str]:
    """The estimators that are for a plant; none where its controller brings its own."""
    if plant.name in SHIFT_MODES:
        return []
    return [*ESTIMATORS, *([RAW] if plant.name in BENCHES else [])]


def usual_spec(plant: Plant) -> str:
    """A specification to begin with."""
    return SPEC if plant.name in SLIDE_MODES else ""


def mode_offers(rig: Rig, say: Say) -> Offers:
    """The margins of every method in every driven mode."""
    hybrid, lags = slide_modes(rig.plant), spool_lag(rig.plant, told=True)
    lagging, delay_s = behind_lags(hybrid, lags), both_ways_s(rig.plant)
    sides = driven_modes(lagging)
    found: dict[str, dict[Method, Margins]] = {m.name: {} for side in sides for m in side}
    for method in Method:
        say(f"margins of {method.value} in {len(found)} modes")
        spec = PerModeSpec(modes=dict.fromkeys(found, method))
        laws = not_reading(per_mode(hybrid, spec).laws, lags)
        laws = foreseeing(lagging, laws, spec.sample_time_s)
        for modes, side in zip(sides, (laws.forward, laws.backward), strict=True):
            for mode, law in zip(modes, side, strict=True):
                found[mode.name][method] = margins_of(mode, law, spec.sample_time_s, delay_s)
    return Offers(found)


def with_methods(spec: str, methods: Mapping[str, str]) -> str:
    """A specification with the method of each mode in the table that ``design`` reads."""
    lines = [f"{quoted(mode)} = {quoted(method)}" for mode, method in methods.items()]
    return "\n".join([spec.rstrip("\n"), "", f"[{PER_MODE}.modes]", *lines]) + "\n"


def with_observers(usual: str, by_mode: Mapping[str, str]) -> str:
    """Estimators by mode as ``check --estimator`` takes them."""
    others = [f"{name}@{mode}" for mode, name in by_mode.items() if name != usual]
    return ",".join([usual, *others])
