"""Calls on arrays give what CasADi's own calls give, to the last bit."""

import pickle

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from workbench.called import Curve, called, prepared, result


def polynomial() -> ca.Function:
    x, A = ca.SX.sym("x", 3), ca.SX.sym("A", 3, 2)
    sparse = ca.SX(ca.Sparsity.lower(3))
    sparse[1, 0], sparse[2, 2] = x[0] * x[1], ca.sin(x[2])
    return ca.Function("polynomial", [x, A], [ca.mtimes(A.T, x**2), sparse, A], [*"xA"], [*"abc"])


@settings(deadline=None, max_examples=30)
@given(some.lists(some.floats(-1e6, 1e6), min_size=9, max_size=9))
def test_results_equal_those_of_casadi(numbers):
    x, A = np.array(numbers[:3]), np.array(numbers[3:]).reshape(3, 2)
    ours = called(polynomial(), x, A)
    theirs = [np.array(ca.densify(v)) for v in polynomial()(x, A)]
    for one, other in zip(ours, theirs, strict=True):
        assert one.shape == other.shape
        np.testing.assert_array_equal(one, other)


def test_a_map_over_threads_reads_columns_and_strided_arrays():
    several = polynomial().map(4, "thread", 2)
    rng = np.random.default_rng(1)
    x, A = rng.normal(size=(8, 3)).T[:, ::2], rng.normal(size=(3, 8))
    ours = result(several, x, A)
    for k in range(4):
        np.testing.assert_array_equal(
            ours[:, k : k + 1], result(polynomial(), x[:, k], A[:, 2 * k : 2 * k + 2])
        )


def test_missing_numbers_pass_and_empty_inputs_are_no_obstacle():
    x, none = ca.SX.sym("x"), ca.SX.sym("none", 0)
    doubled = ca.Function("doubled", [x, none], [2 * x]).map(3)
    found = result(doubled, [[1.0, np.nan, 3.0]], np.zeros((0, 3)))
    np.testing.assert_array_equal(found, [[2.0, np.nan, 6.0]])


@pytest.mark.parametrize("arguments", [(np.zeros(3),), (np.zeros(2), np.zeros((3, 2)))])
def test_wrong_shapes_are_refused(arguments):
    with pytest.raises(ValueError, match="polynomial"):
        called(polynomial(), *arguments)


def test_a_prepared_call_gives_the_same_and_keeps_no_result():
    x = ca.SX.sym("x", 3)
    doubled = ca.Function("doubled", [x], [2.0 * x, ca.sum1(x)])
    call = prepared(doubled)

    first, total = call(np.array([1.0, 2.0, 3.0]))
    second, _ = call(np.array([5.0, 6.0, 7.0]))

    assert first.tolist() == [2.0, 4.0, 6.0] and total.tolist() == [6.0]
    assert second.tolist() == [10.0, 12.0, 14.0]


def test_a_curve_is_its_function_of_one_number_also_in_another_process():
    v = ca.SX.sym("v")
    curve = Curve(ca.Function("curve", [v], [ca.if_else(v > 0.0, v**2, -1.0)]))

    for one in (curve, pickle.loads(pickle.dumps(curve))):
        assert [one(value) for value in (3.0, 0.5, -2.0)] == [9.0, 0.25, -1.0]
