"""Spoiled recordings: each is told for what it is, and none gets a confident wrong name.

The servo drive's are those of the demo, which the independent truth made; the other plants' come
from the flat oracles or are real.
"""

from dataclasses import replace
from itertools import islice

import numpy as np
import oracle_crr_rig
import oracle_soft_joint
import pytest
from scipy.integrate import solve_ivp
from test_diagnosis import bench, nothing

from studies import adversarial as spoil
from studies.demo import DATA
from studies.documents import comparison_document
from studies.truth.cases import read_cases
from workbench.comparison import compare
from workbench.consistency import Finding, Weight, examined, trusted
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.result import Verdict
from workbench.errors import InputError
from workbench.fitting.fit import fit
from workbench.reading import RecordingWarning, read_recording
from workbench.recording import Recording
from workbench.recordings import RECORDINGS, real_data_folder
from workbench.rig import default_rig, load_rig

FOLDER = real_data_folder()
SAMPLES = np.arange(2000)
A, B, PLACE, COMMAND = spoil.A, spoil.B, spoil.PLACE, spoil.COMMAND


@pytest.fixture(scope="module")
def demo():
    """The demo's rig, and its training and validation recordings."""
    rig = load_rig(DATA / "rig.toml")
    return rig, *(read_recording(rig, DATA / f"{k}.csv") for k in ("train", "validation"))


def said(rig, recording):
    return [(each.weight, f"{each.channel} {each.what}") for each in examined(rig, recording)]


def test_nothing_is_said_of_good_recordings(demo):
    rig, *recordings = demo

    assert [said(rig, each) for each in recordings] == [[], []]


@pytest.mark.slow
def test_the_study_tells_a_spoiled_recording_from_one_with_a_missing_effect():
    """The first lines of what ``python -m studies.adversarial`` prints, of one case."""
    case = read_cases()["piston_leak", 1]
    as_it_is, exchanged = islice(spoil.lines([case]), 2)

    assert as_it_is.split()[-3:] == ["piston_leak", "1", "nothing"]
    assert "refused: chamber_a.pressure and chamber_b.pressure look exchanged" in exchanged


@pytest.mark.parametrize(("first", "samples"), [(0, 300), (1500, 300), (7500, 300), (1500, 500)])
def test_nothing_is_said_of_a_stroke_that_a_misreading_happens_to_fit(demo, first, samples):
    """One window or two: an effect is missing, and one atmosphere less explains these better."""
    rig, train, _ = demo

    assert said(rig, train.part(first, first + samples)) == []


@pytest.mark.skipif(FOLDER is None, reason="the real recordings are not beside the project")
@pytest.mark.filterwarnings("ignore::workbench.reading.RecordingWarning")
@pytest.mark.parametrize("data", RECORDINGS, ids=lambda data: data.__name__.rpartition(".")[2])
def test_nothing_is_said_of_real_recordings(data):
    for rig, recording in data.everything(FOLDER):
        assert said(rig, recording) == [], recording.name


MISREAD = {
    "pressures exchanged": "chamber_a.pressure and chamber_b.pressure look exchanged",
    "a times 10": "chamber_a.pressure looks ten times too large",
    "a by 10": "chamber_a.pressure looks ten times too small",
    "both pressures by 10": "chamber_a.pressure and chamber_b.pressure look ten times too small",
    "a in bar as Pa": "chamber_a.pressure looks 100 000 times (bar for Pa) too small",
    "both pressures in psi as kPa": (
        "chamber_a.pressure and chamber_b.pressure look 6.9 times (kPa for psi) too small"
    ),
    "position times 10": "slide.position looks ten times (cm for mm) too large",
    "position by 10": "slide.position looks ten times (cm for mm) too small",
    "position in mm as m": "slide.position looks a thousand times (m for mm) too large",
    "position in m as mm": "slide.position looks a thousand times (m for mm) too small",
    "position in m as cm": "slide.position looks 100 times (m for cm) too small",
    "command by 10": "valve.command looks ten times too small",
    "position negative": "slide.position seems to count the other way",
    "position mirrored": "slide.position seems to count the other way",
    "command mirrored": "valve.command seems to act the other way",
    "all noise": "chamber_a.pressure is noise",
    "a is noise": "chamber_a.pressure is noise",
}


@pytest.mark.parametrize("way", MISREAD)
def test_a_misread_servo_drive_is_refused_with_what_is_wrong(demo, way):
    rig, train, _ = demo
    with pytest.raises(InputError) as error:
        trusted(rig, [spoil.SERVO_DRIVE[way](train)])

    assert MISREAD[way] in str(error.value).replace(": ", " ")


