"""What a path is held to when it is made: it moves on everywhere, between samples too, and has five derivatives."""

import casadi as ca
import numpy as np
import pytest

from gammastar.errors import PathError
from gammastar.path import Curve, ImplicitPath
from gammastar.path import catalogue as paths

GOOD = {
    "first": lambda x, y, z: y - x**2,
    "second": lambda x, y, z: z,
    "coordinate": lambda x, y, z: x,
    "seed": (0.0, 0.0, 0.0),
}


@pytest.mark.parametrize(
    ("formula", "options", "reason"),
    [
        (lambda s: (s, ca.fabs(s - 0.2), 0), {}, "a corner at parameter 0.2 "),
        (lambda s: (s, ca.fmin(s, 0.123), 0), {}, "a corner at parameter 0.123 "),
        (lambda s: (s, ca.if_else(s > 0.123, 1, 0), 0), {}, "a gap at parameter 0.123 "),
        (lambda s: (s, ca.fmax(s - 0.123, 0) ** 5, 0), {}, "a jump of the fifth derivative at parameter 0.123 "),
        (lambda s: (s, ca.sqrt((s - 0.2) ** 2), 0), {}, "a corner at parameter 0.2 "),
        (lambda s: (s, ca.acos(ca.cos(s)), 0), {"domain": (1, 5)}, "at parameter 3.14159 "),
        (lambda s: (s, ca.atan2(ca.sin(s), ca.cos(s)), 0), {"domain": (1, 5)}, "a gap at parameter 3.14159 "),
        (lambda s: (s, 1 / (s - 0.123), 0), {}, "at parameter 0.123 "),
        (lambda s: (ca.sin(s / 2), ca.sin(s), 0), {"period": 2 * np.pi}, "a corner at parameter 0 "),
    ],
)
def test_a_curve_with_a_kink_is_refused_with_the_place(formula, options, reason: str) -> None:
    with pytest.raises(PathError, match=reason):
        Curve(formula, **options)


@pytest.mark.parametrize(
    "formula",
    [
        lambda s: (s, ca.fmax(s - 0.123, 0) ** 6, 0),
        lambda s: (s, ca.if_else(s > 0.123, (s - 0.123) ** 6, 0), 0),
        lambda s: (s, ca.fabs(s - 50), 0),
        lambda s: (s, 1 / (1 + s**2), ca.sqrt(4 + ca.sin(s))),
    ],
)
def test_a_curve_of_class_c5_is_not(formula) -> None:
    """Six derivatives where it switches, none in the domain where it would bend, a quotient and a root without zeros."""
    Curve(formula)


@pytest.mark.parametrize(
    ("first", "reason"),
    [
        (lambda x, y, z: y - ca.fabs(x - 0.3), r"a corner or a gap at \[0.3, 0.0, 0.0\]"),
        (lambda x, y, z: y - ca.if_else(x > 1, 2, 1), r"a corner or a gap at \[1.0, 1.0, 0.0\]"),
        (lambda x, y, z: y - ca.fabs(x - 0.3) ** 3, "a jump of the third derivative at parameter 0.3 "),
    ],
)
def test_an_implicit_path_with_a_kink_is_refused_with_the_place(first, reason: str) -> None:
    with pytest.raises(PathError, match=reason):
        ImplicitPath(**GOOD | {"first": first})


def test_an_implicit_path_of_class_c5_is_not() -> None:
    ImplicitPath(**GOOD | {"first": lambda x, y, z: y - ca.fmax(x - 0.3, 0) ** 6})


@pytest.mark.parametrize("place", [0.1234, -0.517, 3.3, 1e-5])
@pytest.mark.parametrize("powers", [(2, 3), (3, 3), (3, 5)])
def test_a_standstill_between_samples_is_seen(place: float, powers: tuple[int, int]) -> None:
    with pytest.raises(PathError, match=rf"zero speed at parameter {place:.6g}, point \[0.0, 0.0, 0.0\]"):
        Curve(lambda s: ((s - place) ** powers[0], (s - place) ** powers[1], 0))


def test_a_slow_place_is_no_standstill() -> None:
    """A trochoid at a thousandth of its mean speed."""
    Curve(lambda s: (s - 0.999 * ca.sin(s), 1 - 0.999 * ca.cos(s), 0))


def test_shapes_of_the_catalogue_need_no_search_for_kinks() -> None:
    for name in set(paths.__all__) - {"polynomial"}:
        assert not getattr(paths, name)().with_data().template.may_bend, name
    cubic = paths.polynomial([[0, 1], [0, 0, 0, 1], [2]])
    assert not cubic.with_data().template.may_bend
