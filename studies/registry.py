"""The studies, by name, the longest first.  A new one is one file and one line here."""

from __future__ import annotations

from studies import (
    control_speed_study,
    controllers_study,
    delay_study,
    estimators_study,
    fidelity_study,
    gear_shift_study,
    hidden_study,
    identification_study,
    mode_count_study,
    mode_placement,
    paper_004,
    real_recordings,
    robustness_study,
    shift_study,
)
from studies.papers import (
    drive_details,
    joint_models,
    network_loop,
    rig_loops,
    rig_open_loop,
    rig_valve,
    shift_timing,
    soft_valve,
)
from studies.study import Study

STUDIES: dict[str, Study] = {
    study.name: study
    for study in (
        hidden_study.STUDY,
        estimators_study.STUDY,
        paper_004.STUDY,
        controllers_study.STUDY,
        identification_study.STUDY,
        real_recordings.STUDY,
        delay_study.STUDY,
        mode_count_study.STUDY,
        fidelity_study.STUDY,
        robustness_study.STUDY,
        mode_placement.STUDY,
        gear_shift_study.STUDY,
        shift_study.STUDY,
        rig_valve.STUDY,
        rig_open_loop.STUDY,
        rig_loops.STUDY,
        joint_models.STUDY,
        network_loop.STUDY,
        drive_details.STUDY,
        shift_timing.STUDY,
        soft_valve.STUDY,
        control_speed_study.STUDY,
    )
}
