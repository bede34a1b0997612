"""What is said of a missing term: what it depends on, its loops, and how its walk was sized."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

LOOP = 0.02  # of the variance: two branches no further apart are one
LOOP_OF_REST = 0.2  # of what the variable leaves: by chance, a slow term comes to a quarter of that


@dataclass(frozen=True)
class Loop:
    """The missing term against one variable, on the ways of another signal up and down.

    ``adds`` is the share of its variance that knowing the way explains beyond the variable;
    ``branches`` hold centres and means on the way up and down, shape (2, 2, n_bins), in SI.
    """

    by: str
    adds: float
    branches: np.ndarray = field(repr=False)


@dataclass(frozen=True)
class Dependence:
    """The missing term of a balance against one variable, without what parameters explain of it.

    ``explains`` is the correlation ratio; ``bins`` holds centres, means and standard deviations,
    shape (3, n_bins), in SI; ``neighbour`` the means at the other intensity, shape (n_bins,).
    """

    variable: str
    explains: float
    bins: np.ndarray
    neighbour: np.ndarray | None = None
    loops: tuple[Loop, ...] = ()

    @property
    def memory(self) -> Loop | None:
        """The widest loop, None where the branches are as good as one."""
        widest = max(self.loops, key=lambda each: each.adds, default=None)
        least = max(LOOP, LOOP_OF_REST * (1.0 - self.explains))
        return widest if widest and widest.adds > least else None


@dataclass(frozen=True)
class Intensities:
    """Sizes of the random walk of a missing term per square root of a second, in its unit.

    ``likeliest`` shaped the term; at ``neighbour`` it came out as ``term``, shape (n,): the
    difference between the two shows how far the walk smears or follows noise.
    """

    likeliest: float
    neighbour: float
    term: np.ndarray = field(repr=False)


@dataclass(frozen=True)
class Course:
    """What the smoother ran through while it sought a missing flow.

    state       in whose rate the flow shows
    flow        the parameter of the plant with missing flows that is this one
    states, commands, measured
                smoothed states and the inputs at each sample, n columns each, in SI
    """

    state: str
    flow: str
    states: np.ndarray = field(repr=False)
    commands: np.ndarray = field(repr=False)
    measured: np.ndarray = field(repr=False)

    def part(self, kept: np.ndarray) -> Course:
        """Some of the samples, (n,) of truths."""
        rows = (self.states, self.commands, self.measured)
        states, commands, measured = (each[:, kept] for each in rows)
        return replace(self, states=states, commands=commands, measured=measured)