def test_a_refusal_reads_as_a_warning_does():
    found = Finding(Weight.REFUSED, "run.csv", "cap.pressure", "is noise", "check the wiring")

    assert str(found.message) == str(found) == "run.csv: cap.pressure: is noise; check the wiring"


def test_every_spoiled_recording_of_several_is_named(demo):
    rig, train, validation = demo
    swap = spoil.SERVO_DRIVE["pressures exchanged"]
    with pytest.raises(InputError) as error:
        trusted(rig, [swap(train)], [swap(validation)])

    assert len(error.value.messages) == 2
    assert "validation.csv" in str(error.value.messages[1])


@pytest.mark.parametrize(("name", "public"), [(PLACE, "slide.position"), (A, "chamber_a.pressure")])
def test_a_stuck_sensor_is_doubtful_and_its_samples_are_left_out(demo, name, public):
    rig, train, _ = demo
    ((left,),), findings = trusted(rig, [spoil.stuck(name, 3.0)(train)])
    (finding,) = findings

    assert finding.weight is Weight.DOUBT
    assert finding.channel == public and "stuck" in finding.what
    assert np.isnan(left[name][3000:]).all() and np.isfinite(left[name][:3000]).all()
    assert np.array_equal(left[B], train[B])


def test_an_uneven_clock_is_noticed_with_its_size(demo):
    rig, train, _ = demo
    ((weight, text),) = said(rig, spoil.SERVO_DRIVE["clock jitter"](train))

    assert weight is Weight.NOTICE
    assert 0.1 < float(text.partition("taken ")[2].partition("%")[0]) / 100 < 0.3


def test_a_sensor_at_rest_is_no_noise(demo):
    """A slide that stands still shows nothing but noise, and nothing is wrong with it."""
    rig, _, _ = demo
    rng, n = np.random.default_rng(5), 3000
    rows = {COMMAND: np.full(n, 4.95), PLACE: 0.1 + 3e-5 * rng.standard_normal(n)}
    rows |= {name: 5.65e5 + 400.0 * rng.standard_normal(n) for name in (A, B)}

    assert said(rig, Recording("rest", 1e-3, rows)) == []


def test_a_comparison_goes_on_and_says_it(demo):
    rig, train, _ = demo
    spoiled = spoil.SERVO_DRIVE["pressures exchanged"](train.part(0, 3000))
    with pytest.warns(RecordingWarning, match="look exchanged.* fit refuse this recording"):
        found = compare(rig, [spoiled])

    assert any("look exchanged" in note for note in found.recordings[0].notes)
    (told,) = comparison_document(found)["recordings"][0]["findings"]
    assert told["weight"] == "refused" and "look exchanged" in told["what"]
    assert told["channel"] == "chamber_a.pressure and chamber_b.pressure" and told["remedy"]


def test_a_fit_refuses_and_warns(demo):
    rig, train, _ = demo
    with pytest.raises(InputError, match="look exchanged"):
        fit(rig, [spoil.SERVO_DRIVE["pressures exchanged"](train)])
    with pytest.warns(RecordingWarning, match="samples seem taken"):
        late = spoil.SERVO_DRIVE["clock jitter"](train.part(0, 3000))
        fit(rig, [late], only=["slide.mass_kg"])


CAP, ROD_SIDE = "cap.pressure_pa", "rod_side.pressure_pa"
CRR = {
    "exchanged": (
        spoil.exchanged(CAP, ROD_SIDE),
        "cap.pressure and rod_side.pressure look exchanged",
    ),
    "bar as Pa": (spoil.scaled(1e-5, CAP), "cap.pressure looks 100 000 times"),
    "by 10": (spoil.scaled(0.1, ROD_SIDE), "rod_side.pressure looks ten times"),
    "mirrored": (spoil.turned("valve.command_v", 5.25), "valve.command seems to act the other way"),
    "position": (spoil.scaled(0.1, "rod.position_m"), "rod.position looks ten times"),
}


