"""A rig file that is written over the one that is read: a word, and the values it names stay."""

from dataclasses import replace

import pytest
from commands import call
from test_diagnosis import AMBIENT_PA, bench, nothing

from workbench.reading.writer import write_recording
from workbench.rig import default_rig, load_rig
from workbench.rig_writing import rig_text, write_rig

RIG = """# the old bench by the window
name = "bench"
plant = "cylinder_bench"

[values]
"friction.viscous" = "{viscous}"
"chamber.area" = "518.7 mm^2"
"""


@pytest.fixture
def rig_file(tmp_path):
    """A rig that names a value which is the plant's own."""
    own = default_rig("cylinder_bench").plant.values["friction.viscous_n_s_m"]
    path = tmp_path / "rig.toml"
    path.write_text(RIG.format(viscous=f"{own!r} N s/m"))
    return path


def test_a_value_that_the_file_names_stays_though_it_is_the_plants_own(rig_file):
    rig = load_rig(rig_file)
    write_rig(replace(rig, notes=("one",)), rig_file)

    assert '"friction.viscous" = ' in rig_file.read_text()
    assert '"friction.viscous" = ' in rig_text(load_rig(rig_file))
    assert "chamber.dead_volume" not in rig_text(rig)
    assert load_rig(rig_file).plant.values == rig.plant.values


@pytest.mark.parametrize("now", [None, "no TOML [", '[values]\n"nobody" = "1"\n', "values = 3\n"])
def test_a_file_that_is_gone_or_another_one_now_keeps_nothing_and_stops_nothing(rig_file, now):
    rig = load_rig(rig_file)
    rig_file.unlink() if now is None else rig_file.write_text(now)

    assert load_rig(rig_text(rig)).plant.values == rig.plant.values
    assert "friction.viscous" not in rig_text(rig)


def test_whoever_writes_over_the_rig_that_is_read_is_told(rig_file, tmp_path):
    train, other = tmp_path / "train.csv", tmp_path / "other.toml"
    write_recording(replace(bench(1, nothing), noise={}), train, ambient_pa=AMBIENT_PA)
    words = ("fit", rig_file, train, "-q", "-o")
    said = [call(*words, out) for out in (other, rig_file)]

    assert [answer.exit_code for answer in said] == [0, 0]
    assert "is a rig file that is read" not in said[0].stderr
    (line,) = (line for line in said[1].stderr.splitlines() if "comments" in line)
    assert line.startswith(f"warning: {rig_file}: is a rig file that is read")
