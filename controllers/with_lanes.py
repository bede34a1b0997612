"""What a controller asks at every sample in lanes of the vector unit, or of CasADi without any."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property

import numpy as np


class WithLanes:
    """A value that is built when it is made: compiling takes seconds that no sample has.

    Another process builds it again: neither a library nor a buffer travels.
    """

    def __post_init__(self) -> None:
        if self._lanes is None:
            _ = self._by_casadi

    @cached_property
    def _lanes(self) -> Callable[..., None] | None:
        """What runs in lanes; None where nothing does."""
        raise NotImplementedError

    @cached_property
    def _by_casadi(self) -> Callable[..., list[np.ndarray]]:
        """The same without lanes."""
        raise NotImplementedError

    def __getstate__(self) -> dict[str, object]:
        made = ("_lanes", "_by_casadi")
        return {key: value for key, value in self.__dict__.items() if key not in made}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self.__post_init__()


def filled(given: Iterable[np.ndarray], shapes: Iterable[tuple[int, ...]]) -> list[np.ndarray]:
    """Arrays as C reads them.

    Raises
    ------
    ValueError
        If one has another shape: C would read beyond its end.
    """
    found = [np.ascontiguousarray(each, dtype=float) for each in given]
    for each, shape in zip(found, shapes, strict=True):
        if each.shape != shape:
            raise ValueError(f"plans are costed from {shape}, given is {each.shape}")
    return found
