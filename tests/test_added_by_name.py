"""What is added by name is added, and its note says which criteria of a diagnosis it fails."""

import pytest
from test_diagnosis import bench, nothing
from test_laws_in_rigs import BARE, CURVED, curved

from workbench.diagnosis.addition import add
from workbench.diagnosis.judge import HELD_OUT_REASON
from workbench.rig import load_rig
from workbench.rig_writing import rig_text


def test_what_a_diagnosis_would_refuse_says_so_in_the_rig_file():
    train, held_out = [bench(1, nothing)], [bench(2, nothing)]

    step = add(load_rig(BARE), CURVED, train, held_out)

    assert HELD_OUT_REASON in step.against
    (line,) = (each for each in rig_text(step.rig).splitlines() if each.startswith("# accepted"))
    assert line.endswith(f"a diagnosis would refuse it: {', '.join(step.against)}")
    assert load_rig(rig_text(step.rig)).notes == step.rig.notes


@pytest.fixture(scope="module")
def there():
    return add(load_rig(BARE), CURVED, [curved(1), curved(3, 1e5)], [curved(2, 4e5)])


def test_what_is_there_is_added_without_a_word_against_it(there):
    assert there.against == ()
    assert "refuse" not in there.rig.notes[-1]


@pytest.mark.parametrize(
    ("more", "effect", "told"),
    [
        ('[effects]\nadd = ["coulomb_friction"]\n', "coulomb_friction", "bench has it already"),
        ('[values]\n"friction.viscous" = "40 N s/m"\n', "viscous_friction", "has it already"),
        ('[fixed]\nnames = ["friction.coulomb_force"]\n', "coulomb_friction", "bench fixes"),
        ("", "stiction", r"nothing without friction\.coulomb_force$"),
    ],
)
def test_what_needs_no_fit_is_refused_before_any(more, effect, told):
    said, head = [], 'name = "bench"\nplant = "cylinder_bench"\n'

    with pytest.raises(ValueError, match=told):
        add(load_rig(head + more), effect, [bench(1, nothing)], [bench(2, nothing)], said.append)

    assert said == []
