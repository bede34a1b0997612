"""A grid finer than the samples makes none up: what is made up has no noise."""

from dataclasses import replace

import numpy as np
import pytest
from recording_files import FACTORS, FULL, N, read, refused, table, text

from workbench.fitting.noise import measured_noise
from workbench.fitting.windows import one_clock


def every_ten_ms() -> np.ndarray:
    return table(10 * N)[::10]


@pytest.mark.parametrize("finer", ["1 ms", "2 ms", "5 ms"])
def test_the_noise_of_an_output_is_that_of_its_samples_on_any_finer_grid(tmp_path, finer):
    """Lines between samples made it 15 times too small, and every doubt 15 times too sure."""
    content = text(every_ten_ms())

    own, fine = (
        replace(read(tmp_path, content, section), noise={})
        for section in ("", f'resample = "{finer}"')
    )

    assert measured_noise([fine], FULL[1:]) == pytest.approx(measured_noise([own], FULL[1:]))


def test_outputs_have_values_where_they_were_sampled_and_inputs_everywhere(tmp_path):
    rows = every_ten_ms()

    found = read(tmp_path, text(rows), 'resample = "1 ms"')

    command, *outputs = (found[name] for name in FULL)
    assert np.isfinite(command).all() and len(command) == 10 * (N - 1) + 1
    for values, column, factor in zip(outputs, rows.T[2:], FACTORS[1:], strict=True):
        assert np.flatnonzero(np.isfinite(values)).tolist() == list(range(0, len(values), 10))
        assert values[::10] == pytest.approx(factor * column)


@pytest.mark.parametrize("step", ["3 ms", "7 ms", "9 ms"])
def test_a_finer_grid_that_meets_no_samples_is_refused(tmp_path, step):
    said = refused(tmp_path, text(every_ten_ms()), f'resample = "{step}"')

    assert f"resample: {step} is no whole part of the 10 ms between samples" in said
    assert 'expected "10 ms" or longer' in said


@pytest.mark.parametrize(("step", "n"), [("10 ms", N), ("15 ms", 267), ("20 ms", N // 2)])
def test_a_coarser_grid_is_full(tmp_path, step, n):
    found = read(tmp_path, text(every_ten_ms()), f'resample = "{step}"')

    assert all(np.isfinite(values).all() and len(values) == n for values in found.channels.values())


@pytest.mark.parametrize("order", [1, -1])
def test_recordings_of_two_clocks_are_to_be_put_on_the_slower_one(tmp_path, order):
    """The first one was named: with a fast one first, the slow one was to be made up."""
    slow, fast = (read(tmp_path, text(rows)) for rows in (every_ten_ms(), table()))

    with pytest.raises(ValueError, match=r'expected the same: set resample = "10 ms" in'):
        one_clock([slow, fast][::order])
