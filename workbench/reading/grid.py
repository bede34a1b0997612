"""One uniform time grid: small jitter is interpolated, gaps are refused or cut."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from workbench.errors import InputError, Message
from workbench.reading.lost_rows import FEWEST, lost_rows
from workbench.reading.table import RecordingWarning

LONGEST_STEP = 2.5  # of the usual time between samples; beyond that it is a gap
EXACT = 0.02  # of a sample: closer to the grid than this needs no interpolation
WHOLE = 0.05  # so close to a whole number, a ratio of two clocks is one
ROUNDING = 0.05  # of half a resolution: the line through rounded stamps is not quite the clock's
CLOCK = 0.6  # of a sample: a clock this close to even ticks evenly, its stamps are rounded


@dataclass(frozen=True)
class Grid:
    """Sample times of gap-free pieces; ``grids_s`` is None where the samples already lie on it.

    ``finer`` is true where it was asked for with a step shorter than that of the samples.
    """

    time_s: np.ndarray
    sample_time_s: float
    pieces: tuple[slice, ...]
    grids_s: tuple[np.ndarray, ...] | None
    finer: bool = False

    @property
    def begins_s(self) -> float:
        """Time of the first sample on the grid."""
        return float(self.grids_s[0][0] if self.grids_s else self.time_s[self.pieces[0]][0])

    @property
    def starts(self) -> tuple[int, ...]:
        """First sample of each piece on the grid."""
        lengths = (
            [len(grid) for grid in self.grids_s]
            if self.grids_s
            else [piece.stop - piece.start for piece in self.pieces]
        )
        return tuple(int(n) for n in np.cumsum([0, *lengths[:-1]]))

    def on(self, values: np.ndarray, filled: bool = True) -> np.ndarray:
        """A channel on the grid, shape (n,): between samples a line; on/off signals are held.

        A sensor slower than the clock has no value in most rows.  Its samples go to the points of
        the grid next to them, on the line between them; no others are made up.  So it is with any
        that is not to be ``filled``, on a grid that is finer than its samples: what is made up has
        no noise.
        """
        if self.grids_s is None:
            return np.concatenate([values[piece] for piece in self.pieces])
        finite = values[np.isfinite(values)]
        switched = len(finite) and np.isin(finite, [finite.min(), finite.max()]).all()
        place = _held if switched else np.interp
        return np.concatenate(
            [
                _placed(
                    place,
                    grid,
                    self.time_s[piece],
                    values[piece],
                    self.sample_time_s,
                    filled or not self.finer,
                )
                for grid, piece in zip(self.grids_s, self.pieces, strict=True)
            ]
        )


def uniform_grid(
    time_s: np.ndarray,
    place: Callable[[int], str],
    file: str,
    *,
    gaps: str = "refuse",
    resample_s: float | None = None,
    least: int = 2,
) -> Grid:
    """The grid for these sample times, shape (n,).

    The step is the usual time between samples, or ``resample_s``.  With ``gaps="split"`` the
    recording is cut at every gap; pieces of fewer than ``least`` samples are left out.

    Raises
    ------
    InputError
        If time is missing, runs backwards, stands still or has a gap, with the place.
    """
    _require_forward(time_s, place, file)
    steps = np.diff(time_s)
    usual = float(np.median(steps))
    gap = np.flatnonzero(steps > LONGEST_STEP * usual)
    if len(gap) and gaps == "refuse":
        worst = gap[np.argmax(steps[gap])]
        what = (
            f"{len(gap)} gap{'s' * (len(gap) > 1)} in the time, the longest {steps[worst]:.4g} s "
            f"after {place(worst)} (t = {time_s[worst]:.6g} s)"
        )
        expected = f'a sample every {usual:.4g} s, or gaps = "split" in [recording]'
        raise InputError(Message(what, "time", expected, file=file))
    edges = [0, *(gap + 1), len(time_s)]
    pieces = tuple(slice(int(a), int(b)) for a, b in pairwise(edges))
    finer = resample_s is not None and _finer(time_s, pieces, usual, resample_s, file)
    on_ticks = None if resample_s else _on_ticks(time_s, pieces, usual)
    if on_ticks is None:
        step, exact = _step(time_s, pieces, usual, resample_s)
    else:
        (time_s, step), exact = on_ticks, False
    grids = [_points(time_s[piece], step) for piece in pieces]
    kept = [i for i, grid in enumerate(grids) if len(grid) >= least]
    if not kept:
        what = f"no piece without a gap has {least} samples"
        raise InputError(Message(what, "time", file=file))
    if len(kept) < len(pieces):
        warnings.warn(
            f"{file}: {len(pieces) - len(kept)} pieces between gaps are too short and left out",
            RecordingWarning,
            stacklevel=2,
        )
    chosen = tuple(pieces[i] for i in kept)
    return Grid(time_s, step, chosen, None if exact else tuple(grids[i] for i in kept), finer)


def _require_forward(time_s: np.ndarray, place: Callable[[int], str], file: str) -> None:
    if len(time_s) < 2:
        raise InputError(Message(f"{len(time_s)} sample is no recording", file=file))
    if not np.isfinite(time_s).all():
        at = place(int(np.argmin(np.isfinite(time_s))))
        raise InputError(Message(f"no time at {at}", "time", file=file))
    steps = np.diff(time_s)
    if (steps <= 0).any():
        row = int(np.argmax(steps <= 0))
        how = "stands still" if steps[row] == 0 else "runs backwards"
        what = f"time {how} at {place(row + 1)}: {time_s[row + 1]:.6g} s after {time_s[row]:.6g} s"
        raise InputError(Message(what, "time", file=file))


def _finer(
    time_s: np.ndarray, pieces: tuple[slice, ...], usual: float, resample_s: float, file: str
) -> bool:
    """Whether a grid is finer than the samples, which then lie on every so many-th of its points.

    Unevenly spread over them, they would show their motion as noise.
    """
    on_ticks = _on_ticks(time_s, pieces, usual)
    own_s = on_ticks[1] if on_ticks else _step(time_s, pieces, usual, None)[0]
    ratio = own_s / resample_s
    if ratio <= 1.0 + EXACT:
        return False
    if abs(ratio - round(ratio)) > WHOLE:
        what = (
            f"{1e3 * resample_s:g} ms is no whole part of the {1e3 * own_s:.4g} ms between samples"
        )
        raise InputError(Message(what, "resample", f'"{1e3 * own_s:.4g} ms" or longer', file=file))
    return True


def _on_ticks(
    time_s: np.ndarray, pieces: tuple[slice, ...], usual: float
) -> tuple[np.ndarray, float] | None:
    """Times and their step where rows are lost: all others keep their samples as they are.

    Stamps that are off by more than rounding stay as they are.  None where no row is lost.
    """
    found = lost_rows(time_s, pieces, usual, _only_rounded)
    if found is None:
        return None
    ticks, slope = found
    step = _tidy(slope, max(int(each[-1]) for each in ticks))
    stamped = [time_s[piece] for piece in pieces]
    if all(
        _fits(t, step, k) or _only_rounded(t, slope, k) for t, k in zip(stamped, ticks, strict=True)
    ):
        even = [t[0] + step * k for t, k in zip(stamped, ticks, strict=True)]
        return np.concatenate(even), step
    return time_s, step


def _step(
    time_s: np.ndarray, pieces: tuple[slice, ...], usual: float, resample_s: float | None
) -> tuple[float, bool]:
    """Time between samples, and whether they lie on that grid already."""
    longest = max(pieces, key=lambda piece: piece.stop - piece.start)
    t = time_s[longest]
    even = (t[-1] - t[0]) / max(len(t) - 1, 1) or usual
    off = np.abs(t - t[0] - even * np.arange(len(t))).max() / even
    step = resample_s or _tidy(even if off < CLOCK else usual, len(t))
    exact = all(_fits(time_s[piece], step) for piece in pieces)
    if exact or resample_s or len(t) < FEWEST:
        return step, exact
    slope = float(np.polyfit(np.arange(len(t)), t - t[0], 1)[0])  # less moved by rounding than ends
    only_rounded = all(_only_rounded(time_s[piece], slope) for piece in pieces)
    return (_tidy(slope, len(t)), True) if only_rounded else (step, False)


def _only_rounded(t: np.ndarray, step: float, ticks: np.ndarray | None = None) -> bool:
    """Whether an even clock was stamped with a coarser one: then the samples are even as they are.

    All stamps are multiples of a resolution, and within half of it of an even grid.
    """
    late = t - step * (np.arange(len(t)) if ticks is None else ticks)
    half = 0.5 * float(np.ptp(late))
    return half <= CLOCK * step and half <= (1.0 + ROUNDING) * 0.5 * _resolution(t)


def _resolution(t: np.ndarray) -> float:
    """The largest of 1, 2, 5 times a power of ten of which all stamps are multiples, else 0."""
    for size in (lead * 10.0**power for power in range(0, -10, -1) for lead in (5.0, 2.0, 1.0)):
        if np.abs(t / size - np.round(t / size)).max() < 1e-4:
            return size
    return 0.0


def _fits(t: np.ndarray, step: float, ticks: np.ndarray | None = None) -> bool:
    at = np.arange(len(t)) if ticks is None else ticks
    return bool(np.abs(t - t[0] - step * at).max() < EXACT * step)


def _tidy(step: float, n: int) -> float:
    """The step with few digits, where that moves no sample by a noticeable part of a step."""
    for digits in (1, 2, 3, 4, 6, 9):
        short = float(f"{step:.{digits}g}")
        if abs(short - step) * n < EXACT * step:
            return short
    return step


def _points(t: np.ndarray, step: float) -> np.ndarray:
    return t[0] + step * np.arange(int((t[-1] - t[0]) / step + EXACT) + 1)


def _placed(
    place: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray],
    grid: np.ndarray,
    time_s: np.ndarray,
    values: np.ndarray,
    step: float,
    filled: bool,
) -> np.ndarray:
    """Values on the grid: between samples in neighbouring rows, and within half a step of one.

    Where it is not to be ``filled``, only the latter.
    """
    there = np.isfinite(values)
    if (filled and there.all()) or not there.any():
        return place(grid, time_s, values)
    sampled_s = time_s[there]
    after = np.clip(np.searchsorted(sampled_s, grid), 1, max(len(sampled_s) - 1, 1))
    ends = sampled_s[[after - 1, np.minimum(after, len(sampled_s) - 1)]]
    near = np.abs(grid - ends).min(axis=0) <= 0.5 * step
    between = filled & np.isfinite(place(grid, time_s, values))
    return np.where(near | between, place(grid, sampled_s, values[there]), np.nan)


def _held(grid: np.ndarray, time_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    return values[np.clip(np.searchsorted(time_s, grid, side="right") - 1, 0, None)]


def missing_stretch(values: np.ndarray) -> tuple[int, int] | None:
    """First row and length of the first stretch of NaN, if there is one."""
    missing = ~np.isfinite(values)
    if not missing.any():
        return None
    first = int(missing.argmax())
    present = np.flatnonzero(~missing[first:])
    return first, int(present[0]) if len(present) else len(missing) - first
