"""Formulas as text mean what they mean in mathematics, and nothing but mathematics gets through."""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gammastar.errors import InputError, PathError, ShapeError, UnknownNameError
from gammastar.path import catalogue as paths
from gammastar.path import expression, formula
from gammastar.path.expression import CONSTANTS, DEEPEST, FUNCTIONS, LARGEST_POWER, LONGEST, Expression, value_of
from gammastar.path.formula import curve_from_formula, implicit_from_formula
from strategies import numbers

GRID = np.linspace(0, 2 * np.pi, 13)
KNOWN: dict[str, Any] = {
    **{name: getattr(math, name) for name in set(FUNCTIONS) - {"abs", "max", "min"}},
    **{"abs": abs, "max": max, "min": min},
    **CONSTANTS,
}


def value(text: str, **variables: float) -> float:
    """Return the value of a formula through its graph."""
    symbols = [ca.SX.sym(name) for name in variables]
    graph = ca.SX(Expression(text, tuple(variables))(*symbols))
    return float(ca.Function("value", symbols, [graph])(*variables.values()))


literals = st.one_of(
    st.integers(0, 20).map(str), numbers(0, 9).map(lambda x: f"{x:.3f}"), st.sampled_from(["1e-2", ".5", "3."])
)
names = st.sampled_from(["a", "b", "pi", "e", "tau"])
blanks = st.sampled_from(["", "", " "])


def grown(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    """Return texts that hold smaller ones, often without parentheses so that precedence counts."""
    binary = st.builds(
        lambda a, before, sign, after, b: f"{a}{before}{sign}{after}{b}",
        inner,
        blanks,
        st.sampled_from("+-*/"),
        blanks,
        inner,
    )
    power = st.builds(lambda a, n: f"{a}**{n}", inner, st.sampled_from(["2", "3", "-1", "-2", "0"]))
    call = st.builds(
        lambda f, a: f"{f}({a})", st.sampled_from(["sin", "cos", "atan", "tanh", "abs", "exp", "sqrt", "log"]), inner
    )
    call_two = st.builds(lambda f, a, b: f"{f}({a}, {b})", st.sampled_from(["atan2", "max", "min"]), inner, inner)
    return st.one_of(
        binary, power, call, call_two, inner.map("({})".format), inner.map("-{}".format), inner.map("+{}".format)
    )


texts = st.recursive(st.one_of(literals, names), grown, max_leaves=8)


@settings(max_examples=300)
@given(texts, numbers(-3, 3), numbers(-3, 3))
def test_a_formula_has_the_value_that_python_gives_it(text: str, a: float, b: float) -> None:
    """An independent reading: the interpreter itself, with the names of `math`, signs and precedence included."""
    try:
        expected = eval(text, {"__builtins__": {}}, {**KNOWN, "a": a, "b": b})  # made of the parts above
        if isinstance(expected, complex) or not abs(expected) < 1e100:
            return
    except (ArithmeticError, ValueError):
        return
    refusal = ""
    try:
        found = value(text, a=a, b=b)
    except InputError as error:
        refusal = str(error)
    if refusal:  # a constant part of it has no finite value, though the whole has
        assert "finite" in refusal or "zero" in refusal
        return
    if abs(expected) < 1e12:  # graphs are simplified: sums that cancel round differently
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_is_the_one_of_its_name(name: str) -> None:
    arguments = (0.3,) if name not in {"atan2", "max", "min"} else (0.3, -0.7)
    text = f"{name}({', '.join('ab'[: len(arguments)])})"
    found = value(text, **dict(zip("ab", arguments, strict=False)))
    assert found == pytest.approx(KNOWN[name](*arguments), rel=1e-15)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("-2**2", -4.0),
        ("2**-1", 0.5),
        ("2**3**2", 512.0),
        ("2 - 3 - 4", -5.0),
        ("2 / 4 / 2", 0.25),
        ("2*\n 3\t+ 1", 7.0),
        ("max(1, 5, 3) + min(4, 2, 3, 8)", 7.0),
        ("0x10 + 1_000", 1016.0),
        ("log(e) + cos(tau)", 2.0),
        ("a**0.5", math.sqrt(2)),
        ("(-8)**3", -512.0),
    ],
)
def test_precedence_and_spelling(text: str, expected: float) -> None:
    assert value(text, a=2.0) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("word", ["lambda", "λ"])
def test_lambda_may_be_written_either_way(word: str) -> None:
    for parameter in ("lambda", "λ"):
        curve = curve_from_formula(f"2*cos({word})", f"2 * sin( {word} )", 10, parameter, period="2*pi")
        circle = paths.circle(2.0, (0, 0, 10))
        assert curve.jets(GRID) == pytest.approx(circle.jets(GRID), abs=1e-14)


