"""Random numbers by counting: the published words, uniform, and each from where it stands alone."""

from __future__ import annotations

import numpy as np
import pytest

from gammastar import engine
from gammastar.engine.random import threefry
from gammastar.errors import InputError

ONES = 2**64 - 1
PUBLISHED = [  # (counter, key, words), from the file kat_vectors of Random123, "threefry2x64 20"
    ((0, 0), (0, 0), (0xC2B6E3A8C2C69865, 0x6F81ED42F350084D)),
    ((ONES, ONES), (ONES, ONES), (0xE02CB7C4D95D277A, 0xD06633D0893B8B68)),
    (
        (0x243F6A8885A308D3, 0x13198A2E03707344),
        (0xA4093822299F31D0, 0x082EFA98EC4E6C89),
        (0x263C7D30BB0F0AF1, 0x56BE8361D3311526),
    ),
]


@pytest.mark.parametrize(("counter", "key", "words"), PUBLISHED)
def test_words_are_the_published_ones(counter: tuple[int, int], key: tuple[int, int], words: tuple[int, int]) -> None:
    assert tuple(map(int, threefry(key, counter))) == words


def test_a_pair_is_made_from_the_words_of_its_seed_flight_step_and_channel() -> None:
    """The upper 52 bits of a word choose the part of (0, 1) whose midpoint is drawn."""
    found = engine.uniforms(7, [3, 5], [0, 10, 20], (4, 2))
    assert found.shape == (4, 3, 2)
    for channel, row in ((4, 0), (2, 2)):
        words = [int(word) for word in threefry((7, 5), (20, channel))]
        assert found[row : row + 2, 2, 1].tolist() == [((word >> 12) + 0.5) * 2.0**-52 for word in words]


def test_numbers_of_flights_keep_every_digit() -> None:
    """Small ones beside large ones too, of which NumPy makes doubles."""
    for numbers in ([2**53, 2**53 + 1], [2**63, 2**63 - 1], np.array([3, 4], np.uint32), [2**64 - 1, 0]):
        assert engine.checked_flights(numbers, 2).tolist() == list(numbers)


def test_a_number_does_not_depend_on_what_is_drawn_beside_it() -> None:
    every = engine.uniforms(1, np.arange(6), np.arange(50), (0, 1, 2))
    assert np.array_equal(engine.uniforms(1, 4, np.arange(20, 30), (1,)), every[2:4, 20:30, 4])
    assert engine.uniforms(1, 4, np.arange(20, 30), ()).shape == (0, 10)
    assert not np.isin(engine.uniforms(2, np.arange(6), np.arange(50), (0, 1, 2)), every).any()


def test_numbers_are_uniform_and_do_not_go_with_each_other() -> None:
    """Mean 1/2 and variance 1/12 to five standard errors of 600,000 numbers; so do correlations with neighbours vanish."""
    drawn = engine.uniforms(0, np.arange(100), np.arange(1000), (0, 1, 2))
    count = drawn.size
    assert abs(drawn.mean() - 1 / 2) < 5 * np.sqrt(1 / 12 / count)
    assert abs(drawn.var() - 1 / 12) < 5 * np.sqrt(1 / 180 / count)
    about = drawn - 1 / 2
    for axis in range(3):
        together = (about * np.roll(about, 1, axis)).mean() * 12
        assert abs(together) < 5 / np.sqrt(count)
    assert drawn.min() > 0
    assert drawn.max() < 1


def test_the_smallest_and_the_largest_number_lie_inside(monkeypatch) -> None:
    monkeypatch.setattr("gammastar.engine.random.threefry", lambda key, counter: np.array([[[0]], [[ONES]]], np.uint64))
    low, high = engine.uniforms(0, 0, [0], (0,))[:, 0]
    assert 0 < low < 2.0**-52
    assert 1 - 2.0**-52 < high < 1


@pytest.mark.parametrize("seed", [-1, 2**64, 1.5, "one"])
def test_a_seed_is_a_word(seed: object) -> None:
    engine.uniforms(2**64 - 1, 0, [0], (0,))
    with pytest.raises(InputError, match=r"seed must be a whole number from 0 to 2\^64 - 1 \(got"):
        engine.uniforms(seed, 0, [0], (0,))
