"""Common ground of all tests: every plant in turn, and seeded conditions to ask it about."""

from dataclasses import replace
from math import isfinite
from typing import NamedTuple

import numpy as np
import pytest

from workbench.plants import PLANTS

PLANT_MODELS = {name: build() for name, build in PLANTS.items()}  # a model is built once


class Conditions(NamedTuple):
    """Columns x, u and d, one per condition, and the plant's parameters p."""

    x: np.ndarray
    u: np.ndarray
    d: np.ndarray
    p: np.ndarray


def pytest_collection_modifyitems(items):
    """The longest come first: two workers then end at about the same time."""
    items.sort(key=lambda item: item.path.name != "test_hidden_effects.py")


@pytest.fixture(params=PLANT_MODELS.values(), ids=PLANT_MODELS.keys())
def plant(request):
    """Every plant in turn."""
    return request.param


@pytest.fixture
def drive():
    """The servo drive without what is absent, standing at 30 mm."""
    return standing_at(PLANT_MODELS["servo_drive"].lean(), 0.030)


@pytest.fixture
def conditions():
    """Draw ``n`` conditions of a plant; ``spread`` counts in typical sizes of the states."""
    return drawn


def drawn(plant, n=50, spread=0.5, seed=7):
    rng = np.random.default_rng(seed)
    _, _, p = plant.nominal
    x = plant.initial[:, None] + plant.scale[:, None] * rng.uniform(-spread, spread, (_n(plant), n))
    u = np.array([_values(signal, rng, n) for signal in plant.commands]).reshape(-1, n)
    d = np.array([_values(signal, rng, n) for signal in plant.measured_inputs]).reshape(-1, n)
    return Conditions(x, u, d, p)


def _n(plant):
    return len(plant.scale)


def _values(signal, rng, n):
    """Values over the range of a signal, or around its nominal value where it has none."""
    if signal.levels:
        return rng.choice(signal.levels, n)
    if isfinite(signal.lower) and isfinite(signal.upper):
        return rng.uniform(signal.lower, signal.upper, n)
    size = 0.3 * abs(signal.nominal) or 0.1
    return signal.nominal + rng.uniform(-size, size, n)


def standing_at(plant, position_m):
    """The plant with its body, and the gas around it, at rest at a position."""
    parts = (
        replace(part, initial_position_m=position_m)
        if hasattr(part, "initial_position_m")
        else part
        for part in plant.parts
    )
    return replace(plant, parts=tuple(parts))


@pytest.fixture(scope="session")
def lq(tmp_path_factory):
    """A design file for the servo drive."""
    from controllers.design_file import design, write_design

    path = tmp_path_factory.mktemp("design") / "lq.toml"
    write_design(design("lq", PLANT_MODELS["servo_drive"]), path)
    return path