@pytest.fixture(scope="module")
def crr():
    """Four seconds of the rescue robot's rig by its flat oracle, with noise."""
    dt, n = 1e-3, 4000
    time_s = dt * np.arange(n)
    command = 5.25 + 1.3 * np.sign(np.sin(2 * np.pi * 0.9 * time_s)) * np.sin(5.3 * time_s) ** 2
    gas = [3e5, 3e5]
    masses = np.array(gas) * oracle_crr_rig.volumes(0.07) / (oracle_crr_rig.R * 293.15)
    start = [0.07, 0.0, gas[0], masses[0], gas[1], masses[1]]
    found = solve_ivp(
        lambda t, x: oracle_crr_rig.rates(x, command[min(int(t / dt), n - 1)]),
        (0.0, time_s[-1]), start, "LSODA", time_s, rtol=1e-6, atol=1e-9, max_step=5e-3,
    )  # fmt: skip
    rng = np.random.default_rng(3)
    rows = {"valve.command_v": command}
    measured = (("rod.position_m", 0, 2e-5), (CAP, 2, 500.0), (ROD_SIDE, 4, 500.0))
    for name, row, sigma in measured:
        rows[name] = found.y[row] + sigma * rng.standard_normal(n)
    return default_rig("crr_rig"), Recording("rig", dt, rows)


def test_nothing_is_said_of_the_rescue_robot_s_rig(crr):
    assert said(*crr) == []


@pytest.mark.parametrize("way", CRR)
def test_a_misread_rescue_robot_s_rig_is_told(crr, way):
    rig, recording = crr
    change, expected = CRR[way]
    ((weight, text),) = said(rig, change(recording))

    assert weight is Weight.REFUSED and expected in text


@pytest.fixture(scope="module")
def joint():
    """A soft joint filled and vented by its flat oracle, at 400 Hz."""
    dt, n, finer = 2.5e-3, 2400, 10
    pwm = np.repeat(np.random.default_rng(8).uniform(0.2, 0.8, n // 120), 120)
    pressure, rows = 2e5, []
    for command in pwm:
        rows.append(pressure)
        for _ in range(finer):
            pressure += dt / finer * oracle_soft_joint.rate(pressure, command)
    noise = 200.0 * np.random.default_rng(9).standard_normal(n)
    channels = {"valve.pwm": pwm, "bellows.pressure_pa": np.array(rows) + noise}
    return default_rig("soft_joint"), Recording("joint", dt, channels)


JOINT = {
    "as it is": (lambda r: r, None),
    "by 10": (spoil.scaled(0.1, "bellows.pressure_pa"), "bellows.pressure looks ten times"),
    "times 10": (spoil.scaled(10.0, "bellows.pressure_pa"), "bellows.pressure looks ten times"),
    "mirrored": (spoil.turned("valve.pwm", 0.5), "valve.pwm seems to act the other way"),
    "percent": (spoil.scaled(0.01, "valve.pwm"), "valve.pwm looks 100 times (a fraction for %)"),
    "gauge": (spoil.shifted(-1.013e5, "bellows.pressure_pa"), "looks one atmosphere too small"),
    "noise": (spoil.noise("bellows.pressure_pa"), "bellows.pressure is noise"),
}


@pytest.mark.parametrize("way", JOINT)
def test_a_misread_soft_joint_is_told(joint, way):
    rig, recording = joint
    change, expected = JOINT[way]
    texts = [text for _, text in said(rig, change(recording))]

    assert len(texts) == (expected is not None)
    assert all(expected in text for text in texts)


def on_the_drive(recording):
    """A recording of the rescue robot's rig, handed over as one of the servo drive."""
    names = {"valve.command_v": COMMAND, "rod.position_m": PLACE, CAP: A, ROD_SIDE: B}
    return replace(recording, channels={names[k]: v for k, v in recording.channels.items()})


def test_a_recording_of_something_else_is_not_called_misread():
    """Ten times as large it would be missed by no more than itself: that explains nothing."""
    rig = load_rig('name = "bench"\nplant = "cylinder_bench"\n')
    strange = [
        replace(each, channels={**each.channels, "rod.force_n": 100.0 * np.sin(0.05 * k * SAMPLES)})
        for k, each in enumerate((bench(1, nothing), bench(2, nothing)), start=2)
    ]
    found = diagnose(rig, strange[:1], strange[1:])

    assert [said(rig, each) for each in strange] == [[], []]
    assert found.verdict is Verdict.RECORDING_TOO_WEAK
    assert found.law is None and found.after == {}


@pytest.mark.slow
def test_a_recording_of_another_plant_gets_no_name(crr):
    other = on_the_drive(crr[1])
    train, validation = other.part(0, 2500), other.part(2500, 4000)
    found = diagnose(default_rig("servo_drive"), [train], [validation], most_windows=12)

    assert_unnamed(found)


def assert_unnamed(found):
    assert found.verdict is Verdict.RECORDING_TOO_WEAK
    assert found.named is None and found.law is None and found.after == {}
    assert any("nothing explains the recording" in each for each in found.warnings)
