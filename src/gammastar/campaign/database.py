"""The rows of a campaign as a table that is asked in SQL and read where it lies, by DuckDB."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from gammastar.campaign import ratio
from gammastar.campaign.columns import THRUST_TO_WEIGHT
from gammastar.campaign.store import Store, broken
from gammastar.errors import CampaignError, MissingExtraError

SUCCESS = "settled"  # column of truths: completed, and on the path within its bound at the end
NEEDED = ("flight", "status", SUCCESS)  # columns of every row


@dataclass(frozen=True, eq=False)
class Database:
    """A connection with the table `flights`: the rows that were there when it was opened, whatever came later.

    Where thrust to weight varies it is one more column.
    """

    store: Store
    connection: Any

    @classmethod
    def of(cls, store: Store) -> Database:
        """Return the database of a campaign.

        Raises:
            CampaignError: There are no rows, or other ones.
        """
        with _told(store):
            connection, (files, rest) = library().connect(":memory:"), store.rows()
            if files:
                connection.read_parquet([_literally(file) for file in files], union_by_name=True).create_view("whole")
            if rest is not None:
                connection.from_arrow(rest).create("rest")
            parts = [name for name, there in (("whole", bool(files)), ("rest", rest is not None)) if there]
            rows = connection.sql(" UNION ALL BY NAME ".join(f"SELECT * FROM {name}" for name in parts))
            if lost := [name for name in NEEDED if name not in rows.columns]:
                raise CampaignError(
                    f"rows of a campaign must have the columns {', '.join(NEEDED)} (got none named {lost[0]} in {store.folder}); "
                    "name the folder of a campaign"
                )
            expression = ratio.thrust_to_weight(store.manifest.mission, rows.columns)
            if expression is not None:
                rows = rows.project(f"*, {expression} AS {THRUST_TO_WEIGHT}")
            rows.create_view("flights")
        return cls(store, connection)

    def asked(self, query: str, values: list[Any]) -> list[tuple[Any, ...]]:
        """Return what a query tells, with values in place of its question marks.

        Raises:
            CampaignError: The rows cannot be read.
            duckdb.Error: The query cannot be understood.
        """
        with _told(self.store):
            return list(self.connection.execute(query, values).fetchall())


def library() -> Any:
    """Return DuckDB, or raise `MissingExtraError`."""
    try:
        import duckdb
    except ImportError as error:
        raise MissingExtraError("duckdb", "campaign", "a study") from error
    return duckdb


@contextlib.contextmanager
def _told(store: Store) -> Iterator[None]:
    """Turn what the database says of broken files into one sentence."""
    duckdb = library()
    try:
        yield
    except duckdb.Error as error:
        if type(error) in (duckdb.Error, duckdb.IOException, duckdb.InvalidInputException):
            raise broken(str(store.folder), error) from error
        raise


def _literally(file: str) -> str:
    """Return a file as the database takes it, to which some letters stand for others."""
    return re.sub(r"([*?\[])", r"[\1]", file)
