"""The C of a tape: readable, clean, and for every operation what CasADi's virtual machine gives, in lanes too."""

from __future__ import annotations

import ctypes
import subprocess

import casadi as ca
import numpy as np
import pytest

from engine import steps
from gammastar import engine
from gammastar.engine import c_source as module
from gammastar.engine import c_values
from gammastar.engine.c_source import c_source
from gammastar.engine.compiler import compiler, library
from gammastar.engine.native import Native
from gammastar.engine.tape import OPERATIONS
from gammastar.errors import InputError

LISTED = list(OPERATIONS)
SPECIAL = [np.nan, np.inf, -np.inf, 0.0, -0.0, 5e-324, -1e-310, 1e308, -1e308, 2.0**52 + 1, -(2.0**51) - 0.5]
PLAIN = [1.0, -1.0, 0.5, -0.5, 1.5, -2.5, 3.7, np.pi, np.pi / 2, 1e-9, 3e5, 1e7, -1e7, 1e22, 710.0, 709.7]
EDGES = np.array([*SPECIAL, *PLAIN, -745.0, -708.3, -750.0])


def computed(x: np.ndarray, y: np.ndarray, lanes: int | None = None) -> dict[str, np.ndarray]:
    """Return every operation of x (n,) and y (n,) as compiled C gives it."""
    return dict(zip(LISTED, steps.stepped(steps.every_operation(), np.stack([x, y]), lanes), strict=True))


def test_the_text_is_one_line_a_value_and_a_block_a_branch() -> None:
    x, y = ca.SX.sym("x", 2), ca.SX.sym("y")
    outputs = [ca.if_else(x[0] < y, ca.sin(x[1]), 0.5), x[1] - 2]
    text = c_source(engine.tape_of(ca.Function("f", [x, y], outputs)), name="law")
    assert text.endswith("""\
void law(const real *restrict x0, const real *restrict x1, real *restrict y0, real *restrict y1) {
    const truth v2 = x0[0] < x1[0];
    const real v11 = x0[1] - 2.0;
    y1[0] = v11;
    real v9;
    if (v2) {
        const real v4 = real_sin(x0[1]);
        v9 = v4;
    } else {
        v9 = spread(0.5);
    }
    y0[0] = v9;
}
""")


def test_before_one_lane_stands_what_it_takes_and_no_more() -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    alone = c_source(engine.tape_of(ca.Function("f", [x, y], [x * y])))
    head = "typedef double real;\n/* One lane: a value is a number, and functions are those of the C library. */\n#include <math.h>\n\n"
    assert alone.partition("void step")[0] == head
    chosen = c_source(engine.tape_of(ca.Function("f", [x, y], [x < y])))
    assert chosen.partition("void step")[0] == (
        f"{head}typedef int truth;\n\nstatic inline real number(truth t) {{ return (real)t; }}\n\n"
    )


def test_every_operation_is_written() -> None:
    written = {*c_values.PATTERNS, *c_values.CONNECTIVES, *module.OWN, *module.LIBRARY, "constpow"}
    assert written == set(OPERATIONS)


@pytest.mark.parametrize("value", [0.1, -2.5e-7, 1e22, 5e-324, 1.7976931348623157e308, 0.0])
def test_constants_read_back_as_the_same_number(value: float) -> None:
    x = ca.SX.sym("x")
    text = c_source(engine.tape_of(ca.Function("f", [x], [ca.SX(value)])))
    literal = text.rpartition("spread(")[2].partition(");")[0]
    assert float(literal.strip("()")) == value


def test_lanes_of_floats_are_refused() -> None:
    tape = engine.tape_of(steps.tiny(2.0).core)
    with pytest.raises(InputError, match="double, or in float for one lane"):
        c_source(tape, real="float", lanes=4)


@steps.needs_compiler
@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("kind", ["paper_circle", "every_operation"])
def test_one_lane_is_clean_c99(kind: str, real: str, tmp_path) -> None:
    made = getattr(steps, kind)()
    source = tmp_path / "step.c"
    source.write_text(c_source(engine.tape_of(getattr(made, "step", made).core), real=real))
    strict = [
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Wconversion",
        "-Werror",
        "-c",
        "-o",
        str(tmp_path / "step.o"),
    ]
    answer = subprocess.run([*compiler().command, *strict, str(source)], capture_output=True, text=True, check=False)
    assert (answer.returncode, answer.stderr) == (0, "")


@steps.needs_compiler
@pytest.mark.parametrize("lanes", [None, 1], ids=["lanes", "one lane"])
def test_every_operation_gives_what_the_virtual_machine_gives_at_the_edges(lanes: int | None) -> None:
    """NaN, infinities, zeros, subnormals and turning points, in all pairs; to 1e-15, and up to the sign of zero."""
    x, y = (each.ravel() for each in np.meshgrid(EDGES, EDGES))
    found = computed(x, y, lanes)
    expected = (
        steps.every_operation()
        .graph()(np.zeros((len(LISTED), len(x))), np.stack([x, y]), np.zeros((1, len(x))))[0]
        .full()
    )
    for name, row in zip(LISTED, expected, strict=True):
        assert found[name] == pytest.approx(row, rel=1e-15, abs=0, nan_ok=True), name


