"""Batches: dataclasses of arrays whose last axis counts columns, one simulated plant each."""

from collections.abc import Sequence
from dataclasses import fields
from typing import TypeVar

import numpy as np

T = TypeVar("T")


def stack(plants: Sequence[T]) -> T:
    """Many plants as one batch: every field becomes an array of shape (n_columns,)."""
    kind = type(plants[0])
    return kind(
        **{f.name: np.array([getattr(p, f.name) for p in plants], float) for f in fields(kind)}
    )


def spread(plant: T, columns: int) -> T:
    """The same with every field an array of shape (n_columns,)."""
    kind = type(plant)
    return kind(
        **{
            f.name: np.broadcast_to(getattr(plant, f.name), (columns,)).astype(float)
            for f in fields(kind)
        }
    )


def take(state: T, column) -> T:
    """Columns of a state, by index array; repeats are allowed."""
    kind = type(state)
    return kind(**{f.name: getattr(state, f.name)[..., column].copy() for f in fields(kind)})


def join(states: Sequence[T]) -> T:
    """Batches side by side."""
    kind = type(states[0])
    return kind(
        **{
            f.name: np.concatenate([getattr(s, f.name) for s in states], axis=-1)
            for f in fields(kind)
        }
    )
