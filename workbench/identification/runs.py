"""Running a plant with some of its parameters as unknowns."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from workbench.plant import Plant
from workbench.recording import Recording
from workbench.simulation import inputs


def outputs_under(
    plant: Plant, recording: Recording, names: Sequence[str]
) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """(parameters, start state) -> outputs (n_y, n) of one piece under its recorded inputs.

    ``names`` are the parameters that the first argument holds; all others stay at the plant's.
    """
    u, d = inputs(plant, recording)
    n, model = len(recording), plant.model
    states = model.run(recording.sample_time_s, n - 1)
    seen = model.h.map(n)
    places = [model.parameters.index(name) for name in names]
    own = np.array(plant.nominal[2])

    def outputs(values: np.ndarray, start: np.ndarray) -> np.ndarray:
        p = own.copy()
        p[places] = values
        x = np.hstack([np.reshape(start, (-1, 1)), states(start, u[:, :-1], d[:, :-1], p).full()])
        return seen(x, u, d, p).full()

    return outputs
