"""Poles in, gains out: the error chains of Eqs. (25), (26) with prescribed closed-loop poles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import shortened
from gammastar.errors import PoleError

CONJUGATE_TOLERANCE = 1e-9  # relative distance at which two poles still count as a conjugate pair


def gains_from_poles(poles: ArrayLike) -> np.ndarray:
    """Return (k_1, ..., k_n) of y^(n) = -sum k_i y^(i-1) whose characteristic roots are the poles [1/s].

    Any stable set closed under conjugation is accepted, repeated poles and complex pairs included.

    Raises:
        PoleError: A pole is not finite, not strictly in the left half plane, or lacks its conjugate.
    """
    roots = np.asarray(poles, dtype=complex).ravel()
    if not roots.size:
        raise PoleError("poles must be at least one number (got none); give one pole per state of the chain")
    if not np.all(np.isfinite(roots)):
        raise PoleError(f"poles must be finite (got {describe(roots)}); replace NaN and infinity")
    if np.any(roots.real >= 0):
        raise PoleError(
            f"poles must have negative real parts (got {describe(roots)}); move them into the left half plane"
        )
    size = np.abs(roots).max()
    unpaired = list(roots[np.abs(roots.imag) > CONJUGATE_TOLERANCE * size])
    while unpaired:
        pole = unpaired.pop()
        partner = min(unpaired, key=lambda other: abs(other - pole.conjugate()), default=None)
        if partner is None or abs(partner - pole.conjugate()) > CONJUGATE_TOLERANCE * size:
            raise PoleError(
                f"complex poles must come in conjugate pairs (got {describe(roots)}); add the missing conjugate"
            )
        unpaired.remove(partner)
    coefficients = np.real(np.poly(roots))
    gains = coefficients[:0:-1].copy()
    gains.setflags(write=False)
    return gains


def companion(gains: np.ndarray) -> np.ndarray:
    """Return the matrix A of the chain y' = A y with these gains in its last row."""
    matrix = np.diag(np.ones(len(gains) - 1), 1)
    matrix[-1, :] = -gains
    return matrix


def chain_poles(poles: complex | Sequence[complex], count: int, chain: str) -> tuple[complex, ...]:
    """Return `count` poles: one number is repeated, a sequence is taken as it is.

    Raises:
        PoleError: The number of poles does not fit the chain.
    """
    try:
        values = np.asarray(poles, dtype=complex)
    except (TypeError, ValueError, OverflowError) as error:
        raise PoleError(f"{chain} poles must be numbers (got {shortened(poles)}); give one, or {count}") from error
    if values.ndim == 0:
        values = np.full(count, values)
    if values.shape != (count,):
        raise PoleError(
            f"{chain} poles must be one number or {count} (got {values.size}); the chain has {count} states"
        )
    return tuple(complex(value) for value in values)


def without_slowest(poles: Sequence[complex]) -> tuple[complex, ...]:
    """Return the poles less the slowest: a real one is dropped, of a complex pair the common real part stays."""
    rest = list(poles)
    slowest = rest.pop(max(range(len(rest)), key=lambda k: rest[k].real))
    if slowest.imag == 0:
        return tuple(rest)
    rest.pop(min(range(len(rest)), key=lambda k: abs(rest[k] - slowest.conjugate())))
    return (*rest, complex(slowest.real))


def describe(poles: np.ndarray) -> str:
    """Return poles as a readable list."""
    return ", ".join(f"{p.real:g}" if p.imag == 0 else f"{p.real:g}{p.imag:+g}i" for p in poles)
