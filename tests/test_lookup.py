"""Tables: numbers and graph agree at joints, beyond the ends and round a period; one table may be looked up at what another one tells."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from gammastar.errors import InputError
from gammastar.lookup import Lookup, Table, graph_at, numbers_at, the_key

BEGINS = np.array([0.5, 1.0, 2.5])
ROWS = np.array([[0.5, 10.0], [1.0, 20.0], [2.5, 30.0]])


def test_a_row_holds_from_its_begin_on() -> None:
    found = Table(BEGINS, ROWS).at(np.array([-3.0, 0.5, 0.999, 1.0, 2.4, 2.5, 99.0]))
    np.testing.assert_array_equal(found[1], [10, 10, 10, 20, 20, 30, 30])


def test_a_period_adds_its_shifts() -> None:
    table = Table(BEGINS, ROWS, period=3.0, shifts=np.array([3.0, 0.0]))
    found = table.at(np.array([0.4, 3.4, 3.5, -2.1]))
    np.testing.assert_allclose(found, [[-0.5, 2.5, 3.5, -2.5], [30, 30, 10, 10]])


@pytest.mark.parametrize(
    ("begins", "rows", "more", "said"),
    [
        (BEGINS[:2], ROWS, {}, "a begin for each row"),
        (BEGINS[:0], ROWS[:0], {}, "a begin for each row"),
        (BEGINS, ROWS[:, 0], {}, "a begin for each row"),
        (BEGINS, ROWS, {"shifts": np.zeros(3)}, "a shift for each column"),
        (BEGINS[::-1], ROWS, {}, "must grow"),
        (np.array([0.5, np.nan, 2.5]), ROWS, {}, "must grow"),
        (np.array([np.nan]), ROWS[:1], {}, "must grow"),
        (BEGINS, ROWS, {"period": 0.0}, "must be positive"),
        (BEGINS, ROWS, {"period": np.nan}, "must be positive"),
    ],
)
def test_what_is_no_table_is_refused(begins: np.ndarray, rows: np.ndarray, more: dict, said: str) -> None:
    """Compiled C reads where it is told to: nothing lies beyond the last row."""
    with pytest.raises(InputError, match=said):
        Table(begins, rows, **more)


@pytest.mark.parametrize("period", [None, 3.0])
def test_graph_and_numbers_agree(period: float | None) -> None:
    """The second table is looked up at ten times what the first one tells beside the key."""
    first = Lookup(Table(BEGINS, ROWS, period, np.array([3.0, 0.0])), the_key)
    second = Lookup(Table(np.arange(5.0), np.arange(5.0)[:, None] ** 2), the_key)
    lookups = first, second.within(lambda key, rows: (key - rows[0]) * 10, 2)
    keys = np.array([-7.3, 0.5, 0.7, 1.0, 1.33, 2.5, 3.4999, 3.5, 8.1])
    symbol = ca.MX.sym("key")
    graph = ca.Function("graph", [symbol], [graph_at(lookups, symbol)])
    np.testing.assert_allclose(graph.map(len(keys))(keys[None, :]).full(), numbers_at(lookups, keys), atol=1e-12)
