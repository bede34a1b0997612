"""What switching valves pass after a history of commands: a table made from their own equations.

Coil and armature of a solenoid valve answer late, later to a release than to an energising, and
bounce on their seats; a pulse of a few milliseconds opens a valve for another time than it lasts.
None of that depends on the gas.  With a least time between two switches of a valve the histories
of commands that matter are few, and each is run once when the controller is designed.

Source: physics.md 2.5 (coil, armature, and what the ports pass).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import casadi as ca
import numpy as np

from workbench.compiled import compiled
from workbench.effects.solenoid_valve import SolenoidValve
from workbench.plant import Plant
from workbench.rosenbrock import controlled_step

MEMORY = 20  # samples after which a valve has forgotten: the last bounce ends 19 ms after a release
MASK = 2**MEMORY - 1
FINER = 4  # instants of one sample over which the flow is averaged
STANDING_PA = 3e5  # chamber pressure of the table: both paths are choked there


@dataclass(frozen=True)
class ValveResponse:
    """Mean share of the charging flow over one sample, by the commands up to and with it.

    A history is an integer whose lowest bit is the newest command.  Share 0 is a valve that has
    been released for long, 1 one that has been energised for long; flows are affine in it.

    hold            least number of samples between two switches
    histories       all that keep ``hold``, rising, shape (n,)
    shares          of each history, shape (n,)
    """

    hold: int
    histories: np.ndarray
    shares: np.ndarray

    def __post_init__(self) -> None:
        """Ready, so that no first sample has to wait."""
        _ = self._places

    @cached_property
    def _places(self) -> np.ndarray:
        """Place of each history; -1 for those that do not keep ``hold``."""
        places = np.full(MASK + 1, -1, dtype=np.int32)
        places[self.histories] = np.arange(len(self.histories))
        return places

    def __getstate__(self) -> dict[str, object]:
        """Without the places, which another process finds again."""
        return {key: value for key, value in self.__dict__.items() if key != "_places"}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self.__post_init__()

    def ahead(self, past: int, plans: np.ndarray) -> np.ndarray:
        """Shares under plans that begin after a history, shape of ``plans``.

        ``plans`` are as :func:`packed` gives them, shape (..., N).

        Raises
        ------
        ValueError
            If a plan switches before ``hold`` samples are over.
        """
        places = self._found(past, plans)
        if (places < 0).any():
            raise ValueError(f"a plan switches a valve twice within {self.hold} samples")
        return self.shares[places]

    def newest(self, history: int) -> float:
        """Share over the sample of the newest command.

        Raises
        ------
        ValueError
            If the history does not keep ``hold``.
        """
        return float(self.ahead(history >> 1, np.array([history & 1]))[0])

    def keeps(self, past: int, plans: np.ndarray) -> np.ndarray:
        """True for each plan that switches no sooner than ``hold`` allows, shape (...,)."""
        return (self._found(past, plans) >= 0).all(axis=-1)

    def _found(self, past: int, plans: np.ndarray) -> np.ndarray:
        later = np.arange(1, plans.shape[-1] + 1)
        return self._places[((past << later) | plans) & MASK]


def packed(commands: np.ndarray) -> np.ndarray:
    """Commands 0 and 1 ahead, shape (..., N), as one integer for the first k of them each.

    It holds the newest MEMORY of them; older ones do not count.
    """
    return (commands.astype(float) @ _weights(commands.shape[-1])).astype(np.int64)


@cache
def _weights(number: int) -> np.ndarray:
    """What each command weighs in the integers of its successors, shape (N, N).

    In floats, in which products of matrices are fast and these sums exact.
    """
    later = np.arange(number) - np.arange(number)[:, None]
    return np.where((later >= 0) & (later < MEMORY), 2.0 ** np.clip(later, 0, MEMORY), 0.0)


def age(history: int) -> int:
    """For how many samples the newest command has stood, at most MEMORY."""
    changes = (history ^ (history >> 1)) & (MASK >> 1)
    return (changes & -changes).bit_length() if changes else MEMORY


def valve_response(plant: Plant, valve: str, sample_time_s: float, hold: int) -> ValveResponse:
    """The table of one solenoid valve.

    The force of the pressures on the armature, null in the plant of paper 003, is that at 3 bar.
    """
    flow, step, ends = _alone(plant.lean(), valve, sample_time_s / FINER)
    commands = admissible(hold)
    n = len(commands)
    x = np.where(commands[:, 0], ends[:, [1]], ends[:, [0]])
    passed, advance = flow.map(n), compiled(step).map(n)
    low, high = (float(flow(ends[:, k], k)) for k in (0, 1))
    none = np.zeros((0, n))
    for u in commands.T[:, None].astype(float):
        seen = [passed(x, u).full().ravel()]
        for _ in range(FINER):
            x = advance(x, u, none, none).full()
            seen.append(passed(x, u).full().ravel())
    shares = (np.trapezoid(seen, axis=0) / FINER - low) / (high - low)
    histories = packed(commands)[:, -1]
    order = np.argsort(histories)
    return ValveResponse(hold, histories[order], shares[order])


def admissible(hold: int) -> np.ndarray:
    """All histories in which a command stands for ``hold`` samples at least, shape (n, MEMORY).

    The oldest run may have begun before, the newest may go on.
    """
    found = [((first,), MEMORY) for first in (0, 1)]
    for _ in range(MEMORY - 1):
        kept = [((*h, h[-1]), stood + 1) for h, stood in found]
        found = kept + [((*h, 1 - h[-1]), 1) for h, stood in found if stood >= hold]
    return np.array([h for h, _ in found])


def _alone(plant: Plant, valve: str, step_s: float) -> tuple[ca.Function, ca.Function, np.ndarray]:
    """Flow of (x, u), step of (x, u, -, -), and (x released, x energised), x that of the valve."""
    model = plant.model
    (effect,) = (e for e in plant.effects if isinstance(e, SolenoidValve) and e.name == valve)
    x, u, d, p = model.symbols
    own = [model.states.index(f"{valve}.{state.quantity}") for state in effect.states()]
    rest = [k for k in range(len(model.states)) if k not in own]
    at, (_, d_nominal, p_nominal) = plant.initial.copy(), plant.nominal
    pressure, mass = (
        model.states.index(f"{effect.chamber}.{q}") for q in ("pressure_pa", "mass_kg")
    )
    at[mass] *= STANDING_PA / at[pressure]
    at[pressure] = STANDING_PA
    command = model.commands.index(f"{valve}.command")
    others = [k for k in range(len(model.commands)) if k != command]
    old = [x[rest], u[others], d, p]
    new = [ca.DM(at[rest]), ca.DM.zeros(len(others)), ca.DM(d_nominal), ca.DM(p_nominal)]
    flow = ca.SX(model.flows[valve, "MassFlow", effect.chamber])
    rates, flow = ca.substitute([model.rates[own], flow], old, new)
    passed, none = ca.Function("passed", [x[own], u[command]], [flow]), ca.SX(0, 1)
    symbols = (x[own], u[command], none, none)
    step = controlled_step(symbols, rates, step_s, model.tolerances[own])
    driven = [float(effect.driven()[state.quantity]) for state in effect.states()]
    return passed, step, np.column_stack([plant.initial[own], driven])
