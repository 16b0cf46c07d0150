"""Paths written as formulas: a curve in its parameter, or s1, s2 and pi in x, y, z; text is read, never executed."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import ArrayLike

from gammastar.checks import shortened
from gammastar.errors import InputError, ShapeError
from gammastar.path.curve import DOMAIN, Curve
from gammastar.path.expression import Expression, value_of
from gammastar.path.implicit import ImplicitPath

AXES = ("x", "y", "z")


def curve_from_formula(
    x: float | str,
    y: float | str,
    z: float | str,
    parameter: str = "lambda",
    period: float | str | None = None,
    domain: ArrayLike | tuple[float | str, float | str] | None = None,
    ends: ArrayLike | tuple[float | str, float | str] | None = None,
    constants: Mapping[str, float | str] | None = None,
    name: str = "formula",
) -> Curve:
    """Return the curve (x, y, z) [m], world, with each coordinate a formula in one parameter, as `Expression` reads it.

    Args:
        x: A formula such as '2*cos(lambda)', or a number.
        y: Likewise.
        z: Likewise; the third axis points down.
        parameter: What the formulas call the parameter; λ is the same as lambda.
        period: Of the parameter, for a closed curve; a number or a formula without variables, such as '2*pi'.
        domain: (2,) where an open curve is checked, searched first, and drawn, by default -10 to 10; numbers or formulas.
        ends: (2,) of an open curve that ends, in place of its domain: a flight stops there; likewise.
        constants: Further names that the formulas may use, with their values; likewise.
        name: How messages call the curve.
    """
    if domain is not None and ends is not None:
        raise InputError(
            f"{name} must have a domain or ends (got {shortened(domain)} and {shortened(ends)}); give one of them"
        )
    values = _constants(constants, name)
    coordinates = [
        Expression(_as_text(text), (parameter,), values, f"{axis} of {name}")
        for axis, text in zip(AXES, (x, y, z), strict=True)
    ]
    return Curve(
        functools.partial(_point, coordinates),
        period=_period(period, values, name),
        name=name,
        domain=DOMAIN if domain is None else _pair(domain, f"domain of {name}", values),
        ends=None if ends is None else _pair(ends, f"ends of {name}", values),
    )


def implicit_from_formula(
    s1: str,
    s2: str,
    pi: str,
    seed: ArrayLike | tuple[float | str, float | str, float | str],
    period: float | str | None = None,
    domain: ArrayLike | tuple[float | str, float | str] = (-10.0, 10.0),
    constants: Mapping[str, float | str] | None = None,
    name: str = "formula",
) -> ImplicitPath:
    """Return the path s1 = s2 = 0 with the coordinate pi along it, each a formula in x, y, z [m], world, Eqs. (10), (13).

    In the formulas pi is the number; the coordinate has no name there.

    Args:
        s1: A formula that vanishes on the path, such as 'sqrt(x**2 + y**2) - 1'.
        s2: Another one.
        pi: A formula that grows along the path, such as 'atan2(y, x)'.
        seed: (3,) [m], a point on the path or near it; numbers or formulas without variables.
        period: Of pi on a closed path, '2*pi' for an angle; likewise.
        domain: (2,) of pi, where an open path is drawn; likewise.
        constants: Further names that the formulas may use, with their values; likewise.
        name: How messages call the path.
    """
    values = _constants(constants, name)
    first, second, along = (
        Expression(_as_text(text), AXES, values, f"{role} of {name}")
        for role, text in (("s1", s1), ("s2", s2), ("pi", pi))
    )
    x, y, z = _values(seed, 3, f"seed of {name}", values)
    return ImplicitPath(
        first,
        second,
        along,
        seed=(x, y, z),
        period=_period(period, values, name),
        name=name,
        domain=_pair(domain, f"domain of {name}", values),
    )


def _point(coordinates: Sequence[Expression], symbol: Any) -> tuple[Any, ...]:
    """Graph: return the value of each coordinate."""
    return tuple(coordinate(symbol) for coordinate in coordinates)


def _as_text(formula: float | str) -> str:
    """Return a formula as text; a plain number is one too."""
    is_number = isinstance(formula, (int, float)) and not isinstance(formula, bool)
    return repr(formula) if is_number else formula  # type: ignore[return-value]


def _constants(constants: Mapping[str, float | str] | None, name: str) -> dict[str, float]:
    if constants is not None and not isinstance(constants, Mapping):
        raise InputError(f"constants of {name} must be names with values (got {shortened(constants)}); give a table")
    return {
        str(key): value_of(value, f"constant {shortened(key)} of {name}") for key, value in (constants or {}).items()
    }


def _period(period: float | str | None, constants: dict[str, float], name: str) -> float | None:
    return None if period is None else value_of(period, f"period of {name}", constants)


def _pair(given: Any, name: str, constants: dict[str, float]) -> tuple[float, float]:
    low, high = _values(given, 2, name, constants)
    return low, high


def _values(values: Any, count: int, name: str, constants: dict[str, float]) -> tuple[float, ...]:
    try:
        entries = list(values) if not isinstance(values, str) else []
    except TypeError:
        entries = []
    if len(entries) != count:
        raise ShapeError(
            f"{name} must be a list of {count} numbers (got {shortened(values)}); check the number of entries"
        )
    return tuple(value_of(entry, name, constants) for entry in entries)
