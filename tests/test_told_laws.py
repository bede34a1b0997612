"""What is told of an empirical law is enough to use it: formula, sizes, range of its drivers."""

import numpy as np
import pytest
from test_law_terms import SINE, STROKE_M, asked_law, posed, wavy

from studies.text_of_law import law_document, law_text
from workbench.law_range import beyond, seen_in
from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.rig_laws import law_terms, quantities
from workbench.units import public_name


@pytest.fixture(scope="module")
def law():
    return asked_law(posed(wavy))


def test_a_law_can_be_evaluated_from_its_document(law):
    told = law_document(law)
    ((name, formula),) = told["formulas"].items()
    size = told["terms"][f"{SINE}.size"]["value"]
    middle, stroke = (formula["sizes"][f"{SINE}.{each}"]["value"] for each in ("middle", "stroke"))
    x = np.linspace(-0.03, 0.03, 50)

    assert (name, formula["formula"]) == (SINE, "F = a sin(2 pi x/L)")
    told_n = size * np.sin(2 * np.pi * (x - middle) / stroke)
    np.testing.assert_allclose(told_n, wavy(x, 0.0), atol=0.3)
    assert told["balances"] == ["rod.momentum"]


def test_a_law_says_in_words_what_its_factors_are_counted_in(law):
    (line,) = (each for each in law_text(law).splitlines() if each.startswith(f"{SINE}: "))

    assert line.startswith(f"{SINE}: F = a sin(2 pi x/L), x from ")
    assert line.endswith(f"in half of L = {1e3 * STROKE_M:.0f} mm")


@pytest.mark.parametrize("name", ["servo_drive", "soft_joint", "cylinder_bench"])
def test_a_term_depends_on_the_sizes_that_are_told_of_it_and_on_no_other(name):
    plant = PLANTS[name]()
    terms = law_terms(plant)
    lawful = plant.with_effects(*terms.values())
    rng = np.random.default_rng(8)
    x = plant.initial + plant.scale * rng.uniform(0.1, 0.5, len(plant.scale))
    u, d, _ = plant.nominal

    def acts(values):
        at = lawful.with_values(values).nominal[2]
        return np.vstack([part.full() for part in lawful.model.f(x, u + 1.0, d + 0.01, at)])

    for term in terms.values():
        strength = lawful.candidates[term.name].strength
        there = {strength: lawful.parameters[strength].typical}
        for form in ("speed_m_s", "middle_m", "stroke_m", "pressure_pa"):
            full = f"{term.name}.{form}"
            if full in lawful.values:
                other = there | {full: 1.3 * lawful.values[full] + 0.001}
                same = np.array_equal(acts(there), acts(other))
                assert same == (form not in term.counted_in), full


def moved(speed_m_s, command_v):
    """A drive that goes to and fro at up to a speed under a command."""
    time_s = 1e-3 * np.arange(2000)
    swing = np.sin(2 * np.pi * time_s)
    channels = {
        "slide.position_m": 0.15 + speed_m_s * (1 - np.cos(2 * np.pi * time_s)) / (2 * np.pi),
        "valve.command_v": 5.0 + command_v * swing,
        "chamber_a.pressure_pa": np.full(2000, 4e5),
        "chamber_b.pressure_pa": np.full(2000, 4e5),
    }
    return Recording("moved", 1e-3, channels)


@pytest.mark.parametrize(
    ("term", "driver", "further"),
    [
        ("law[u p]@chamber_a", "valve.command_v", moved(0.2, 4.0)),
        ("law[|v|]@chamber_b", "slide.velocity_m_s", moved(1.0, 1.0)),
        ("law[v p]@chamber_b", "slide.velocity_m_s", moved(1.0, 1.0)),
        ("law[v]@slide", "slide.velocity_m_s", moved(1.0, 1.0)),
    ],
)
def test_what_drives_a_law_has_a_range_and_leaving_it_is_told(term, driver, further):
    plant = PLANTS["servo_drive"]()
    lawful = plant.with_effects(law_terms(plant)[term])
    seen = seen_in(lawful, [moved(0.2, 1.0)])

    assert driver in seen and driver in quantities(lawful).values()
    assert beyond(lawful, seen, moved(0.2, 1.0)) == ()
    said = beyond(lawful, seen, further)
    assert any(each.startswith(f"{public_name(driver)} runs from") for each in said)


def test_a_command_that_drives_no_law_has_no_range():
    plant = PLANTS["servo_drive"]()
    lawful = plant.with_effects(law_terms(plant)["law[v]@slide"])

    assert "valve.command_v" not in seen_in(lawful, [moved(0.2, 1.0)])
