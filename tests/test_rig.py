"""The rig file: what it means, what it refuses, and that what is written reads back the same."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.diagnosis.absent import require_place
from workbench.errors import InputError
from workbench.plants import PLANTS
from workbench.recording import Recording
from workbench.recording_format import channel_names
from workbench.rig import Rig, default_rig, load_rig
from workbench.rig_writing import rig_text, write_rig

TEXT = """name  = "drive 7"
plant = "servo_drive"

[effects]
remove = ["stiction"]
add    = ["chamber_leak@chamber_a"]

[values]
"slide.mass"                 = "2.3 kg"
"supply.pressure"            = "6 bar_gauge"
"chamber_leak@chamber_a.area" = "0.05 mm^2"
"coulomb_friction.coulomb_force" = "31 N"

[uncertainty]
"slide.mass" = "1 %"

[fixed]
names = ["supply.temperature"]

[recording]
time = { column = "time_s", unit = "s" }
[recording.channels]
"valve.command"      = { column = "command_V",      unit = "V" }
"chamber_a.pressure" = { column = "pressure_a_bar", unit = "bar", noise = "400 Pa" }
"slide.position"     = { column = 3,                unit = "mm" }
"supply.pressure"    = { column = "supply_bar",     unit = "bar" }
"""
PARAMETERS = PLANTS["servo_drive"]().parameters
ENDS = ("lower", "upper", "stroke")
STROKE = {f"{name}.{end}_m" for name in ("stops", "chamber_a", "chamber_b") for end in ENDS}
CAUSES = [*PLANTS["servo_drive"]().candidates]


def messages(text: str) -> str:
    """What a rig file with this text is refused with."""
    with pytest.raises(InputError) as refused:
        load_rig(text)
    return str(refused.value)


def test_a_rig_file_gives_the_plant_as_somebody_has_it():
    rig = load_rig(TEXT)
    values = rig.plant.values

    assert rig.name == "drive 7"
    assert (rig.added, rig.removed) == (("chamber_leak@chamber_a",), ("stiction",))
    assert values["slide.mass_kg"] == 2.3
    assert values["supply.pressure_pa"] == 7e5  # the drive's ambient pressure is 1 bar
    assert values["chamber_leak@chamber_a.area_m2"] == 5e-8
    assert values["friction.coulomb_force_n"] == 31.0
    assert values["friction.stiction_excess_n"] == 0.0
    assert rig.standard_deviation("slide.mass_kg") == pytest.approx(0.023)
    assert rig.standard_deviation("supply.pressure_pa") == pytest.approx(1.4e4)
    assert rig.fixed == {"supply.temperature_k"}
    assert rig.reader.channels["chamber_a.pressure_pa"].noise == 400.0
    assert rig.reader.channels["supply.pressure_pa"].optional


def test_a_name_without_place_means_all_places():
    rig = load_rig('plant = "servo_drive"\n[effects]\nadd = ["chamber_leak"]\n')

    assert rig.added == ("chamber_leak@chamber_a", "chamber_leak@chamber_b")


def test_dotted_names_need_no_quotes():
    assert load_rig('plant = "servo_drive"\n[values]\nslide.mass = "3 kg"\n').plant.values[
        "slide.mass_kg"
    ] == 3.0  # fmt: skip


def test_a_default_rig_is_the_plant_itself():
    assert default_rig("servo_drive").plant == PLANTS["servo_drive"]()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('colour = "red"', "rig:2: colour: a rig file has no such name"),
        ('[effects]\nadd = ["chamber_leek"]', "rig:3: chamber_leek: there is no such effect"),
        ('[effects]\nadd = ["chamber_leek"]', "did you mean 'chamber_leak'?"),
        ('[effects]\nadd = ["snap@x"]', "there is no such effect"),
        ('[effects]\nadd = ["stiction"]\nremove = ["stiction"]', "rig:4: stiction: is named twice"),
        ('[values]\n"slide.mas" = "2 kg"', "did you mean 'slide.mass'?"),
        ('[values]\n"slide.mass" = "2 s"', "rig:3: slide.mass: unit 's' does not fit; expected kg"),
        ('[values]\n"slide.mass" = "2 kgg"', "unit 'kgg' is unknown; did you mean 'kg'?"),
        ('[values]\n"slide.mass" = 2.2', "has no unit"),
        ('[values]\n"slide.mass" = "-1 kg"', "-1 kg is out of bounds; expected at least 0.001 kg"),
        ('[values]\n"friction.presliding_share" = "2"', "2 is out of bounds; expected 0 to 1"),
        (
            '[values]\n"slide.mass" = "1 kg"\n"slide.mass" = "1 kg"',
            "rig:4: slide.mass: stands here a second time",
        ),
        (
            '[values]\nfriction.viscous = "1 N s/m"\n"viscous_friction.viscous" = "1 N s/m"',
            "rig:4: viscous_friction.viscous: is named twice",
        ),
        (
            '[effects]\nremove = ["stiction"]\n[values]\n"stiction.stiction_excess" = "5 N"',
            "[effects] removes stiction",
        ),
        ('[uncertainty]\n"slide.mass" = "5 bar"', "unit 'bar' does not fit; expected kg"),
        ('[uncertainty]\n"slide.mass" = "-5 %"', "no standard deviation"),
        ('[fixed]\nnames = ["supply.temprature"]', "did you mean 'supply.temperature'?"),
        ("[fixed]\nname = []", "did you mean 'names'?"),
        ('[recording]\ngaps = "cut"', "gaps: 'cut' is unknown; expected refuse or split"),
        ('[recording]\nskip = "2"', "skip: '2' is of the wrong type; expected a number of rows"),
        ('[recording]\nresample = "1 mm"', "unit 'mm' does not fit; expected s"),
        (
            '[recording.channels]\n"slide.pos" = { column = 1, unit = "m" }',
            "did you mean 'slide.position'?",
        ),
        ('[recording.channels]\n"slide.position" = { column = 1 }', "has no unit"),
        (
            '[recording.channels]\n"slide.position" = { column = 1, unit = "bar" }',
            "unit 'bar' does not fit; expected mm or m",
        ),
        (
            '[recording.channels]\n"slide.position" = { column = 0, unit = "m" }',
            "column 0 is neither",
        ),
        (
            '[recording.channels]\n"slide.position" = { column = 1, unit = "m" }',
            "servo_drive also needs valve.command",
        ),
        (
            "[recording.channels]\n"
            '"valve.command" = { column = "u", unit = "V" }\n'
            '"chamber_a.pressure" = { column = "p", unit = "bar" }\n'
            '"chamber_b.pressure" = { column = "p", unit = "bar" }',
            'rig:5: chamber_b.pressure: column "p" is that of chamber_a.pressure already; expected '
            "a column of its own",
        ),
        (
            '[recording]\ntime = { column = 1, unit = "s" }\n'
            '[recording.channels]\n"valve.command" = { column = 1, unit = "V" }',
            "rig:5: valve.command: column 1 is that of time already",
        ),
        ("[values", "rig:2: "),
    ],
)
def test_what_is_wrong_is_said_with_its_line_and_what_was_expected(line, message):
    assert message in messages(f'plant = "servo_drive"\n{line}\n')


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('plant = "servo_drve"\n', "there is no such plant; expected one of servo_drive"),
        ('plant = "servo_drve"\n', "did you mean 'servo_drive'?"),
        ('name = "x"\n', "a rig file names its plant"),
    ],
)
def test_a_rig_needs_a_plant_that_there_is(text, message):
    assert message in messages(text)


def test_all_that_is_wrong_is_said_at_once_in_the_order_of_the_lines():
    text = TEXT.replace("2.3 kg", "2.3 s").replace('"stiction"', '"sticktion"').replace("1 %", "x")

    said = messages(text).splitlines()

    assert [line.split(":")[1] for line in said] == ["5", "9", "15"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[recording]\n", "[recording]\nskip = -3\n", "21: skip: -3 rows cannot be skipped"),
        ('unit = "s" }', 'step = "1 ms" }', "does not go with step; expected a column of times or"),
    ],
)
def test_what_cannot_be_meant_is_refused_and_not_altered(old, new, said):
    assert said in messages(TEXT.replace(old, new, 1)).replace("rig:", "")


def test_a_missing_file_names_one_that_looks_like_it(tmp_path):
    (tmp_path / "drive7.toml").write_text(TEXT)

    with pytest.raises(InputError, match=r"no such file; did you mean 'drive7\.toml'"):
        load_rig(tmp_path / "drive8.toml")


def test_a_written_rig_reads_back_the_same(tmp_path):
    rig = replace(load_rig(TEXT), notes=("chamber_leak@chamber_a: validation error down 91 %",))

    write_rig(rig, tmp_path / "out.toml")

    assert load_rig(tmp_path / "out.toml") == replace(rig, path=tmp_path / "out.toml")
    assert [p.name for p in tmp_path.iterdir()] == ["out.toml"]


@pytest.mark.parametrize("word", ["true", "false"])
@pytest.mark.parametrize("channel", ["supply.pressure", "slide.position"])
def test_whether_a_channel_is_optional_survives_writing(channel, word):
    head, section, channels = TEXT.partition("[recording.channels]\n")
    told = f", optional = {word} }}"
    rows = [row.replace(" }", told) if channel in row else row for row in channels.splitlines()]
    rig = load_rig(head + section + "\n".join(rows))

    assert word == str(rig.reader.channels[channel_names(rig.plant)[channel]].optional).lower()
    assert load_rig(rig_text(rig)).reader == rig.reader


@st.composite
def rigs(draw) -> Rig:
    """Drives with any values within the bounds, and any causes added or removed.

    The ends of the stroke stay: drawn each by itself they contradict each other.
    """
    plant = PLANTS["servo_drive"]()
    causes = draw(st.permutations(CAUSES))
    n, m = draw(st.integers(0, 4)), draw(st.integers(0, 4))
    added, removed = tuple(causes[:n]), tuple(causes[n : n + m])
    absent = {plant.candidates[name].strength for name in removed}
    free = sorted(PARAMETERS.keys() - absent - STROKE)
    chosen = draw(st.sets(st.sampled_from(free), max_size=8))
    values = {
        name: draw(st.floats(PARAMETERS[name].lower, min(PARAMETERS[name].upper, 1e12)))
        for name in sorted(chosen)
    }
    known = draw(st.sets(st.sampled_from(sorted(PARAMETERS.keys() - absent)), max_size=4))
    plant = plant.at_null(*(plant.candidates[name] for name in removed)).with_values(values)
    return replace(
        default_rig("servo_drive"),
        name=draw(st.text(st.characters(codec="utf-8", exclude_categories=["Cc"]), min_size=1)),
        plant=plant,
        added=added,
        removed=removed,
        deviations={name: draw(st.floats(0, 1e9)) for name in sorted(known)},
        fixed=frozenset(draw(st.sets(st.sampled_from(sorted(PARAMETERS)), max_size=3))),
    )


@given(rig=rigs())
@settings(max_examples=40, deadline=None)
def test_any_rig_survives_writing_and_reading_to_the_last_bit(rig):
    again = load_rig(rig_text(rig))

    assert again == replace(rig, path=None)


def recording(*channels: str) -> Recording:
    return Recording("short", 1e-3, {name: np.linspace(1.0, 2.0, 100) for name in channels})


def test_the_plant_takes_the_inputs_and_outputs_that_a_recording_carries():
    rig = default_rig("servo_drive")
    plant = rig.fit_for(recording("valve.command_v", "supply.pressure_pa", "slide.position_m"))

    assert plant.measured == ("slide.position_m",)
    assert [signal.name for signal in plant.measured_inputs] == ["supply.pressure_pa"]
    assert "supply_droop" not in plant.candidates
    assert plant is rig.fit_for(
        recording("valve.command_v", "supply.pressure_pa", "slide.position_m")
    )


def test_an_effect_whose_product_is_recorded_is_refused_with_the_reason():
    rig = default_rig("servo_drive")
    plant = rig.fit_for(recording("valve.command_v", "supply.pressure_pa", "slide.position_m"))

    with pytest.raises(InputError) as refused:
        require_place(rig, plant, ["supply_droop"])
    assert str(refused.value) == (
        "supply_droop: is not applicable: supply.pressure is measured; expected recordings without "
        "that channel; take it out of [recording.channels]"
    )
    require_place(rig, rig.plant, ["supply_droop"])
    with pytest.raises(InputError, match="did you mean valve_lag"):
        require_place(rig, plant, ["valve_lagg"])


@pytest.mark.parametrize(
    ("channels", "message"),
    [
        (["valve.command_v"], "carries no output; expected one of slide.position"),
        (["slide.position_m"], "servo_drive needs valve.command"),
    ],
)
def test_a_recording_without_command_or_output_is_refused(channels, message):
    with pytest.raises(InputError, match=message):
        default_rig("servo_drive").fit_for(recording(*channels))
