"""What a campaign teaches: how often flights succeed and between which bounds that is known, by anything that varies, and why others fail.

Rows are read where they lie, by a database that needs no more memory for a million flights than for ten.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtri

from gammastar.campaign.store import Store
from gammastar.errors import InputError, MissingExtraError, UnknownNameError

CONFIDENCE = 0.95
QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 1.0)
SUCCESS = "settled"  # column of truths: completed, and on the path within its bound at the end


class Rate(NamedTuple):
    """A share of successes, and the interval that holds the true one with the confidence of the study."""

    flights: int
    successes: int
    low: float
    high: float

    @property
    def share(self) -> float:
        """Return successes over flights; NaN without flights."""
        return self.successes / self.flights if self.flights else float("nan")

    def values(self) -> dict[str, Any]:
        """Return its numbers by name."""
        return {
            "flights": self.flights,
            "successes": self.successes,
            "share": self.share,
            "interval": [self.low, self.high],
        }


def wilson(successes: int, flights: int, confidence: float = CONFIDENCE) -> Rate:
    """Return a rate with Wilson's score interval, which holds at shares of zero and one too.

    Source: E. B. Wilson, Probable inference, the law of succession, and statistical inference, JASA 22 (1927).
    """
    if flights == 0:
        return Rate(0, 0, 0.0, 1.0)
    z = float(ndtri((1 + confidence) / 2))
    share, square = successes / flights, z**2 / flights
    middle = (share + square / 2) / (1 + square)
    half = z / (1 + square) * np.sqrt(share * (1 - share) / flights + square / (4 * flights))
    low = 0.0 if successes == 0 else middle - half
    high = 1.0 if successes == flights else middle + half
    return Rate(flights, successes, float(low), float(high))


class Bin(NamedTuple):
    """Flights with a quantity between two ends, or at one value of it."""

    low: Any
    high: Any
    rate: Rate


@dataclass(frozen=True, eq=False)
class Study:
    """Questions to the rows of a campaign."""

    store: Store

    @functools.cached_property
    def _database(self) -> Any:
        try:
            import duckdb
        except ImportError as error:
            raise MissingExtraError("duckdb", "campaign", "a study") from error
        files = [str(self.store.path(part)) for part in range(self.store.manifest.parts)]
        there = [file for file in files if Path(file).exists()]
        if not there:
            raise InputError(f"{self.store.folder} must hold flights (got none yet); let the campaign go on first")
        connection = duckdb.connect(":memory:")
        connection.read_parquet(there).create_view("flights")
        return connection

    def asked(self, query: str) -> list[tuple[Any, ...]]:
        """Return what a query in SQL tells about the table `flights`."""
        return list(self._database.execute(query).fetchall())

    @functools.cached_property
    def columns(self) -> dict[str, str]:
        """Return the types of the columns by their names."""
        return {str(name): str(kind) for name, kind, *_ in self.asked("DESCRIBE flights")}

    @property
    def numbers(self) -> list[str]:
        """Return the columns that hold numbers, without the flights' own."""
        return [
            name
            for name, kind in self.columns.items()
            if kind in ("DOUBLE", "FLOAT", "BIGINT", "INTEGER") and name != "flight"
        ]

    def rate(self) -> Rate:
        """Return the rate of all flights."""
        count, successes = self.asked(f'SELECT count(*), count(*) FILTER (WHERE "{SUCCESS}") FROM flights')[0]
        return wilson(int(successes), int(count))

    def causes(self) -> dict[str, int]:
        """Return how many flights failed by what they ended with, the most frequent first; 'not settled' flew to its end."""
        rows = self.asked(
            f"""SELECT CASE WHEN status = 'completed' THEN 'not settled' ELSE status END AS cause, count(*) AS n
            FROM flights WHERE NOT "{SUCCESS}" GROUP BY cause ORDER BY n DESC, cause"""
        )
        return {str(cause): int(count) for cause, count in rows}

    def distribution(self, column: str, among: str = "TRUE") -> dict[str, float]:
        """Return quantiles of a column by their shares, of the flights that have a number there; none where no flight has."""
        name = self._known(column)
        shares = ", ".join(map(str, QUANTILES))
        query = f"SELECT quantile_cont({name}, [{shares}]), count({name}), avg({name}) FROM flights WHERE isfinite({name}) AND {among}"
        found, count, mean = self.asked(query)[0]
        if not count:
            return {}
        quantiles = {f"{100 * share:g}%": float(value) for share, value in zip(QUANTILES, found, strict=True)}
        return {"flights": int(count), "mean": float(mean), **quantiles}

    def by(self, column: str, bins: int = 10) -> list[Bin]:
        """Return the rate in bins of a column, of equal width; a column with few values has a bin for each."""
        name = self._known(column)
        if bins < 1:
            raise InputError(f"bins must be at least 1 (got {bins}); choose some")
        ends = f'count(*) AS n, count(*) FILTER (WHERE "{SUCCESS}") AS good'
        few = self.asked(f"SELECT DISTINCT {name} FROM flights WHERE {name} IS NOT NULL LIMIT {bins + 1}")
        if len(few) <= bins:
            rows = self.asked(
                f"SELECT {name}, {ends} FROM flights WHERE {name} IS NOT NULL GROUP BY {name} ORDER BY {name}"
            )
            return [Bin(value, value, wilson(int(good), int(count))) for value, count, good in rows]
        low, high = self.asked(f"SELECT min({name}), max({name}) FROM flights WHERE isfinite({name})")[0]
        place = f"least({bins - 1}, floor(({name} - {low!r}) / {(high - low) / bins!r}))::INTEGER"
        rows = self.asked(
            f"SELECT {place} AS place, {ends} FROM flights WHERE isfinite({name}) GROUP BY place ORDER BY place"
        )
        width = (high - low) / bins
        return [Bin(low + k * width, low + (k + 1) * width, wilson(int(good), int(count))) for k, count, good in rows]

    def over(
        self, first: str, second: str, bins: tuple[int, int] = (18, 24)
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return edges (m + 1,) and (n + 1,) of two columns, and flights and successes (m, n) in between: a map of the basin."""
        names = [self._known(column) for column in (first, second)]
        ends = [self.asked(f"SELECT min({name}), max({name}) FROM flights WHERE isfinite({name})")[0] for name in names]
        edges = [np.linspace(low, high, count + 1) for (low, high), count in zip(ends, bins, strict=True)]
        places = [
            f"least({count - 1}, floor(({name} - {edge[0]!r}) / {max(edge[1] - edge[0], 1e-300)!r}))::INTEGER"
            for name, edge, count in zip(names, (each.tolist() for each in edges), bins, strict=True)
        ]
        rows = self.asked(
            f"""SELECT {places[0]} AS a, {places[1]} AS b, count(*), count(*) FILTER (WHERE "{SUCCESS}")
            FROM flights WHERE isfinite({names[0]}) AND isfinite({names[1]}) GROUP BY a, b"""
        )
        flights, successes = np.zeros(bins, dtype=int), np.zeros(bins, dtype=int)
        for a, b, count, good in rows:
            flights[a, b], successes[a, b] = count, good
        return edges[0], edges[1], flights, successes

    def _known(self, column: str) -> str:
        """Return a column's name as SQL writes it."""
        if column not in self.columns:
            raise UnknownNameError("column", column, self.columns)
        return '"' + column.replace('"', '""') + '"'
