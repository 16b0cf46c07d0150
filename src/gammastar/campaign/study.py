"""What a campaign teaches: how often flights succeed and between which bounds that is known, by anything that varies, and why others fail.

Rows are read where they lie, by a database that needs no more memory for a million flights than for ten.
"""

from __future__ import annotations

import functools
import itertools
import tomllib
from dataclasses import dataclass
from typing import Any

import numpy as np

from gammastar.campaign.answers import About, Bin, Cause, Map
from gammastar.campaign.database import SUCCESS, Database
from gammastar.campaign.edges import edges
from gammastar.campaign.rate import Rate, wilson
from gammastar.campaign.store import Store
from gammastar.checks import whole
from gammastar.errors import GammastarError, InputError, UnknownNameError
from gammastar.mission.mission import read

QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 1.0)
SETTLING, END = "settling_time_s", "end_time_s"
LATE = 0.75  # of a flight; what settles later may as well pass through its path as it ends
NUMBERS = ("DOUBLE", "FLOAT", "BIGINT", "INTEGER")
MOST_BINS = 1000


@dataclass(frozen=True, eq=False)
class Study:
    """Questions to the rows of a campaign, of those parts that were there when the first one was asked."""

    store: Store

    @functools.cached_property
    def _database(self) -> Database:
        return Database.of(self.store)

    def asked(self, query: str, values: list[Any] | None = None) -> list[tuple[Any, ...]]:
        """Return what a query in SQL tells about the table `flights`, with values in place of its question marks.

        Raises:
            CampaignError: The rows cannot be read.
        """
        return self._database.asked(query, values or [])

    @functools.cached_property
    def columns(self) -> dict[str, str]:
        """Return the types of the columns by their names; where thrust to weight varies it is one of them."""
        return {str(name): str(kind) for name, kind, *_ in self.asked("DESCRIBE flights")}

    @property
    def numbers(self) -> list[str]:
        """Return the columns that hold numbers, without the flights' own."""
        return [name for name, kind in self.columns.items() if kind in NUMBERS and name != "flight"]

    @functools.cached_property
    def mission(self) -> About:
        """Return what the mission says of itself; nothing where it is one that this version does not read."""
        try:
            file = read(tomllib.loads(self.store.manifest.mission))
        except (GammastarError, tomllib.TOMLDecodeError):
            return About()
        return About(file.title, file.frame, file.flight.settled_within)

    def rate(self) -> Rate:
        """Return the rate of all flights."""
        count, successes = self.asked(f'SELECT count(*), count(*) FILTER (WHERE "{SUCCESS}") FROM flights')[0]
        return wilson(int(successes), int(count))

    def late(self) -> int:
        """Return how many flights succeed in the last quarter of their time only, so that little tells whether they stay."""
        if not {SETTLING, END} <= set(self.columns):
            return 0
        return int(self.asked(f"SELECT count(*) FROM flights WHERE {SUCCESS} AND {SETTLING} > {LATE} * {END}")[0][0])

    def causes(self) -> list[Cause]:
        """Return what flights failed by, the most frequent first."""
        words = "cause" if "cause" in self.columns else "''"
        end = END if END in self.columns else "NULL"
        rows = self.asked(
            f"""SELECT CASE WHEN status = 'completed' THEN 'not settled' ELSE status END AS why, count(*) AS n, min(flight),
            median({end}), arg_min({words}, flight) FROM flights WHERE "{SUCCESS}" IS NOT TRUE GROUP BY why ORDER BY n DESC, why"""
        )
        total = self.rate().flights
        return [
            Cause(str(why), wilson(int(count), total), int(first), np.nan if at is None else float(at), text or "")
            for why, count, first, at, text in rows
        ]

    def distribution(self, column: str, among: str = "TRUE") -> dict[str, float]:
        """Return quantiles of a column by their shares, of the flights that have a number there; none where no flight has.

        Args:
            column: Of numbers.
            among: Condition in SQL that the flights fulfil, such as 'settled'.
        """
        name, shares = self._known(column, numbers=True), ", ".join(map(str, QUANTILES))
        query = f"SELECT quantile_cont({name}, [{shares}]), count({name}), avg({name}) FROM flights WHERE {_told(name)} AND ({among})"
        found, count, mean = self.asked(query)[0]
        if not count:
            return {}
        quantiles = {f"{100 * share:g}%": float(value) for share, value in zip(QUANTILES, found, strict=True)}
        return {"flights": int(count), "mean": float(mean), **quantiles}

    def ends(self, column: str) -> tuple[float, float] | None:
        """Return the least and the largest finite number of a column; None where it has none."""
        name = self._known(column, numbers=True)
        low, high = self.asked(f"SELECT min({name}), max({name}) FROM flights WHERE {_told(name)}")[0]
        return None if low is None else (float(low), float(high))

    def varies(self, column: str) -> bool:
        """Return whether a column has more than one value; numbers that are not finite are none."""
        name, condition = self._known(column), self._tells(column)
        return len(self.asked(f"SELECT DISTINCT {name} FROM flights WHERE {condition} LIMIT 2")) > 1

    def by(self, column: str, bins: int = 10) -> list[Bin]:
        """Return the rate in at most so many bins of a column, which are equally wide and end at round numbers.

        A column with few values has a bin for each; of one with many texts those with most flights do.  Flights without a finite number
        are in none.
        """
        name, bins = self._known(column), whole(bins, "bins", 1, MOST_BINS)
        few = self.asked(f"SELECT DISTINCT {name} FROM flights WHERE {self._tells(column)} LIMIT {bins + 1}")
        if len(few) > bins and column in self.numbers:
            return self._parted(column, bins)
        order = name if len(few) <= bins else f"count(*) DESC, {name}"
        rows = self.asked(
            f"SELECT {name}, {self._measures} FROM flights WHERE {self._tells(column)} GROUP BY {name} ORDER BY {order} LIMIT {bins}"
        )
        return [Bin(value, value, *_judged(*told)) for value, *told in rows]

    def _parted(self, column: str, bins: int) -> list[Bin]:
        ends, (place, values) = self._edges(column, bins), self._place(column, bins)
        rows = self.asked(
            f"SELECT {place} AS place, {self._measures} FROM flights WHERE {self._tells(column)} GROUP BY place",
            values,
        )
        judged = {place: _judged(*told) for place, *told in rows}
        nothing = wilson(0, 0), (np.nan, np.nan)
        return [
            Bin(float(low), float(high), *judged.get(k, nothing))
            for k, (low, high) in enumerate(itertools.pairwise(ends))
        ]

    def over(self, first: str, second: str, bins: tuple[int, int] = (18, 24)) -> Map:
        """Return flights, successes and settling times in at most so many bins of two columns: a map of the basin."""
        places = [
            self._place(column, whole(most, "bins", 1, MOST_BINS))
            for column, most in zip((first, second), bins, strict=True)
        ]
        ends = [self._edges(column, most) for column, most in zip((first, second), bins, strict=True)]
        rows = self.asked(
            f"""SELECT {places[0][0]} AS a, {places[1][0]} AS b, {self._measures}
            FROM flights WHERE {self._tells(first)} AND {self._tells(second)} GROUP BY a, b""",
            places[0][1] + places[1][1],
        )
        shape = tuple(len(each) - 1 for each in ends)
        flights, successes, settling = np.zeros(shape, dtype=int), np.zeros(shape, dtype=int), np.full(shape, np.nan)
        for a, b, *told in rows:
            rate, times = _judged(*told)
            flights[a, b], successes[a, b], settling[a, b] = rate.flights, rate.successes, times[0]
        return Map(ends[0], ends[1], flights, successes, settling)

    def _edges(self, column: str, most: int) -> np.ndarray:
        """Return the ends of bins; around a single value they are half a unit away."""
        found = self.ends(column)
        if found is None:
            raise InputError(f"{column} must have a finite number in some flight (got none); choose another quantity")
        low, high = found
        return edges(low, high, most, column.endswith("_deg")) if low < high else np.array([low - 0.5, high + 0.5])

    def _place(self, column: str, most: int) -> tuple[str, list[float]]:
        """Return in which bin a number is, counted from zero, as SQL with values."""
        name, ends = self._known(column, numbers=True), self._edges(column, most)
        last = len(ends) - 2
        place = f"greatest(0, least({last}, floor(({name} - ?::DOUBLE) / ?::DOUBLE)))::INTEGER"
        return place, [float(ends[0]), float(ends[-1] - ends[0]) / (last + 1)]

    @property
    def _measures(self) -> str:
        """Return what is asked of the flights of every bin, for `_judged`."""
        times = f"quantile_cont({SETTLING}, [0.5, 0.95]) FILTER (WHERE {SUCCESS} AND isfinite({SETTLING}))"
        return f"count(*), count(*) FILTER (WHERE {SUCCESS}), {times if SETTLING in self.columns else 'NULL'}"

    def _tells(self, column: str) -> str:
        """Return the condition in SQL that a row tells something in a column."""
        name = self._known(column)
        return _told(name) if column in self.numbers else f"{name} IS NOT NULL"

    def _known(self, column: str, numbers: bool = False) -> str:
        """Return a column's name as SQL writes it."""
        if column not in self.columns:
            raise UnknownNameError("column", column, self.columns)
        if numbers and column not in self.numbers:
            raise InputError(f"{column} must be a column of numbers (got {self.columns[column]}); choose another one")
        return '"' + column.replace('"', '""') + '"'


def _told(name: str) -> str:
    """Return the condition in SQL that a number is finite, and not so large that its distance to another one is none.

    A comparison alone lets NaN through where the database trusts the statistics of a file, which know none.
    """
    return f"isfinite({name}::DOUBLE) AND abs({name}::DOUBLE) < 1e300"


def _judged(count: int, successes: int, times: list[float] | None) -> tuple[Rate, tuple[float, float]]:
    median, late = times or (np.nan, np.nan)
    return wilson(int(successes), int(count)), (float(median), float(late))
