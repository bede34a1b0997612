"""Speed of the page on a recording of ten minutes at 1 kHz: thinning and brushing.

The floor is what numpy needs to look at the same numbers once, in the same run.
"""

import numpy as np
import pytest

from studies.figures.decimation import peaks
from studies.page.traces import TIME, Traces, inside

N, ROWS = 600_000, 9


@pytest.fixture(scope="module")
def rows():
    return np.random.default_rng(1).standard_normal((ROWS, N)).cumsum(axis=1)


def test_floor_smallest_and_largest_of_all_rows(benchmark, rows):
    benchmark(lambda: (np.nanmin(rows, axis=1), np.nanmax(rows, axis=1)))


def test_thinning_ten_minutes(benchmark, rows):
    kept = benchmark(peaks, rows, 0, N)

    assert len(kept) <= 1202


def test_brushing_ten_minutes(benchmark, rows):
    pytest.importorskip("bokeh")
    from bokeh.document import Document

    traces = Traces(Document())
    named = {TIME: 1e-3 * np.arange(N), **{f"e:{k}": row for k, row in enumerate(rows)}}
    traces.put(named, [name for name in named if name != TIME])
    box = {"x0": -50.0, "x1": 50.0, "y0": -20.0, "y1": 200.0}

    benchmark(lambda: traces.select(inside(traces.rows, "e:0", "e:1", box)))

    assert traces.source.selected.indices
