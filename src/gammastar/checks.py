"""Checks at the public edge: a number or vector comes in; a finite one goes on, or one sentence comes back."""

from __future__ import annotations

from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike

from gammastar.errors import InputError, ShapeError

LONGEST_SHOWN = 60  # characters of a value in a message
LARGEST = (
    1e50  # of a length, a mass and the like: products of several are still finite, and so are those of their inverses
)


def number(value: object, name: str, *, above: float | None = None, at_least: float | None = None) -> float:
    """Return a finite float, optionally bounded from below, or raise `InputError` naming it."""
    try:
        if isinstance(value, (bool, np.bool_, str, bytes)):
            raise TypeError("a truth value or a text is no number")
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name} must be a number (got {shortened(value)}); give one finite number") from error
    if not np.isfinite(result):
        raise InputError(f"{name} must be finite (got {result}); give a finite number")
    if above is not None and result <= above:
        raise InputError(f"{name} must be greater than {above:g} (got {result:g}); raise it")
    if at_least is not None and result < at_least:
        raise InputError(f"{name} must be at least {at_least:g} (got {result:g}); raise it")
    return result


def magnitude(value: object, name: str, *, above: float | None = None, at_least: float | None = None) -> float:
    """Return a number as `number` does, and refuse one that no computation stands: above `LARGEST`, or above zero by next to nothing."""
    result = number(value, name, above=above, at_least=at_least)
    least = 1 / LARGEST if above == 0 else -LARGEST
    if not least <= result <= LARGEST:
        raise InputError(f"{name} must be between {least:g} and {LARGEST:g} (got {result:g}); check its unit")
    return result


def whole(value: object, name: str, at_least: int = 0, at_most: int | None = None) -> int:
    """Return a whole number, one of Python's own to its last digit, or raise `InputError` naming it."""
    result = number(value, name, at_least=at_least)
    if not isinstance(value, Integral) and result != int(result):
        raise InputError(f"{name} must be a whole number (got {result:g}); round it")
    if at_most is not None and result > at_most:
        raise InputError(f"{name} must be at most {at_most:,} (got {result:g}); lower it")
    return int(value) if isinstance(value, Integral) else int(result)


def array(value: ArrayLike, name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return a finite float array of one shape, read-only, or raise `ShapeError` naming it."""
    try:
        if np.iscomplexobj(value):
            raise TypeError("complex numbers would lose their imaginary part")
        result = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise ShapeError(
            f"{name} must be numbers of shape {shape} (got {shortened(value)}); give numbers only"
        ) from error
    if result.shape != shape:
        raise ShapeError(f"{name} must have shape {shape} (got {result.shape}); check the number of entries")
    if not np.all(np.isfinite(result)):
        raise ShapeError(f"{name} must be finite (got {result.tolist()}); replace NaN and infinity")
    result.setflags(write=False)
    return result


def magnitudes(value: ArrayLike, name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return numbers as `array` does, and refuse those whose size is above `LARGEST`."""
    result = array(value, name, shape)
    if np.any(np.abs(result) > LARGEST):
        raise InputError(
            f"{name} must be between {-LARGEST:g} and {LARGEST:g} (got {(result + 0.0).tolist()}); check its unit"
        )
    return result


def row(value: ArrayLike, name: str) -> np.ndarray:
    """Return finite floats (n,) from one number or a row of them, or raise `ShapeError` naming it."""
    shape = shape_of(value)
    return array(np.repeat(value, 1) if shape == () else value, name, shape[:1] if shape else (1,))


def truth(value: object, name: str) -> bool:
    """Return a truth value, or raise `InputError` naming it: a text such as 'no' would count as true."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} must be True or False (got {shortened(value)}); give one of the two")
    return bool(value)


def three(value: ArrayLike, name: str) -> np.ndarray:
    """Return a finite float array (3,) from one number for all axes or from three, or raise `ShapeError` naming it."""
    return array(np.repeat(value, 3) if shape_of(value) == () else value, name, (3,))


def shape_of(value: ArrayLike) -> tuple[int, ...] | None:
    """Return the shape of nested numbers, or None when their rows differ in length."""
    try:
        return np.shape(value)
    except ValueError:
        return None


def direction(value: ArrayLike, name: str) -> np.ndarray:
    """Return a unit vector (3,), or raise when it is zero."""
    vector = array(value, name, (3,))
    length = float(np.linalg.norm(vector))
    if length < 1e-12:
        raise InputError(f"{name} must not be zero (got {vector.tolist()}); give a direction")
    return np.asarray(vector / length)


def instance(value: object, kinds: type | tuple[type, ...], name: str, remedy: str) -> None:
    """Raise `InputError` unless a value is of one of the kinds; `remedy` says what makes one."""
    if not isinstance(value, kinds):
        wanted = " or ".join(kind.__name__ for kind in (kinds if isinstance(kinds, tuple) else (kinds,)))
        raise InputError(f"{name} must be a {wanted} (got {type(value).__name__}); {remedy}")


def shortened(value: object) -> str:
    """Return a value as a message shows it: one line of a bounded length, with lists for tuples."""
    try:
        text = repr(_listed(value))
    except ValueError:  # an integer of more digits than Python prints
        return "a number of very many digits"
    return text if len(text) <= LONGEST_SHOWN else text[:LONGEST_SHOWN] + " ..."


def _listed(value: object) -> object:
    """Return nested tuples as lists, which is how missions write them."""
    return [_listed(each) for each in value] if isinstance(value, (list, tuple)) else value
