"""SX functions as C that takes several points at once, one in each lane of the vector unit.

A processor divides four or eight numbers in the time it needs for one or two.  CasADi writes C for
one point; here the same instructions are written on vectors of LANES numbers (GCC's and Clang's
vector types), so that several points are asked in one call.  Each lane gives what CasADi gives, to
the last bit: no sum is reordered, no product contracted, and what the vector unit lacks (exp, log,
powers, sines) is asked lane by lane from the same library.  Of the smaller or larger of +0 and -0,
whose sign C leaves open, lanes take what CasADi's virtual machine takes.

Written for the machine it runs on: the library is kept under what the compiler says of that.
"""

from __future__ import annotations

import ctypes
import logging
from collections.abc import Callable, Mapping
from pathlib import Path

import casadi as ca
import numpy as np

from workbench.compiled import loaded

log = logging.getLogger("workbench")

NATIVE = (("-march=native",), ("-mcpu=native",), ())  # as compilers of some processors want it
FLAGS = ("-fno-math-errno",)  # lets a root be one instruction

HEAD = Path(__file__).with_name("lanes.h")

_SINGLE = "sqrt fabs exp log sin cos tan asin acos atan sinh cosh tanh floor ceil sign log1p expm1"
OPERATIONS = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_NEG: "-{0}",
    ca.OP_INV: "all(1.0) / {0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_LT: "truth({0} < {1})",
    ca.OP_LE: "truth({0} <= {1})",
    ca.OP_EQ: "truth({0} == {1})",
    ca.OP_NE: "truth({0} != {1})",
    ca.OP_NOT: "truth({0} == all(0.0))",
    ca.OP_AND: "truth(holds({0}) & holds({1}))",
    ca.OP_OR: "truth(holds({0}) | holds({1}))",
    ca.OP_IF_ELSE_ZERO: "kept({0}, {1})",
    ca.OP_FMIN: "smaller({0}, {1})",
    ca.OP_FMAX: "greater({0}, {1})",
    ca.OP_POW: "pow_v({0}, {1})",
    ca.OP_CONSTPOW: "pow_v({0}, {1})",
    ca.OP_ATAN2: "atan2_v({0}, {1})",
    ca.OP_HYPOT: "hypot_v({0}, {1})",
    ca.OP_COPYSIGN: "copysign_v({0}, {1})",
    **{getattr(ca, f"OP_{name.upper()}"): f"{name}_v({{0}})" for name in _SINGLE.split()},
}
"""What each of CasADi's operations is on vectors."""


class NoLanesError(ValueError):
    """A function uses an operation that is not written on vectors."""


def lanes_of(function: ca.Function, name: str) -> str:
    """C of ``void name(const v *i0, ..., v *o0, ...)``: every entry of in- and outputs is a vector.

    Entries are all of each, column by column, also those that CasADi knows to be zero.

    Raises
    ------
    NoLanesError
        If an operation of the function is not written on vectors.
    """
    lines, used, function = [], set(), _dense(function)
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        given, to = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            lines.append(f"o{to[0]}[{to[1]}] = w{given[0]};")
            continue
        if operation == ca.OP_INPUT:
            value = f"i{given[0]}[{given[1]}]"
        elif operation == ca.OP_CONST:
            value = f"all({_number(function.instruction_constant(k))})"
        elif operation in OPERATIONS:
            value = OPERATIONS[operation].format(*(f"w{place}" for place in given))
        else:
            raise NoLanesError(f"{function.name()}: CasADi's operation {operation} has no lanes")
        lines.append(f"w{to[0]} = {value};")
        used.add(to[0])
    arguments = [f"const v *restrict i{k}" for k in range(function.n_in())]
    arguments += [f"v *restrict o{k}" for k in range(function.n_out())]
    work = f"v {', '.join(f'w{k}' for k in sorted(used))};" if used else ""
    return "\n".join([f"static void {name}({', '.join(arguments)}) {{", work, *lines, "}", ""])


def _dense(function: ca.Function) -> ca.Function:
    """The same with every entry stored."""
    names = [f"i{k}" for k in range(function.n_in())]
    given = [ca.SX.sym(n, *function.size_in(k)) for k, n in enumerate(names)]
    results = [ca.densify(result) for result in function.call(given)]
    return ca.Function(function.name(), given, results)


def _number(value: float) -> str:
    """As C reads it, to the last bit."""
    if value != value:
        return "NAN"
    if value in (float("inf"), -float("inf")):
        return "INFINITY" if value > 0.0 else "-INFINITY"
    return value.hex()


def lane_library(
    driver: Path, sizes: Mapping[str, object], functions: Mapping[str, ca.Function]
) -> ctypes.CDLL | None:
    """The library of a driver in C, which calls these functions in lanes by these names.

    ``sizes`` are defined for it.  None where there is no compiler, or none that knows the machine
    it runs on, or where a function has no lanes: then all runs as CasADi has it.
    """
    try:
        written = [lanes_of(function, name) for name, function in functions.items()]
    except NoLanesError as error:
        log.info("%s", error)
        return None
    defined = [f"#define {name} {value}" for name, value in sizes.items()]
    head, rest = (path.read_text(encoding="utf-8") for path in (HEAD, driver))
    return loaded(driver.stem, "\n".join([head, *defined, *written, rest]), NATIVE, FLAGS)


def declared(function: Callable[..., None], arguments: list[type]) -> Callable[..., None]:
    """A function of a library that returns nothing, with the types of its arguments."""
    function.argtypes, function.restype = arguments, None
    return function


def address(values: np.ndarray) -> ctypes.c_void_p:
    """Where an array begins that C is to read or fill: contiguous, and kept alive meanwhile."""
    return ctypes.c_void_p(values.ctypes.data)
