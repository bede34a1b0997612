"""What switching valves pass after a history of commands: a table made from their own equations.

Coil and armature of a solenoid valve answer late, later to a release than to an energising, and
bounce on their seats; a pulse of a few milliseconds opens a valve for another time than it lasts.
None of that depends on the gas.  With a least time between two switches of a valve the histories
of commands that matter are few, and each is run once when the controller is designed.

A coil that has been energised for 14 ms lets go 1.5 ms sooner than one that was for a second: its
current still rises.  So a table has a dimension for how long the oldest command of a history had
stood before.

No two valves are the same.  What sets one apart in time is nearly one number, its strength, see
:mod:`linearize.valve_spread`; the table knows what it changes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, cached_property

import casadi as ca
import numpy as np

from linearize.valve_sample import valve_ends, valve_sample
from linearize.valve_spread import AS_DESIGNED, Learned, passed, valve_spread
from workbench.compiled import compiled
from workbench.plant import Plant

MEMORY = 20  # samples after which a valve has forgotten: the last bounce ends 19 ms after a release
BEFORE = 32  # further samples for which a coil that stays energised remembers when that began
RECENT, MASK = 2**MEMORY - 1, 2 ** (MEMORY + BEFORE) - 1
NODES = (0, 3, 8, 16, BEFORE)  # of these further samples, between which the table interpolates
FEW_NODES = (0, BEFORE)  # the same for the slopes
RELEASED_S = 0.017  # after which it no longer matters for how long the coil had been energised
COIL_S = 0.013  # in which the current settles; only sets how close the nodes are to each other


@dataclass(frozen=True)
class ValveResponse:
    """How far a valve is open over one sample, on the mean, by the commands up to and with it.

    A history is an integer whose lowest bit is the newest command.  Its two shares are those of
    :func:`linearize.valve_sample.valve_sample`; the flow into the chamber is linear in them.

    hold            least number of samples between two switches
    histories       all that keep ``hold`` for MEMORY samples, rising, shape (n,)
    shares          of charging and venting, by the samples for which an energised valve had been so
                    before the history begins, and by history, shape (BEFORE + 1, n, 2)
    slopes          what these gain by strength, same shape
    """

    hold: int
    histories: np.ndarray
    shares: np.ndarray
    slopes: np.ndarray

    def __post_init__(self) -> None:
        """Ready, so that no first sample has to wait."""
        _ = self._places, self._rows

    @cached_property
    def _places(self) -> np.ndarray:
        """Place of each history; -1 for those that do not keep ``hold``."""
        places = np.full(RECENT + 1, -1)
        places[self.histories] = np.arange(len(self.histories))
        return places

    @cached_property
    def _rows(self) -> np.ndarray:
        """Both shares and both slopes of every row of the table beside each other, shape (m, 4)."""
        return np.concatenate([self.shares, self.slopes], axis=2).reshape(-1, 4)

    def __getstate__(self) -> dict[str, object]:
        """Without what another process finds again."""
        return {key: value for key, value in self.__dict__.items() if not key.startswith("_")}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self.__post_init__()

    def ahead(self, past: int, plans: np.ndarray, learned: Learned = AS_DESIGNED) -> np.ndarray:
        """Shares under plans that begin after a history, shape (..., N, 2).

        ``plans`` are as :func:`packed` gives them, shape (..., N).

        Raises
        ------
        ValueError
            If a plan switches before ``hold`` samples are over.
        """
        histories = _histories(past, plans)
        rows = self._places.take(histories & RECENT)
        if (rows < 0).any():
            raise ValueError(f"a plan switches a valve twice within {self.hold} samples")
        older = histories >> MEMORY
        stood = np.bitwise_count(older ^ (older + 1)) - 1  # how many of its lowest bits are 1
        rows += stood * np.int64(len(self.histories))
        found = self._rows.take(rows, axis=0)
        return passed(found[..., :2], found[..., 2:], *learned, np.minimum, np.maximum)

    def keeps(self, past: int, plans: np.ndarray) -> np.ndarray:
        """True for each plan that switches no sooner than ``hold`` allows, shape (...,)."""
        return (self._places.take(_histories(past, plans) & RECENT) >= 0).all(axis=-1)


def _histories(past: int, plans: np.ndarray) -> np.ndarray:
    """What has been sent at each sample of plans, shape of ``plans``."""
    later = np.arange(1, plans.shape[-1] + 1)
    return ((past << later) | plans) & MASK


def packed(commands: np.ndarray) -> np.ndarray:
    """Commands 0 and 1 ahead, shape (..., N), as one integer for the first k of them each.

    It holds the newest MEMORY + BEFORE of them; older ones do not count.
    """
    return (commands.astype(float) @ _weights(commands.shape[-1])).astype(np.int64)


@cache
def _weights(number: int) -> np.ndarray:
    """What each command weighs in the integers of its successors, shape (N, N).

    In floats, in which products of matrices are fast and these sums exact.
    """
    later, most = np.arange(number) - np.arange(number)[:, None], MEMORY + BEFORE
    return np.where((later >= 0) & (later < most), 2.0 ** np.clip(later, 0, most), 0.0)


def age(history: int) -> int:
    """For how many samples the newest command has stood, at most MEMORY + BEFORE."""
    changes = (history ^ (history >> 1)) & (MASK >> 1)
    return (changes & -changes).bit_length() if changes else MEMORY + BEFORE


def valve_responses(
    plant: Plant, valves: Iterable[str], sample_time_s: float, hold: int
) -> tuple[ValveResponse, ...]:
    """The table of each valve, one for all whose parameters are the same.

    Raises
    ------
    InputError
        See :func:`linearize.valve_sample.ends_pa`.
    """
    values, made, found = plant.values, {}, []
    for valve in valves:
        own = tuple(v for name, v in values.items() if name.startswith(f"{valve}."))
        if own not in made:
            made[own] = valve_response(plant, valve, sample_time_s, hold)
        found.append(made[own])
    return tuple(found)


def valve_response(plant: Plant, valve: str, sample_time_s: float, hold: int) -> ValveResponse:
    """The table of one solenoid valve.

    Raises
    ------
    InputError
        See :func:`linearize.valve_sample.ends_pa`.
    """
    plant, commands = plant.lean(), admissible(hold)
    step = compiled(valve_sample(plant, valve, sample_time_s))
    pair = valve_spread(plant, valve, sample_time_s)[:1]

    def table(one: Plant, nodes: tuple[int, ...]) -> np.ndarray:
        return _table(step, valve_ends(one, valve), one.nominal[2], sample_time_s, commands, nodes)

    shares = table(plant, NODES)
    sides = [table(each, FEW_NODES) for both in pair for each in both]
    slopes = 0.5 * (sides[0] - sides[1]) if sides else np.zeros_like(shares)
    histories = packed(commands)[:, -1]
    order = np.argsort(histories)
    return ValveResponse(hold, histories[order], shares[:, order], slopes[:, order])


def _table(
    step: ca.Function,
    ends: np.ndarray,
    p: np.ndarray,
    sample_time_s: float,
    commands: np.ndarray,
    nodes: tuple[int, ...],
) -> np.ndarray:
    """Shares at the end of each row of commands (n, MEMORY), shape (BEFORE + 1, n, 2)."""
    switched = (commands != commands[:, :1]).argmax(axis=1)  # 0 where nothing ever switches
    lately = (switched == 0) | ((MEMORY - switched) * sample_time_s < RELEASED_S)
    matters = (commands[:, 0] == 1) & lately
    rest, on = np.flatnonzero(~matters), np.flatnonzero(matters)
    rising = _rising(step, ends, p)
    begun = [ends[:, commands[rest, 0]], *(np.tile(rising[:, [k]], len(on)) for k in nodes)]
    rows = commands[np.concatenate([rest, *[on] * len(nodes)])]
    found = _run(step, np.hstack(begun), rows, p)
    by_node = found[len(rest) :].reshape(len(nodes), len(on), 2)
    shares = np.empty((BEFORE + 1, len(commands), 2))
    shares[:, rest] = found[: len(rest)]
    shares[:, on] = np.tensordot(_between(nodes, sample_time_s), by_node, axes=1)
    return shares


def _rising(step: ca.Function, ends: np.ndarray, p: np.ndarray) -> np.ndarray:
    """States after 0 to BEFORE samples energised, shape (n_x, BEFORE + 1); the last for long."""
    states = [ends[:, 0]]
    for _ in range(BEFORE - 1):
        states.append(step(states[-1], 1.0, p)[0].full().ravel())
    return np.column_stack([*states, ends[:, 1]])


def _run(step: ca.Function, x: np.ndarray, commands: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Shares over the last sample of each row of commands (n, MEMORY), shape (n, 2)."""
    every = step.map("every", "serial", len(commands), [2], [])
    shares = None
    for u in commands.T[:, None].astype(float):
        x, shares = every(x, u, p)
    return shares.full().T


def _between(nodes: tuple[int, ...], sample_time_s: float) -> np.ndarray:
    """What each node counts for 0 to BEFORE samples, linear in the current, (BEFORE + 1, nodes)."""
    grown = 1.0 - np.exp(-np.arange(BEFORE + 1) * sample_time_s / COIL_S)
    return np.column_stack([np.interp(grown, grown[[*nodes]], row) for row in np.eye(len(nodes))])


def admissible(hold: int) -> np.ndarray:
    """All histories in which a command stands for ``hold`` samples at least, shape (n, MEMORY).

    The oldest run may have begun before, the newest may go on.
    """
    found = [((first,), MEMORY) for first in (0, 1)]
    for _ in range(MEMORY - 1):
        kept = [((*h, h[-1]), stood + 1) for h, stood in found]
        found = kept + [((*h, 1 - h[-1]), 1) for h, stood in found if stood >= hold]
    return np.array([h for h, _ in found])
