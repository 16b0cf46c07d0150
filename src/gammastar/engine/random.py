"""Random numbers by counting: any number of any flight is computed from where it stands, with no history before it.

Threefry-2x64 with 20 rounds (Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as 1, 2, 3", 2011): a bijection of two
words of 64 bits under a key of two words.  Key (seed, flight) and counter (step, channel) give the two words of a pair of numbers, so a
flight draws the same in every back end, alone and among others.  `c/random.h` is the same in lanes.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import shortened
from gammastar.errors import InputError, ShapeError

ROTATIONS = (16, 42, 12, 31, 16, 32, 24, 21)  # bits, of eight rounds that repeat
ROUNDS = 20
PARITY = 0x1BD11BDAA9FC1A22
WORDS = 2**64


def uniforms(seed: int, flights: ArrayLike, steps: ArrayLike, channels: Sequence[int]) -> np.ndarray:
    """Return uniform random numbers in (0, 1), two for each channel.

    Each is the midpoint of one of 2^52 equal parts of the interval, chosen by the upper bits of a word: neither zero nor one occurs.

    Args:
        seed: Of the whole set of flights, from 0 to 2^64 - 1.
        flights: Number of a flight, or numbers (flights,), from zero.
        steps: Numbers (steps,) of the steps, from zero.
        channels: Numbers of the pairs, from zero.

    Returns:
        (2 c, steps), or (2 c, steps, flights) for numbers of flights; rows 2 i and 2 i + 1 are the pair of channel i.
    """
    numbers = np.asarray(flights, dtype=np.uint64)
    pairs = np.asarray(channels, dtype=np.uint64).reshape(-1, *[1] * (1 + numbers.ndim))
    counts = np.asarray(steps, dtype=np.uint64).reshape(-1, *[1] * numbers.ndim)
    words = np.stack(threefry((np.uint64(checked_seed(seed)), numbers), (counts, pairs)), axis=1)
    middles = (words >> np.uint64(12)) * 2.0**-52 + 2.0**-53
    return middles.reshape(2 * len(channels), *middles.shape[2:])


def threefry(key: Sequence[ArrayLike], counter: Sequence[ArrayLike]) -> tuple[np.ndarray, np.ndarray]:
    """Return the two words that a counter of two words becomes under a key of two words, of any shapes that fit together."""
    k0, k1, x0, x1 = np.broadcast_arrays(*(np.asarray(word, dtype=np.uint64) for word in (*key, *counter)))
    keys = k0, k1, k0 ^ k1 ^ np.uint64(PARITY)
    with np.errstate(over="ignore"):  # words wrap around
        x0, x1 = x0 + k0, x1 + k1
        for done in range(ROUNDS):
            turn = ROTATIONS[done % len(ROTATIONS)]
            x0 = x0 + x1
            x1 = ((x1 << np.uint64(turn)) | (x1 >> np.uint64(64 - turn))) ^ x0
            if done % 4 == 3:
                times = done // 4 + 1
                x0, x1 = x0 + keys[times % 3], x1 + keys[(times + 1) % 3] + np.uint64(times)
    return x0, x1


def checked_seed(seed: int) -> int:
    """Return a seed, or raise `InputError`: it is a word of the key."""
    try:
        number = operator.index(seed)
    except TypeError:
        number = -1
    if not 0 <= number < WORDS:
        raise InputError(f"seed must be a whole number from 0 to 2^64 - 1 (got {shortened(seed)}); choose one in it")
    return number


def checked_flights(flights: Sequence[int] | np.ndarray | None, count: int) -> np.ndarray:
    """Return the numbers (count,) of flights, counted from zero when none are given, or raise `ShapeError`: each is a word of the key."""
    if flights is None:
        return np.arange(count)
    given = flights if isinstance(flights, np.ndarray) and flights.dtype.kind in "iu" else _words(flights)
    if given is None or given.shape != (count,) or np.any(given < 0):
        raise ShapeError(
            f"flights must be {count} whole numbers from 0 to 2^64 - 1 (got {shortened(flights)}); give one a start"
        )
    return given


def _words(numbers: Any) -> np.ndarray | None:
    """Return whole numbers as an array that holds every digit of them, or None if they are none or too large."""
    try:
        words = [operator.index(each) for each in numbers]
        return np.array(words, dtype=np.uint64 if words and max(words) >= WORDS // 2 else np.int64)
    except (TypeError, OverflowError):
        return None
