"""The public edge: what is a number, what is a vector, and the errors that answer for the rest."""

from __future__ import annotations

import builtins
import inspect

import numpy as np
import pytest
from hypothesis import given

from gammastar import errors
from gammastar.checks import LARGEST, array, direction, magnitude, magnitudes, number, shortened, whole
from gammastar.errors import GammastarError, InputError, ShapeError, UnknownNameError
from strategies import numbers, vectors


@given(numbers(-1e6, 1e6))
def test_a_finite_number_passes_unchanged(value: float) -> None:
    for given_as in (value, np.float64(value), np.array(value)):
        found = number(given_as, "length [m]")
        assert type(found) is float
        assert found == value


@pytest.mark.parametrize("value", [None, "one", [1.0, 2.0], 1j, {}, object], ids=repr)
def test_what_is_no_number_is_refused_by_name(value: object) -> None:
    with pytest.raises(InputError, match=r"length \[m\] must be a number \(got .*\); give"):
        number(value, "length [m]")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_number_is_finite(value: object) -> None:
    with pytest.raises(InputError, match="must be finite"):
        number(value, "length [m]")


def test_a_bound_above_excludes_itself_and_at_least_includes_itself() -> None:
    assert number(1e-300, "mass", above=0) == 1e-300
    assert number(0, "gravity", at_least=0) == 0
    with pytest.raises(InputError, match=r"greater than 0 \(got 0\)"):
        number(0.0, "mass", above=0)
    with pytest.raises(InputError, match=r"at least 0 \(got -1e-09\)"):
        number(-1e-9, "gravity", at_least=0)


@pytest.mark.parametrize("value", [1e300, -1e300, 2 * LARGEST])
def test_a_magnitude_can_be_multiplied(value: float) -> None:
    """Below `LARGEST` in size; what must be above zero is not next to nothing either, so that its inverse can be too."""
    for check in (magnitude, lambda value, name: magnitudes([value, 0], name, (2,))):
        with pytest.raises(InputError, match=r"pitch \[m\] must be between -1e\+50 and 1e\+50"):
            check(value, "pitch [m]")
    with pytest.raises(
        InputError, match=r"radius \[m\] must be between 1e-50 and 1e\+50 \(got 1e-300\); check its unit"
    ):
        magnitude(1e-300, "radius [m]", above=0)
    assert magnitude(1e-300, "pitch [m]") == 1e-300
    assert magnitudes([-1e9, 1], "position", (2,)).tolist() == [-1e9, 1]


def test_a_message_shows_lists_for_tuples() -> None:
    assert shortened(((1, 2), [(3,)])) == "[[1, 2], [[3]]]"


def test_a_whole_number_counts_from_zero() -> None:
    assert [whole(value, "laps") for value in (0, 3, 2.0, np.int64(7))] == [0, 3, 2, 7]
    assert all(type(whole(value, "laps")) is int for value in (3, 3.0))
    assert [whole(value, "seed") for value in (2**53 + 1, np.uint64(2**64 - 1))] == [2**53 + 1, 2**64 - 1]
    for value, reason in ((0.5, "a whole number"), (-1, "at least 0"), (np.nan, "finite"), ("many", "a number")):
        with pytest.raises(InputError, match=f"laps must be {reason}"):
            whole(value, "laps")


@given(vectors(1e3))
def test_an_array_passes_as_a_read_only_copy(values: np.ndarray) -> None:
    found = array(values, "position", (3,))
    assert np.array_equal(found, values)
    assert not found.flags.writeable
    values[0] = 12345.0
    assert found[0] != 12345.0


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ([1, 2], r"shape \(3,\) \(got \(2,\)\)"),
        ([[1, 2, 3]], r"shape \(3,\)"),
        (1.0, r"shape \(3,\) \(got \(\)\)"),
        ([1, np.nan, 3], "must be finite"),
        ([1, 2, np.inf], "must be finite"),
        ([1, "x", 3], "must be numbers"),
        ([[1], [2, 3]], "must be numbers"),
        (None, "shape|finite"),
        ([1j, 0, 0], "must be numbers"),
    ],
)
def test_an_array_has_its_shape_and_finite_numbers(value: object, reason: str) -> None:
    with pytest.raises(ShapeError, match=f"position .*{reason}|position must.*{reason}"):
        array(value, "position", (3,))


@given(vectors(1e3).filter(lambda v: np.linalg.norm(v) > 1e-6))
def test_a_direction_is_the_unit_vector_of_its_line(vector: np.ndarray) -> None:
    found = direction(vector, "normal")
    assert np.linalg.norm(found) == pytest.approx(1, abs=1e-15)
    assert np.cross(found, vector) == pytest.approx(np.zeros(3), abs=1e-13 * np.linalg.norm(vector))
    assert found @ vector > 0


def test_the_zero_vector_has_no_direction() -> None:
    with pytest.raises(InputError, match="normal must not be zero"):
        direction([0, 0, 0], "normal")


# --- the errors themselves -------------------------------------------------------------------------------------------

ERRORS = [
    value
    for _, value in inspect.getmembers(errors, inspect.isclass)
    if value.__module__ == errors.__name__ and not issubclass(value, Warning)
]


@pytest.mark.parametrize("error", [e for e in ERRORS if e is not GammastarError], ids=lambda e: e.__name__)
def test_every_error_is_ours_and_a_fitting_builtin(error: type[Exception]) -> None:
    assert issubclass(error, GammastarError)
    assert any(
        getattr(builtins, base.__name__, None) is base for base in error.__mro__ if base not in (Exception, object)
    )


def test_an_unknown_name_lists_the_known_ones_and_suggests_a_close_one() -> None:
    error = UnknownNameError("integrator", "rk5", ["rkmk4", "rk4"])
    assert str(error) == "integrator must be one of rk4, rkmk4 (got 'rk5'); did you mean \"rk4\"?"
    assert (error.name, error.known) == ("rk5", ["rk4", "rkmk4"])
    assert "did you mean" not in str(UnknownNameError("integrator", "xyzzy", ["rkmk4", "rk4"]))


def test_a_missing_extra_names_the_command_that_brings_it() -> None:
    error = errors.MissingExtraError("matplotlib", "figures", "drawing a flight")
    assert isinstance(error, ImportError)
    assert "pip install 'gammastar[figures]'" in str(error)
    assert (error.library, error.extra) == ("matplotlib", "figures")
