"""The tight reference: scipy's Radau on model.f, restarted where a command changes."""

import numpy as np
from scipy.integrate import Radau

from workbench.units import suffix

ABSOLUTE = {
    "m": 1e-9,
    "m_s": 1e-7,
    "rad": 1e-9,
    "rad_s": 1e-7,
    "pa": 0.1,
    "kg": 1e-11,
    "a": 1e-7,
    "j": 1e-6,
}
BRISTLE_M = 1e-11


def reference(plant, command, sample_time_s, contact=False):
    """States at every sample, shape (n_x, n), for commands held between samples, (n,) or (n_u, n).

    rtol 1e-9, steps of at most 2 ms, and of 0.1 ms with ten times finer tolerances in ``contact``.
    """
    model, p = plant.model, plant.nominal[2]
    finer, longest_s = (0.1, 1e-4) if contact else (1.0, 2e-3)
    options = dict(rtol=1e-9, atol=finer * _tolerances(model), max_step=longest_s, first_step=1e-6)
    command = np.atleast_2d(command)
    states = np.empty((len(model.states), command.shape[1]))
    states[:, 0] = x = plant.initial
    for first, last in _constant_pieces(command):
        u = command[:, first]
        solver = Radau(
            lambda t, x, u=u: model.f(x, u, [], p)[0].full().ravel(),
            first * sample_time_s,
            x,
            last * sample_time_s,
            jac=lambda t, x, u=u: model.jacobians(x, u, [], p)[0].full(),
            **options,
        )
        x = _run(solver, states, first, last, sample_time_s)
    return states


def _run(solver, states, first, last, sample_time_s):
    """Fill the samples after ``first`` up to ``last``, and give the last state."""
    following = first + 1
    while solver.status == "running":
        message = solver.step()
        assert solver.status != "failed", message
        dense = solver.dense_output()
        while following < last and following * sample_time_s <= solver.t:
            states[:, following] = dense(following * sample_time_s)
            following += 1
    states[:, last] = solver.y
    return solver.y


def _tolerances(model):
    bristle = "deflection_m"
    return np.array(
        [BRISTLE_M if n.endswith(bristle) else ABSOLUTE[suffix(n)] for n in model.states]
    )


def _constant_pieces(command):
    """First and last sample of each stretch over which the command is held."""
    changes = np.diff(command[:, :-1]).any(axis=0)
    ends = [*(np.flatnonzero(changes) + 1), command.shape[1] - 1]
    return zip([0, *ends[:-1]], ends, strict=True)