def test_a_curve_may_name_its_parameter_and_its_constants() -> None:
    curve = curve_from_formula(
        "R*cos(angle)",
        "R*sin(angle)",
        "h + A*sin(2*pi*R*cos(angle)/L)",
        parameter="angle",
        period="tau",
        constants={"R": 1.5, "h": 1, "A": "1/4", "L": 3},
    )
    assert curve.jets(GRID) == pytest.approx(paths.nonplanar_circle().jets(GRID), abs=1e-10)
    assert curve.period == 2 * math.pi


def test_an_open_curve_has_a_domain() -> None:
    curve = curve_from_formula("lambda", "sin(2*pi*lambda/6)", 0, domain=("-12", "2*6"))
    assert curve.domain == (-12, 12)
    assert curve.jets(GRID) == pytest.approx(paths.sine().jets(GRID), abs=1e-13)


def test_an_implicit_path_is_the_one_of_the_paper() -> None:
    """Section VI: s1 = x1^2 + x2^2 - 1, s2 = x3 - 10, pi = atan2(x2, x1)."""
    path = implicit_from_formula(
        "x**2 + y**2 - r**2", "z - 10", "atan2(y, x)", ("r", 0, 10), "2*pi", constants={"r": 1}
    )
    twin = paths.circle(1.0, (0, 0, 10), kind="implicit", coordinates="quadratic")
    assert path.points(GRID) == pytest.approx(twin.points(GRID), abs=1e-13)
    symbols = ca.SX.sym("x", 3)
    pair = [
        ca.Function(
            "path", [symbols], [ca.vertcat(*(f(*ca.vertsplit(symbols)) for f in (p.first, p.second, p.coordinate)))]
        )
        for p in (path, twin)
    ]
    assert np.array(pair[0]((1.2, -0.7, 3.0))) == pytest.approx(np.array(pair[1]((1.2, -0.7, 3.0))), abs=1e-14)


def test_a_formula_of_unreal_places_is_refused_by_the_curve() -> None:
    """Not finite where the path runs: the place is named."""
    with pytest.raises(PathError, match="parameter"):
        curve_from_formula("sqrt(lambda)", "lambda", 0, domain=(-1, 1))


REFUSED: dict[str, tuple[str, int | None]] = {
    # text -> piece that the message repeats, and its column
    "lambda.real": ("lambda.real", 1),
    "1 + lambda.__class__": ("lambda.__class__", 5),
    "(1).__class__.__bases__": ("(1).__class__.__bases__", 1),
    "__import__('os').system('true')": ("__import__('os').system('true')", 1),
    "sin.__call__(1)": ("sin.__call__(1)", 1),
    "lambda x: x": ("lambda x: x", 8),
    "(lambda: 1)()": ("(lambda: 1)()", None),
    "[i for i in (1, 2)]": ("[i for i in (1, 2)]", 1),
    "{lambda: 1}": ("{lambda: 1}", 1),
    "{1, 2}": ("{1, 2}", 1),
    "'text'": ("'text'", 1),
    "sin('text')": ("'text'", 5),
    "f'{lambda}'": ("f'{lambda}'", 1),
    "b'1'": ("b'1'", 1),
    "1, 2": ("1, 2", 1),
    "lambda[0]": ("lambda[0]", 1),
    "1 if lambda else 2": ("1 if lambda else 2", 1),
    "1 + (lambda < 2)": ("lambda < 2", 6),
    "lambda and 1": ("lambda and 1", 1),
    "not lambda": ("not lambda", 1),
    "~lambda": ("~lambda", 1),
    "(a := 1)": ("a := 1", 2),
    "a := 1": ("a := 1", None),
    "lambda // 2": ("lambda // 2", 1),
    "lambda % 2": ("lambda % 2", 1),
    "lambda @ lambda": ("lambda @ lambda", 1),
    "lambda << 2": ("lambda << 2", 1),
    "lambda^2": ("lambda^2", 1),
    "True": ("True", 1),
    "None": ("None", 1),
    "...": ("...", 1),
    "2j": ("2j", 1),
    "sin": ("sin", 1),
    "sin()": ("sin()", 1),
    "1 + sin(1, 2)": ("sin(1, 2)", 5),
    "atan2(1)": ("atan2(1)", 1),
    "max(1)": ("max(1)", 1),
    "sin(x=1)": ("sin(x=1)", 1),
    "sin(1, x=2)": ("sin(1, x=2)", 1),
    "sin(*lambda)": ("*lambda", 5),
    "sin(**lambda)": ("sin(**lambda)", 1),
    "2(lambda)": ("2(lambda)", 1),
    "lambda(2)": ("lambda(2)", 1),
    "λ + pi(2)": ("pi(2)", 5),
    "await lambda": ("await lambda", 1),
    "(yield)": ("yield", 2),
    "2**10**10": ("2**10**10", 1),
    "lambda**1000": ("lambda**1000", 1),
    "lambda**-101": ("lambda**-101", 1),
    "1 + 1/0": ("1/0", 5),
    "lambda/(2 - 2)": ("lambda/(2 - 2)", 1),
    "sqrt(-1)": ("sqrt(-1)", 1),
    "log(0)": ("log(0)", 1),
    "asin(2)": ("asin(2)", 1),
    "(-8)**(1/3)": ("(-8)**(1/3)", 1),
    "0**-1": ("0**-1", 1),
    "exp(1000)": ("exp(1000)", 1),
    "1e999": ("1e999", 1),
    "9" * 400: ("9" * 40 + "...", 1),
    "1 # radius": ("#", 3),
    "1 +": ("1 +", None),
    "sin(1": ("sin(1", None),
    "1 2": ("1 2", None),
    "2lambda": ("2lambda", None),
    "import os": ("import os", 1),
    "x = 1": ("x = 1", None),
    "1; 2": ("1; 2", 2),
    "1 \\": ("1 \\\\", None),
    "\0": ("\\x00", None),
    "\ud800": ("\\ud800", None),
    "0777": ("0777", None),
}


