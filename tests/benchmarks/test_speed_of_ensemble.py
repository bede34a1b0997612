"""Speed of many windows side by side: in lanes of the vector unit, beside CasADi's own map.

Run it with ``pytest tests/benchmarks/test_speed_of_ensemble.py -s --benchmark-enable``.  Both use
two threads; wall time counts, the best of the rounds.  Steps at which a slide breaks away, or a
piston meets an end, are refined, in each window at another sample.
"""

import time

import numpy as np
import pytest
from test_ensemble import cut

from workbench.plants.gearbox import gearbox
from workbench.plants.servo_drive import servo_drive

DT, LENGTH, WINDOWS, PLANTS = 1e-3, 200, 25, 4


@pytest.mark.parametrize("plant", [servo_drive(), gearbox()], ids=lambda plant: plant.name)
def test_windows_side_by_side(benchmark, plant, monkeypatch):
    lean = plant.lean()
    windows, starts = cut(lean, DT, WINDOWS, LENGTH)

    def several():
        return windows.simulated([lean] * PLANTS, starts)

    together = benchmark.pedantic(several, rounds=5, warmup_rounds=1)
    monkeypatch.setitem(lean.model._ensemble, DT, None)
    by_casadi = several()
    if benchmark.enabled:
        times = [_seconds(several) for _ in range(5)]
        own = benchmark.stats.stats.min
        print(
            f"\n{plant.name}: {PLANTS * WINDOWS} windows in {1e3 * own:.0f} ms, "
            f"{min(times) / own:.1f} times as fast as CasADi's map"
        )

    np.testing.assert_array_equal(together, by_casadi)


def _seconds(call):
    begun = time.perf_counter()
    call()
    return time.perf_counter() - begun
