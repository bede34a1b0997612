"""What a user's own plant is seen to do once it is loaded: each mistake in one message."""

import pytest
from commands import call
from test_own_plant import example

from workbench.errors import InputError
from workbench.plant_files import plant_named
from workbench.rig import load_rig

TERM = 'yield Force("slide", self.amplitude_n * ca.sin(angle))'
IMPORT = "from workbench.effect import Balance, Cause, Effect, Force, form, strength"
AMONG = '            Cogging(name="cogging"),\n'
STRENGTH = "strength(typical=10.0, lower=-100.0, upper=100.0)"
ANGLE = "    def terms(self, now):\n        angle"
ALTER = """    def alter(self, signal, value, now):
        return value + 0.5 if signal == "motor.force_n" else value

"""
SIGNAL = '    signal: str = "motr.force_n"\n\n'
LAG = """    def states(self):
        yield State("lag_m", 0.0, 1.0)

    def rates(self, now, received):
        return {"lagg_m": now["slide"].velocity_m_s}

"""


def said(folder, *changes):
    """What is said of the README's plant with these changes: all in one message."""
    text = example()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "mine.py").write_text(text)
    with pytest.raises(InputError) as caught:
        plant_named("mine.py:joint", folder)
    (message,) = caught.value.messages
    assert message.name == "mine.py:joint"
    return str(message)