@pytest.mark.parametrize("text", REFUSED)
def test_anything_but_mathematics_is_refused_with_its_place(text: str) -> None:
    piece, column = REFUSED[text]
    with pytest.raises(InputError) as caught:
        curve_from_formula("lambda", text, 0)
    message = str(caught.value)
    assert message.startswith("y of formula")
    assert piece in message
    assert "column" in message or column is None
    assert column is None or f"at column {column})" in message
    assert "\n" not in message


UNKNOWN = {
    "foo": ("column 1", "'foo'", ""),
    "cos(lamda)": ("column 5", "'lamda'", '; did you mean "lambda"?'),
    "1 + sni(lambda)": ("column 5", "'sni'", '; did you mean "sin"?'),
    "print(1)": ("column 1", "'print'", ""),
    "eval('1')": ("column 1", "'eval'", ""),
    "__import__('os')": ("column 1", "'__import__'", ""),
    "open": ("column 1", "'open'", ""),
    "λ + radius2": ("column 5", "'radius2'", '; did you mean "radius"?'),
    "t": ("column 1", "'t'", ""),
}


@pytest.mark.parametrize("text", UNKNOWN)
def test_an_unknown_name_is_refused_with_the_known_ones(text: str) -> None:
    place, name, hint = UNKNOWN[text]
    with pytest.raises(UnknownNameError) as caught:
        curve_from_formula(text, "lambda", 0, constants={"radius": 1})
    message = str(caught.value)
    assert f"{place} of x of formula" in message
    assert f"(got {name}){hint}" in message
    assert {"lambda", "sin"} & set(caught.value.known)


def test_a_text_is_never_executed(tmp_path: Any) -> None:
    """What would leave a trace leaves none, whoever hides it where."""
    trace = tmp_path / "trace"
    call = f"__import__('pathlib').Path({str(trace)!r}).touch()"
    texts = [
        call,
        f"[{call}]",
        f"sin({call})",
        f"(lambda: {call})()",
        f"f'{{{call}}}'",
        f"1 if {call} else 2",
        f"max(1, *[{call}])",
    ]
    for text in texts:
        with pytest.raises(InputError):
            curve_from_formula(text, "lambda", 0)
        for constants in ({text: 1.0}, {"a": text}):
            with pytest.raises(InputError):
                curve_from_formula("lambda", 0, 0, constants=constants)
    assert not trace.exists()


@given(st.text(max_size=30))
def test_any_text_at_all_gives_a_curve_or_a_sentence(text: str) -> None:
    """Any other exception, or a warning, would fail this test."""
    with contextlib.suppress(InputError):
        Expression(text, ("lambda",))


@given(st.lists(st.sampled_from([*"()+-*/.,λ1e ", "**", "lambda", "sin", "(", ")", "pi"]), max_size=15))
def test_almost_a_formula_gives_a_curve_or_a_sentence(pieces: list[str]) -> None:
    with contextlib.suppress(InputError):
        Expression("".join(pieces), ("lambda",))


@pytest.mark.parametrize("text", ["", "   ", "\n", "1" * (LONGEST + 1)])
def test_an_empty_or_endless_formula_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=f"1 to {LONGEST} characters"):
        curve_from_formula(text, "lambda", 0)


