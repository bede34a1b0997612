"""One state of a composed cylinder plant against its flat oracle."""

import numpy as np


def assert_same_as_flat(plant, names, x, u, flat_rates, size):
    """Rates agree to 1e-10 in units of ``size``; position and both pressures are the outputs.

    ``names`` are the oracle's states in the order of ``x``; states that it lacks are at zero.
    """
    known = dict(zip(names, x, strict=True))
    state = [known.get(name, 0.0) for name in plant.model.states]
    rates, outputs = plant.model.f(state, [u], [], plant.nominal[2])
    rate = dict(zip(plant.model.states, rates.full().ravel(), strict=True))
    ours = np.array([rate[name] for name in names])

    np.testing.assert_allclose(ours / size, flat_rates / size, 1e-10, 1e-10)
    np.testing.assert_array_equal(outputs.full().ravel(), x[[0, 2, 4]])
