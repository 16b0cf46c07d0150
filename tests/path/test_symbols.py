"""What a user's callable may be: anything of CasADi symbols; its own errors reach its author."""

import casadi as ca
import numpy as np
import pytest

from gammastar.errors import PathError
from gammastar.path import Curve, ImplicitPath


def curve(formula) -> Curve:
    return Curve(formula)


def implicit(formula) -> ImplicitPath:
    return ImplicitPath(lambda x, y, z: y, lambda x, y, z: z, lambda x, y, z: formula(x)[0], seed=(0, 0, 0))


@pytest.mark.parametrize("path", [curve, implicit])
@pytest.mark.parametrize(
    ("formula", "error"),
    [
        (lambda s: (radius * s, 0, 0), NameError),  # noqa: F821
        (lambda s: (s + "1", 0, 0), TypeError),
        (lambda s: ({}["radius"] * s, 0, 0), KeyError),
        (lambda s: (1 / 0, 0, 0), ZeroDivisionError),
    ],
)
def test_an_error_of_the_author_passes_unchanged(path, formula, error: type[Exception]) -> None:
    with pytest.raises(error) as caught:
        path(formula)
    assert caught.traceback[-1].path.name == "test_symbols.py"


@pytest.mark.parametrize("path", [curve, implicit])
@pytest.mark.parametrize(
    ("formula", "reason"),
    [
        (lambda s: (s if s > 0 else -s, 0, 0), "truth value"),
        (lambda s: (max(s, 0), 0, 0), "truth value"),
        (lambda s: (ca.sin(None), 0, 0), "Wrong number or type of arguments"),
        (lambda s: (ca.mtimes(ca.SX(2, 3), ca.SX(2, 3)), 0, 0), "Matrix product with incompatible dimensions"),
        (lambda s: ("deep", s, s), "got str"),
        (lambda s: (None, s, s), "got NoneType"),
    ],
)
def test_what_does_not_work_on_symbols_is_refused_in_one_sentence(path, formula, reason: str) -> None:
    with pytest.raises(PathError, match=reason) as caught:
        path(formula)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 250
    assert caught.value.__cause__ is not None


def test_a_column_a_list_and_an_array_of_symbols_are_three_scalars() -> None:
    for formula in (
        lambda s: ca.vertcat(s, 1, ca.sin(s)),
        lambda s: [s, 1, ca.sin(s)],
        lambda s: np.array([s, 1, ca.sin(s)]),
    ):
        assert Curve(formula).points(np.array([0.5]))[0] == pytest.approx([0.5, 1, np.sin(0.5)], abs=1e-15)
