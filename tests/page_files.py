"""A servo drive and short recordings that its own plant made, as files for tests of the page."""

import numpy as np

from workbench.comparison.run import simulate
from workbench.reading import write_recording
from workbench.recording import Recording
from workbench.rig import load_rig

RIG = 'name = "drive 7"\nplant = "servo_drive"\n'


def drive_files(folder, seconds=0.8, leak="0.3 mm^2"):
    """rig.toml, train.csv and validation.csv; the plant that made them leaks past the piston."""
    (folder / "rig.toml").write_text(RIG)
    hidden = RIG + f'[effects]\nadd = ["piston_leak"]\n[values]\n"piston_leak.area" = "{leak}"\n'
    (folder / "hidden.toml").write_text(hidden)
    truth, rng, n = load_rig(folder / "hidden.toml"), np.random.default_rng(3), round(1e3 * seconds)
    for name, opening in (("train", 1.0), ("validation", -0.8)):
        command = np.full(n, truth.plant.commands[0].nominal)
        command[n // 8 : n // 3] += opening
        command[n // 2 : 3 * n // 4] -= 0.9 * opening
        made = simulate(truth, Recording(name, 1e-3, {"valve.command_v": command}))
        kept = {"valve.command_v", *truth.plant.measured}
        noise = {"slide.position_m": 1e-5}
        channels = {
            key: values
            + noise.get(key, 0.0 if key == "valve.command_v" else 500.0) * rng.standard_normal(n)
            for key, values in made.channels.items()
            if key in kept
        }
        write_recording(Recording(name, 1e-3, channels), folder / f"{name}.csv")
    return folder