@pytest.mark.parametrize(
    "text", ["(" * 900 + "1" + ")" * 900, "-" * 1900 + "1", "+".join(["1"] * 900), "sin(" * 150 + "1" + ")" * 150]
)
def test_a_deep_formula_is_refused_and_exhausts_nothing(text: str) -> None:
    with pytest.raises(InputError):
        curve_from_formula(text, "lambda", 0)


def test_the_depth_and_the_exponent_may_reach_their_limits() -> None:
    assert value("+".join(["a"] * DEEPEST), a=0.5) == pytest.approx(DEEPEST / 2)
    assert value(f"a**{LARGEST_POWER}", a=1.01) == pytest.approx(1.01**LARGEST_POWER)


@pytest.mark.parametrize("name", ["pi", "sin", "lambda", "λ", "2a", "a b", "", "a.b"])
def test_a_constant_needs_a_name_of_its_own(name: str) -> None:
    with pytest.raises(InputError, match="a name of x of formula"):
        curve_from_formula("lambda", 0, 0, constants={name: 1})


def test_a_constant_is_found_however_its_letters_are_coded() -> None:
    """The micro sign and the Greek letter mu are the same name to the parser."""
    assert curve_from_formula("lambda*µ", 0, 0, constants={"\u00b5": 2}).points(np.array([1.0]))[0, 0] == 2


BAD = {
    "no text": (lambda: curve_from_formula(None, "lambda", 0), InputError, "x of formula must be text"),
    "a truth": (lambda: curve_from_formula(True, "lambda", 0), InputError, "x of formula must be text"),
    "a list": (lambda: curve_from_formula(["lambda"], 0, 0), InputError, "x of formula must be text"),
    "NaN": (lambda: curve_from_formula(math.nan, "lambda", 0), InputError, "nan"),
    "no length": (lambda: curve_from_formula("1", "2", "3"), PathError, "regular"),
    "a parameter of no name": (lambda: curve_from_formula("1", "2", "3", parameter="1"), InputError, "a name of x"),
    "a parameter called pi": (lambda: curve_from_formula("pi", "2", "3", parameter="pi"), InputError, "a name of x"),
    "a period of a name": (
        lambda: curve_from_formula("cos(lambda)", "sin(lambda)", 0, period="2*pie"),
        UnknownNameError,
        "period",
    ),
    "a period of zero": (
        lambda: curve_from_formula("cos(lambda)", "sin(lambda)", 0, period="pi - pi"),
        InputError,
        "period",
    ),
    "an open loop": (lambda: curve_from_formula("cos(lambda)", "sin(lambda)", 0, period=6), PathError, "close"),
    "a domain of a number": (lambda: curve_from_formula("lambda", 0, 0, domain=3), ShapeError, "domain"),
    "a domain of text": (lambda: curve_from_formula("lambda", 0, 0, domain="01"), ShapeError, "domain"),
    "a domain backwards": (lambda: curve_from_formula("lambda", 0, 0, domain=(1, 0)), PathError, "domain"),
    "constants of a list": (lambda: curve_from_formula("lambda", 0, 0, constants=[1]), InputError, "constants"),
    "a constant of NaN": (lambda: curve_from_formula("lambda", 0, 0, constants={"a": math.nan}), InputError, "'a'"),
    "a constant of a constant": (
        lambda: curve_from_formula("lambda", 0, 0, constants={"a": 1, "b": "2*a"}),
        UnknownNameError,
        "constant 'b'",
    ),
    "an implicit path of lambda": (
        lambda: implicit_from_formula("x - lambda", "y", "z", (0, 0, 0)),
        UnknownNameError,
        "s1 of formula",
    ),
    "a seed of two": (lambda: implicit_from_formula("x", "y", "z", (0, 0)), ShapeError, "seed"),
    "a seed elsewhere": (lambda: implicit_from_formula("x**2 + 1", "y", "z", (0.3, 0, 0)), PathError, "seed"),
    "dependent functions": (lambda: implicit_from_formula("x", "2*x", "z", (0, 0, 0)), PathError, "independent"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_key_is_refused(case: str) -> None:
    make, error, reason = BAD[case]
    with pytest.raises(error, match=reason):
        make()


@given(numbers(-1e6, 1e6))
def test_a_number_may_be_a_number_or_a_text(number: float) -> None:
    assert value_of(number, "period") == number
    assert value_of(repr(number), "period") == number


@pytest.mark.parametrize("module", [expression, formula])
def test_the_source_runs_no_text(module: Any) -> None:
    """No evaluation, execution or compilation is in sight of a formula: `ast.parse` builds a tree and does not compile it."""
    source = Path(module.__file__).read_text(encoding="utf-8")
    assert "ast.parse" in source or module is formula
    assert [word for word in ("eval(", "exec(", "compile(", "__import__", "getattr(") if word in source] == []
