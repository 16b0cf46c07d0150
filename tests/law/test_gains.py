"""Poles in, gains out: the characteristic polynomial is the law."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gammastar.errors import GammastarError, PoleError
from gammastar.law.gains import chain_poles, companion, gains_from_poles, without_slowest
from strategies import stable_poles


@pytest.mark.parametrize("count", [1, 2, 3, 4])
@given(st.data())
def test_every_pole_is_a_root_of_the_characteristic_polynomial(count: int, data: st.DataObject) -> None:
    """s^n + k_n s^(n-1) + ... + k_1 vanishes at the poles, and all n roots are poles (product and sum agree)."""
    poles = np.array(data.draw(stable_poles(count)), dtype=complex)
    gains = gains_from_poles(poles)
    assert gains.shape == (count,)
    assert gains.dtype == float
    for pole in poles:
        terms = np.append(gains, 1.0) * pole ** np.arange(count + 1)
        assert abs(terms.sum()) <= 1e-13 * np.abs(terms).sum()
    assert gains[0] == pytest.approx(np.prod(-poles).real, rel=1e-12)
    assert gains[-1] == pytest.approx(np.sum(-poles).real, rel=1e-12)
    assert np.all(gains > 0)  # necessary for stability, and what the paper asks of them


@given(stable_poles(4))
def test_the_chain_has_the_poles_as_eigenvalues(poles: list[complex]) -> None:
    """Roots of multiplicity m feel rounding as its m-th root: 1e-14 becomes 3e-4 for four equal poles."""
    size = np.abs(poles).max()
    found = np.linalg.eigvals(companion(gains_from_poles(poles)) / 1.0)
    for pole in poles:
        nearest = int(np.argmin(np.abs(found - pole)))
        assert abs(found[nearest] - pole) <= 5e-3 * size
        found = np.delete(found, nearest)


def test_distinct_poles_are_eigenvalues_to_rounding() -> None:
    for poles in ([-1, -2, -3, -4], [-1 + 2j, -1 - 2j, -0.5, -7]):
        found = np.linalg.eigvals(companion(gains_from_poles(poles)))
        assert np.sort_complex(found) == pytest.approx(np.sort_complex(np.array(poles, complex)), abs=1e-12)


def test_textbook_gains() -> None:
    """(s + 2)^4 = s^4 + 8 s^3 + 24 s^2 + 32 s + 16; (s + 1)((s + 3)^2 + 4) = s^3 + 7 s^2 + 19 s + 13."""
    assert gains_from_poles([-2] * 4).tolist() == [16, 32, 24, 8]
    assert gains_from_poles([-3 + 2j, -1, -3 - 2j]) == pytest.approx([13, 19, 7])
    assert gains_from_poles(-2.5).tolist() == [2.5]


def test_the_published_gains_of_the_sibling_controller_come_from_its_poles() -> None:
    """safe_multiquad_pf: gains 200, 400, 90, 30 have the poles -0.56, -1.11 +- 3.46i, -27.2 (printed to three digits)."""
    gains = gains_from_poles([-0.5596, -1.114 + 3.464j, -1.114 - 3.464j, -27.21])
    assert gains == pytest.approx([200, 400, 90, 30], rel=1e-2)
    assert gains_from_poles([-2, -2, -2]).tolist() == [8, 12, 6]


@given(st.permutations([-1 + 2j, -1 - 2j, -3, -3]))
def test_the_order_of_poles_does_not_matter(poles: list[complex]) -> None:
    assert gains_from_poles(poles) == pytest.approx(gains_from_poles([-1 + 2j, -1 - 2j, -3, -3]), rel=1e-14)


def test_repeated_pairs_are_accepted() -> None:
    assert gains_from_poles([-1 + 1j, -1 - 1j] * 2) == pytest.approx([4, 8, 8, 4])


BAD = {
    "unstable": ([-1, -2, 0.1], "negative real parts"),
    "marginal": ([-1, 0], "negative real parts"),
    "marginal pair": ([1j, -1j], "negative real parts"),
    "a lone complex pole": ([-1 + 1j, -2], "conjugate"),
    "a wrong partner": ([-1 + 1j, -1 - 1.1j], "conjugate"),
    "twice the same half": ([-1 + 1j, -1 + 1j], "conjugate"),
    "NaN": ([-1, np.nan], "finite"),
    "infinite": ([-np.inf], "finite"),
    "none": ([], "at least one"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_poles_are_refused(case: str) -> None:
    poles, reason = BAD[case]
    with pytest.raises(PoleError, match=reason) as caught:
        gains_from_poles(poles)
    assert isinstance(caught.value, GammastarError)


def test_one_pole_is_repeated_and_a_list_is_taken_as_it_is() -> None:
    assert chain_poles(-2, 4, "transverse") == (-2, -2, -2, -2)
    assert chain_poles([-1, -2 + 1j, -2 - 1j], 3, "speed") == (-1, -2 + 1j, -2 - 1j)
    assert all(type(pole) is complex for pole in chain_poles(np.array([-1.0, -2.0]), 2, "chain"))


@pytest.mark.parametrize("poles", [[-1, -2], [[-1, -2], [-3, -4]], [], "fast"], ids=repr)
def test_the_number_of_poles_fits_the_chain(poles: object) -> None:
    with pytest.raises(PoleError, match="transverse poles must be"):
        chain_poles(poles, 4, "transverse")


def test_without_its_slowest_pole_a_set_stays_a_set_of_poles() -> None:
    """A real slowest pole is dropped; of a complex pair the common real part stays."""
    assert without_slowest([-3, -1.5, -2, -4]) == (-3, -2, -4)
    assert sorted(without_slowest([-1 + 2j, -3, -1 - 2j, -4]), key=abs) == [-1, -3, -4]
    assert sorted(without_slowest([-1 + 2j, -1 - 2j, -1 + 2j, -1 - 2j]), key=lambda p: p.imag) == [-1 - 2j, -1, -1 + 2j]


def test_of_equal_poles_one_only_is_dropped() -> None:
    pole = complex(-2)
    assert without_slowest([pole, pole, pole, pole]) == (-2, -2, -2)


@given(stable_poles(4))
def test_what_is_left_is_stable_and_complete(poles: list[complex]) -> None:
    rest = without_slowest([complex(pole) for pole in poles])
    assert len(rest) == 3
    assert len(gains_from_poles(rest)) == 3
    assert max(pole.real for pole in rest) <= max(pole.real for pole in poles)