def drawn(low: float, high: float, count: int = 50_000) -> np.ndarray:
    """Return numbers of either sign with sizes from 10^low to 10^high."""
    draw = np.random.default_rng(1)
    return draw.choice([-1.0, 1.0], count) * 10 ** draw.uniform(low, high, count)


RIGHT_ANGLES = np.arange(-600_000, 600_000, 24) * (np.pi / 2)
EXPONENTS = np.linspace(-708, 709.7, 50_000)
RANGES = {
    "sin": (np.sin, [drawn(-20, 6), drawn(-1, 6), np.linspace(-7, 7, 50_001), RIGHT_ANGLES]),
    "cos": (np.cos, [drawn(-20, 6), drawn(-1, 6), np.linspace(-7, 7, 50_001), RIGHT_ANGLES]),
    "exp": (np.exp, [EXPONENTS, drawn(-20, 2)]),
    "expm1": (np.expm1, [EXPONENTS, drawn(-20, 2), np.linspace(-1, 1, 50_001)]),
    "log": (np.log, [np.abs(drawn(-307, 307)), np.linspace(0.5, 2, 50_001), 1 + drawn(-16, -1)]),
    "atan": (np.arctan, [drawn(-20, 20), drawn(-1, 1)]),
}


@steps.needs_compiler
@pytest.mark.parametrize("name", RANGES)
def test_functions_in_lanes_are_right_to_a_relative_1e_15(name: str) -> None:
    """Against the same function in the longest floating type there is; 3.2e-16 was measured."""
    function, values = RANGES[name]
    x = np.concatenate(values)
    exact = function(x.astype(np.longdouble))
    x, exact = x[exact != 0], exact[exact != 0]
    assert np.abs((computed(x, x)[name] - exact) / exact).max() < 1e-15


@steps.needs_compiler
def test_sines_of_floats_are_right_to_1e_7(tmp_path) -> None:
    """Up to 8000 rad; beyond, they stay numbers between -1 and 1, and NaN where the angle is none."""
    x = ca.SX.sym("x")
    tape = engine.tape_of(ca.Function("f", [x], [ca.vertcat(ca.sin(x), ca.cos(x))]))
    exported = '\n__attribute__((visibility("default")))\nvoid circle('
    made = library(compiler(), c_source(tape, "circle", "float").replace("void circle(", exported.strip("\n")))
    angles = np.concatenate([drawn(-6, 3.9, 4000), np.arange(-200, 200) * (np.pi / 4), drawn(5, 38, 400)])
    angles = np.append(angles, [np.nan, np.inf]).astype(np.float32)
    pairs = np.empty((len(angles), 2), np.float32)
    for angle, pair in zip(angles, pairs, strict=True):
        made.circle(ctypes.byref(ctypes.c_float(angle)), pair.ctypes.data_as(ctypes.c_void_p))
    exact = np.column_stack([np.sin(angles[:-2].astype(float)), np.cos(angles[:-2].astype(float))])
    assert np.abs(pairs[:4400] - exact[:4400]).max() < 1e-7
    assert np.abs(pairs[:-2]).max() <= 1
    assert np.isnan(pairs[-2:]).all()


@steps.needs_compiler
def test_the_angle_of_a_point_is_right_to_a_relative_1e_15() -> None:
    y, x = drawn(-3, 3), drawn(-3, 3)[::-1].copy()
    exact = np.arctan2(y.astype(np.longdouble), x.astype(np.longdouble))
    assert np.abs((computed(y, x)["atan2"] - exact) / exact).max() < 1e-15


@steps.needs_compiler
def test_quotients_by_one_divisor_are_rounded_as_every_quotient_is() -> None:
    """Lanes multiply by one inverse and correct: the same numbers as NumPy divides, NaN, infinities and zero among them."""

    def quotients(state: ca.SX, given: ca.SX, number: ca.SX) -> ca.SX:
        x, y = given[0], given[1]
        return ca.vertcat(x / y, (x + 1) / y, (x - 1) / 0.1, x / -3.0)

    step = steps.step_of(4, 2, quotients)
    if compiler().lanes > 1:
        assert Native(step).source.count("= quotient(") == 4
    usual = EDGES[(EDGES == 0) | ~((np.abs(EDGES) < 1e-290) | (np.abs(EDGES) > 1e290)) | np.isinf(EDGES)]
    edges = [each.ravel() for each in np.meshgrid(usual, usual)]
    x, y = np.concatenate(
        [edges, [drawn(-140, 140), drawn(-140, 140)[::-1]], [drawn(0, 0.5), drawn(0, 1)[::-1]]], axis=1
    )
    found = steps.stepped(step, np.stack([x, y]))
    with np.errstate(all="ignore"):
        assert np.array_equal(found, [x / y, (x + 1) / y, (x - 1) / 0.1, x / -3.0], equal_nan=True)