CASES = {
    "a force on nobody": (
        [(TERM, TERM.replace('"slide"', '"slider"'))],
        "cogging puts a Force into slider, which is not there; expected one of slide; "
        "did you mean 'slide'?",
    ),
    "gas into a body": (
        [(TERM, TERM.replace("Force", "MassFlow").replace("))", "), 293.0)")),
         (IMPORT, IMPORT.replace("Force", "Force, MassFlow"))],
        "cogging puts a MassFlow into slide, which takes no MassFlow; expected another kind of "
        "flow: nothing here takes a MassFlow",
    ),
    "a force on a command": (
        [(TERM, TERM.replace('"slide"', '"motor"'))],
        "cogging puts a Force into motor, which takes no Force; expected one of slide",
    ),
    "a delay of no signal": (
        [(AMONG, AMONG + '            CommandDelay(name="late", signal="motor.force"),\n'),
         ("import StribeckFriction", "import CommandDelay, StribeckFriction")],
        "late acts on motor.force, which is no signal of the plant; expected one of "
        "motor.force_n, slide.position_m; did you mean 'motor.force_n'?",
    ),
    "a sensor of no signal": (
        [(AMONG, AMONG + '            *sensor_flaws({"slide.positon_m": 0.2}),\n'),
         (IMPORT, IMPORT + "\nfrom workbench.effects.sensors import sensor_flaws")],
        "slide has no positon_m, asked by sensor_lag@slide.positon; it has position_m, "
        "velocity_m_s, moving_mass_kg; did you mean 'position_m'?",
    ),
    "math in place of casadi": (
        [(TERM, TERM.replace("ca.sin", "math.sin")),
         ("import casadi", "import math\n\nimport casadi")],
        "cogging: its Force on slide is nan at the start; expected a finite number (is there a "
        "math.sin where a ca.sin belongs?)",
    ),
    "infinite at its typical size": (
        [(TERM, TERM.replace("ca.sin(angle)", "(1.0 + 1.0 / (self.amplitude_n - 10.0))"))],
        "cogging: its Force on slide is inf at the start with cogging.amplitude_n at its typical "
        "10; expected a finite number",
    ),
    "there at null": (
        [(TERM, TERM.replace("ca.sin(angle)", "ca.sin(angle) + 3.0"))],
        "cogging puts a Force of 3 N into slide with all its strengths at null; expected exactly "
        "nothing, or a property absent that says False",
    ),
    "a signal moved at null": (
        [(ANGLE, ALTER + ANGLE)],
        "cogging moves motor.force_n by 0.5 with all its strengths at null; expected exactly "
        "nothing, or a property absent that says False",
    ),
    "an alter of no signal": (
        [(ANGLE, SIGNAL + ALTER.replace('"motor.force_n"', "self.signal") + ANGLE)],
        "cogging acts on motr.force_n, which is no signal of the plant; expected one of "
        "motor.force_n, slide.position_m, slide.moving_mass_kg; did you mean 'motor.force_n'?",
    ),
    "a strength that is no field": (
        [('strength="amplitude_n"', 'strength="amplitude"')],
        "Cogging, cause cogging: its strength is 'amplitude', and there is no such field; "
        "expected a field made by strength(): amplitude_n; did you mean 'amplitude_n'?",
    ),
    "a strength that is a plain field": (
        [(STRENGTH, "0.0")],
        "Cogging, cause cogging: its strength is 'amplitude_n', a plain field; expected a field "
        "made by strength()",
    ),
    "a strength that is a form": (
        [(STRENGTH, STRENGTH.replace("strength(typical=", "form("))],
        "Cogging, cause cogging: its strength is 'amplitude_n', made by form(); expected a field "
        "made by strength()",
    ),
    "a form that is no field": (
        [('strength="amplitude_n"', 'strength="amplitude_n", forms=("pich_m",)')],
        "Cogging, cause cogging: its form is 'pich_m', and there is no such field; expected a "
        "field made by strength() or form(): amplitude_n, pitch_m; did you mean 'pitch_m'?",
    ),
    "a typical size of nothing": (
        [("typical=10.0", "typical=0.0")],
        "Cogging.amplitude_n: typical is 0, which is its null; expected a size worth trying",
    ),
    "a typical size out of bounds": (
        [("typical=10.0", "typical=200.0")],
        "Cogging.amplitude_n: typical is 200, outside [-100, 100]",
    ),
    "a balance as text": (
        [("Balance.MOMENTUM", '"momentum"')],
        "Cogging, cause cogging: its balance is 'momentum'; expected one of Balance.VALVE, "
        "Balance.FLOW, Balance.MASS, Balance.ENERGY, Balance.MOMENTUM, Balance.SUPPLY, "
        "Balance.SENSOR, Balance.TIMING; did you mean 'Balance.MOMENTUM'?",
    ),
    "a balance that is none": (
        [("Balance.MOMENTUM", "Balance.MOMETUM")],
        "AttributeError: MOMETUM, in line 25 of mine.py; did you mean 'MOMENTUM'?",
    ),
    "drivers without a comma": (
        [('("position",)', '("position")')],
        "Cogging, cause cogging: its drivers are 'position'; expected a tuple of texts, with a "
        "comma behind a single one",
    ),
    "a cause without a comma": (
        [("""            source="our own motors",
        ),
    )""", """            source="our own motors",
        )
    )""")],
        "Cogging: causes is a Cause; expected a tuple of Cause, with a comma behind a single one",
    ),
    "no dataclass": (
        [("@dataclass(frozen=True, kw_only=True)\nclass Cogging", "class Cogging")],
        "Cogging is no dataclass, so its amplitude_n, pitch_m cannot be set; expected "
        "@dataclass(frozen=True, kw_only=True) above the class",
    ),
    "a state without a rate": (
        [(ANGLE, LAG + ANGLE),
         (IMPORT, IMPORT.replace("Force", "Force, State"))],
        "cogging has a state lag_m, and its rates() give no such rate; they give lagg_m; did you "
        "mean 'lagg_m'?",
    ),
    "a quantity that is none": (
        [('now["slide"].position_m', 'now["slide"].positon_m')],
        "slide has no positon_m, in line 35 of mine.py; it has position_m, velocity_m_s, "
        "moving_mass_kg; did you mean 'position_m'?",
    ),
    "a part that is none": (
        [('now["slide"].position_m', 'now["slde"].position_m')],
        "the plant has no 'slde', in line 35 of mine.py; it has slide, motor; did you mean "
        "'slide'?",
    ),
    "an effect on a part that is none": (
        [('body="slide"', 'body="slde"')],
        "the plant has no 'slde', asked by friction; it has slide, motor; did you mean 'slide'?",
    ),
    "a command without its unit": (
        [('Signal("motor.force_n"', 'Signal("motor.force"')],
        "motor has no force_n, in line 16 of mine.py; it has force; did you mean 'force'?",
    ),
    "an output without its unit": (
        [('measured=("slide.position_m",)', 'measured=("slide.position",)')],
        "measured: slide has no position; it has position_m, velocity_m_s, moving_mass_kg; did "
        "you mean 'position_m'?",
    ),
    "an output of no part": (
        [('measured=("slide.position_m",)', 'measured=("position_m",)')],
        "measured: the plant has no 'position_m'; it has slide.position_m, slide.velocity_m_s, "
        "slide.moving_mass_kg, motor.force_n; did you mean 'slide.position_m'?",
    ),
    "an optional output that is none": (
        [('measured=("slide.position_m",)',
          'measured=("slide.position_m",), optional_outputs=("slide.veloctiy_m_s",)')],
        "optional_outputs: slide has no veloctiy_m_s; it has position_m, velocity_m_s, "
        "moving_mass_kg; did you mean 'velocity_m_s'?",
    ),
    "an optional input that is none": (
        [('measured=("slide.position_m",)',
          'measured=("slide.position_m",), optional_inputs=(Signal("motor.fore_n", 0.0),)')],
        "optional_inputs: motor has no fore_n; it has force_n; did you mean 'force_n'?",
    ),
    "one force in place of several": (
        [(TERM, TERM.replace("yield", "return"))],
        "TypeError: 'Force' object is not iterable, asked by cogging",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("changes", "message"), CASES.values(), ids=CASES.keys())
def test_what_is_wrong_in_an_own_plant_is_said_once_and_whole(tmp_path, changes, message):
    assert said(tmp_path, *changes) == f"mine.py:joint: {message}"


def test_a_value_of_no_parameter_is_refused_with_the_line_that_sets_it(tmp_path):
    end = '        measured=("slide.position_m",),\n    )'
    told = said(tmp_path, (end, f'{end}.with_values({{"slide.mas_kg": 2.0}})'))

    assert "joint has no slide.mas_kg, in line 50 of mine.py; did you mean slide.mass_kg?" in told


def test_a_call_that_fails_is_named_with_its_line(tmp_path):
    told = said(
        tmp_path,
        (AMONG, AMONG + '            *sensor_flaws({"slide.velocity_m_s": 0.2}),\n'),
        (IMPORT, IMPORT + "\nfrom workbench.effects.sensors import sensor_flaws"),
    )

    assert "sensor_flaws" in told and "in line 44 of mine.py" in told


def test_a_rig_of_it_ends_with_code_2_and_the_line_that_names_it(tmp_path):
    (tmp_path / "mine.py").write_text(example().replace("typical=10.0", "typical=0.0"))
    rig = tmp_path / "rig.toml"
    rig.write_text('name = "x"\nplant = "mine.py:joint"\n')
    answer = call("effects", f"{tmp_path / 'mine.py'}:joint")

    assert answer.exit_code == 2 and "Cogging.amplitude_n: typical is 0" in answer.output
    with pytest.raises(InputError, match=r"rig.toml:2: mine.py:joint: Cogging.amplitude_n"):
        load_rig(rig)


def test_what_is_wrong_of_one_kind_comes_together(tmp_path):
    text = example().replace("Balance.MOMENTUM", "3").replace('h="amplitude_n"', 'h="pitch_m"')
    (tmp_path / "mine.py").write_text(text)
    with pytest.raises(InputError) as caught:
        plant_named("mine.py:joint", tmp_path)

    assert [str(each).partition(": its ")[2][:8] for each in caught.value.messages] == [
        "strength",
        "balance ",
    ]
