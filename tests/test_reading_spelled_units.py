"""Units as loggers spell them: gauge and absolute pressures, and words that are no unit."""

import pytest
from recording_files import RIG, read, refused, table, text

from workbench.fitting.unknowns import nominal_unknowns
from workbench.reading.table import RecordingWarning
from workbench.reading.text_table import BRACKETED
from workbench.rig import AMBIENT, load_rig
from workbench.spelled_units import is_gauge
from workbench.units import STANDARD_ATMOSPHERE_PA, UnitError, quantity, scale

ATMOSPHERE = STANDARD_ATMOSPHERE_PA
RIGS_AMBIENT = 1e5


def with_units(pressure: str, time: str = "s") -> str:
    """A recording whose second row tells units."""
    head, *rows = text(table()).splitlines()
    return "\n".join([head, f"{time},V,{pressure},mm", *rows])


def rigged(unit: str) -> str:
    return RIG.replace('unit = "bar"', f'unit = "{unit}"')


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        *((each, 1e5) for each in ("barg", "bar(g)", "bar (g)", "bar g", "bar_gauge", "BARG")),
        *((each, 6894.757293) for each in ("psig", "psi(g)", "PSIG")),
        *((each, 1e3) for each in ("kPag", "kPa(g)")),
        *((each, 1e6) for each in ("MPag", "MPa(g)")),
        ("mbarg", 1e2),
    ],
)
def test_a_gauge_pressure_may_be_spelled_as_on_the_gauge(unit, factor):
    assert quantity(f"2 {unit}", "a.pressure_pa") == pytest.approx(2 * factor + ATMOSPHERE)
    assert is_gauge(unit)


@pytest.mark.parametrize(("unit", "same"), [("bara", "bar"), ("bar(a)", "bar"), ("psia", "psi")])
def test_an_absolute_pressure_may_say_so(unit, same):
    assert scale(unit, "a.pressure_pa") == scale(same, "a.pressure_pa")
    assert not is_gauge(unit)


def test_a_milli_or_mega_pascal_in_lower_case_is_not_guessed():
    with pytest.raises(UnitError, match="unit 'mpag' is unknown"):
        scale("mpag", "a.pressure_pa")


@pytest.mark.parametrize("told", ["barg", "bar(g)", "[bar(g)]", "(barg)", "[barg]", "bar_gauge"])
def test_a_file_that_says_gauge_contradicts_a_rig_that_says_absolute(tmp_path, told):
    """It was read as absolute without a word, one bar too low."""
    said = refused(tmp_path, with_units(told))

    assert "chamber_a.pressure: the file says bar" in said and "the rig bar; expected" in said


def test_a_file_that_says_absolute_contradicts_a_rig_that_says_gauge(tmp_path):
    said = refused(tmp_path, with_units("bara"), rig=rigged("bar_gauge"))

    assert "the file says bara, the rig bar_gauge; expected unit = 'bara'" in said


@pytest.mark.parametrize(
    ("told", "unit", "offset"),
    [
        ("barg", "bar_gauge", RIGS_AMBIENT),
        ("bar(g)", "barg", RIGS_AMBIENT),
        ("bar", "bar(g)", RIGS_AMBIENT),
        ("bara", "bar", 0.0),
        ("bar", "bara", 0.0),
    ],
)
@pytest.mark.filterwarnings("error")
def test_the_same_unit_in_two_spellings_is_one(tmp_path, told, unit, offset):
    found = read(tmp_path, with_units(told), rig=rigged(unit))

    rows = table()
    assert found["chamber_a.pressure_pa"] == pytest.approx(1e5 * rows[:, 2] + offset, rel=1e-6)


@pytest.mark.parametrize("told", ["Pfund", "mm"])
def test_a_word_that_is_no_such_unit_is_warned_of(tmp_path, told):
    with pytest.warns(RecordingWarning, match=rf"chamber_a\.pressure: the file's unit '{told}' .*"):
        found = read(tmp_path, with_units(told))

    assert found["chamber_a.pressure_pa"].mean() == pytest.approx(5e5, rel=0.2)


@pytest.mark.parametrize("told", ["", "-", "--"])
@pytest.mark.filterwarnings("error")
def test_no_unit_is_no_wonder(tmp_path, told):
    assert len(read(tmp_path, with_units(told))) == len(table())


@pytest.mark.parametrize("word", ["kg/(s Pa)", "[kg/(s Pa)]", "(kg/(s Pa))"])
def test_brackets_of_a_unit_of_its_own_stay(word):
    """The last one was cut off, and the unit not understood."""
    assert BRACKETED.sub(r"\1", word) == "kg/(s Pa)"


@pytest.mark.parametrize(("unit", "moved"), [("bar", True), ("bar_gauge", False), ("psig", False)])
def test_a_fit_does_not_move_the_pressure_that_gauges_count_from(tmp_path, unit, moved):
    """The fitted rig would read the same file otherwise than the fit did."""
    path = tmp_path / "rig.toml"
    path.write_text(rigged(unit))
    rig = load_rig(path)

    assert (AMBIENT not in rig.held) is moved
    assert (AMBIENT in nominal_unknowns(rig.plant, rig.deviations, rig.held).names) is moved
    assert rig.standard_deviation(AMBIENT) > 0.0
