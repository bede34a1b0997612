"""A design file that is wrong: one message for each thing, with its line and what was expected."""

import pytest
from commands import call

from controllers.design_file import design, parse_design, write_design
from workbench.errors import InputError
from workbench.plants.servo_drive import servo_drive


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A rig and a design for it."""
    folder = tmp_path_factory.mktemp("designs")
    (folder / "rig.toml").write_text('plant = "servo_drive"\n')
    plant = servo_drive().without("end_cushion").with_values({"slide.mass_kg": 2.4})
    write_design(design("lq", plant), folder / "lq.toml")
    return folder


def refused(place, content):
    """What `check` says of a design file of this content."""
    path = place / "wrong.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    answer = call("check", place / "rig.toml", path, "-q")

    assert answer.exit_code == 2, answer.output
    return answer.stderr


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[spec]", "[spek]", "spek: a design file has no such name; expected one of controller, "
         "plant, spec; did you mean 'spec'?"),
        ("removed = ['end_cushion']", "removed = 3",
         "removed: 3 is of the wrong type; expected a list of names"),
        ("removed = ['end_cushion']", "removed = ['end_cusion']",
         "end_cusion: servo_drive has no such name; expected one of"),
        ("removed", "remuved", "remuved: [plant] has no such name"),
        ('controller = "lq"', 'controller = ["lq"]',
         "controller: ['lq'] is of the wrong type; expected the name of a controller"),
        ('controller = "lq"', 'controller = "lqg"', "no controller lqg; there is pid, lq"),
        ('name = "servo_drive"', 'name = "servo_drve"', "did you mean 'servo_drive'?"),
        ("= 2.4", '= "heavy"',
         "slide.mass_kg: is 'heavy'; expected a number from 0.001, in kg"),
        ("= 2.4", "= nan", "slide.mass_kg: is nan; expected a number from 0.001, in kg"),
        ("slide.mass_kg", "slide.mas_kg", "did you mean 'slide.mass_kg'?"),
        ("position_m = 0.0015", 'position_m = "far"',
         "lq.position_m: is 'far'; expected a number from 1e-06"),
        ("band_m", "bnd_m", "did you mean 'band_m'?"),
        ("sample_time_s = 0.002", "sample_time_s = 0.0015",
         "sample_time_s: is 0.0015; expected a multiple of the 0.001 s"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_a_design_file_is_named_with_its_line(place, old, new, said):
    good = (place / "lq.toml").read_text()
    number = next(k for k, line in enumerate(good.splitlines(), 1) if old in line)
    lines = refused(place, good.replace(old, new, 1)).removeprefix("workbench: ").splitlines()
    first = next(line for line in lines if said in line)

    assert first.startswith(f"{place / 'wrong.toml'}:{number}: ")


WHOLE = """\
controller = "{method}"
[plant]
name = "{plant}"
removed = []
{more}
[plant.values]
{values}
[spec]
{numbers}
"""


@pytest.mark.parametrize(
    ("method", "plant", "wrong", "number", "said"),
    [
        ("hybrid-mpc", "gearbox", {"numbers": "hold_s = 0.018\nhorizon = 16"}, 9,
         "hybrid-mpc.hold_s: is 0.018, 18 of 16 samples ahead; expected a pulse that ends within"),
        ("hybrid-mpc", "gearbox", {"numbers": "hold_s = 0.019\njudged = 400"}, 10,
         "hybrid-mpc.judged: is 400; expected < "),
        ("per-mode", "servo_drive", {"numbers": '[spec.modes]\n"charge a slide" = "pid"'}, 10,
         "per-mode.modes.charge a slide: the modes in which the valve drives the motion have no"),
        ("per-mode", "servo_drive", {"numbers": '[spec.modes]\na = ["x"]'}, 10,
         "per-mode.modes.a: is ['x']; expected lq, pid, cascade"),
        ("lq", "servo_drive", {"values": '"supply.pressure_pa" = 1.1e5'}, 7,
         "supply.pressure: 1.1 bar is too low to move: "),
        ("mpc", "servo_drive", {"numbers": "margin_m = 3.0"}, 8,
         "mpc: margin_m 3, lowest_m 0, below_end_m 0 leave no room"),
        ("nonlinear-mpc", "servo_drive", {"numbers": "margin_m = 3.0"}, 8,
         "nonlinear-mpc: margin_m 3, lowest_m 0, below_end_m 0 leave no room"),
        ("lq", "servo_drive", {"more": 'laws = ["law[v|w|]@slide"]'}, 5,
         "law[v|w|]@slide: servo_drive has no such name; expected one of law["),
    ],
)  # fmt: skip
def test_what_the_plant_and_the_method_refuse_is_named_with_its_line(
    tmp_path, method, plant, wrong, number, said
):
    parts = dict.fromkeys(("more", "values", "numbers"), "") | wrong
    path = tmp_path / "design.toml"
    with pytest.raises(InputError) as refusal:
        parse_design(WHOLE.format(method=method, plant=plant, **parts), path)

    assert str(refusal.value).startswith(f"{path}:{number}: {said}")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ('controller = "lq"\n[plant]\n[spec]\n',
         "wrong.toml:2: name: is missing; expected the name of a plant"),
        (b"\xff\xfe\x00\x01", "wrong.toml: cannot be read: 'utf-8' codec can't decode"),
        ("controller = ", "wrong.toml:1: Invalid value (at end of document); exp"),
        ('controller = "lq"\n', "wrong.toml: spec: is missing; expected a table of the contr"),
        ("plant = 3\n", "wrong.toml:1: plant: 3 is of the wrong type; expected a table with"),
    ],
)  # fmt: skip
def test_what_is_no_design_file_at_all_is_named(place, content, said):
    assert said in refused(place, content)
