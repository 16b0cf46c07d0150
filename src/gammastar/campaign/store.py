"""A campaign on disk: a manifest that pins what is flown, and parts of rows, each written whole or not at all.

    DIR/manifest.json        mission, seed, version, flights in all and in a part
    DIR/parts/00000000.parquet   the rows of the first flights, and so on

A part that is there is complete: it was written under another name and renamed.  It carries the mark of its campaign and its place, so
what was put there by hand, or by another campaign, counts as missing.  An interrupted campaign goes on with the parts that are missing, and
what it ends with is what it would have been without the interruption.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from gammastar.campaign.lock import LOCK, alone
from gammastar.campaign.manifest import Manifest
from gammastar.errors import CampaignError, MissingExtraError

MANIFEST, PARTS, DRAFT = "manifest.json", "parts", ".draft-"
MARK = b"campaign"  # key of a part's metadata


class Rows(NamedTuple):
    """Rows of a campaign: where the many are, and the few, of parts that may become longer, themselves."""

    files: list[str]  # of parts that have all of their flights, which no run writes again
    rest: Any  # pyarrow.Table of the others, None where there are none


@dataclass(frozen=True)
class Store:
    """The folder of a campaign."""

    folder: Path
    manifest: Manifest

    @classmethod
    @contextlib.contextmanager
    def writing(cls, folder: Path, manifest: Manifest) -> Iterator[Store]:
        """Yield the store of a new campaign, or of one that goes on, to which no other run writes meanwhile.

        Raises:
            CampaignError: The folder holds another campaign, or something else, or another run writes there.
        """
        _require_place(folder, manifest)  # before anything is made there
        with contextlib.ExitStack() as stack:
            with _told(folder):
                folder.mkdir(parents=True, exist_ok=True)
                stack.enter_context(alone(folder))
            yield cls.opened(folder, manifest)

    @classmethod
    def opened(cls, folder: Path, manifest: Manifest) -> Store:
        """Return the store of a new campaign, or of one that goes on; more flights than before are taken as going on.

        Raises:
            CampaignError: The folder holds another campaign, or something else.
        """
        _require_place(folder, manifest)
        with _told(folder):
            folder.mkdir(parents=True, exist_ok=True)
            with _replacing(folder / MANIFEST) as draft:
                draft.write_text(manifest.text(), encoding="utf-8")
            (folder / PARTS).mkdir(exist_ok=True)
            for half in (folder / PARTS).glob(f"{DRAFT}*"):
                half.unlink()  # of a run that was killed
        return cls(folder, manifest)

    @classmethod
    def read(cls, folder: Path) -> Store:
        """Return the store in a folder.

        Raises:
            CampaignError: There is none that this version reads.
        """
        try:
            return cls(folder, Manifest.read((folder / MANIFEST).read_text(encoding="utf-8")))
        except FileNotFoundError:
            raise CampaignError(
                f"{folder} must hold a campaign (got no {MANIFEST} in it); name the folder of --out"
            ) from None
        except CampaignError:
            raise
        except (OSError, ValueError) as error:
            raise CampaignError(
                f"{folder / MANIFEST} must be one that a campaign wrote (got {str(error).partition(';')[0]}); name another folder"
            ) from error

    def path(self, part: int) -> Path:
        """Return the file of a part, from the root on: libraries take a folder named ~ for another one."""
        return self.folder.absolute() / PARTS / f"{part:08d}.parquet"

    def count(self, part: int) -> int | None:
        """Return how many rows a part has; None where there is none that can be read, or one from elsewhere."""
        _, parquet = arrow()
        try:
            about = parquet.read_metadata(self.path(part))
        except (OSError, ValueError):  # pyarrow's own errors are both
            return None
        return int(about.num_rows) if (about.metadata or {}).get(MARK) == self.manifest.mark(part) else None

    def row(self, number: int) -> dict[str, Any] | None:
        """Return the row of a flight; None where it has not been flown.

        Raises:
            CampaignError: Its part is broken inside.
        """
        part = number // self.manifest.part
        if self.count(part) is None:
            return None
        rows = self.table(part).slice(number - self.manifest.numbers(part).start, 1).to_pylist()
        return dict(rows[0]) if rows else None

    def table(self, part: int) -> Any:
        """Return the rows of a part in memory, from one look at its file, whatever takes its place meanwhile.

        Raises:
            CampaignError: It is broken inside.
        """
        pyarrow, parquet = arrow()
        try:
            with parquet.ParquetFile(self.path(part)) as file:
                return file.read()
        except (OSError, pyarrow.ArrowException) as error:
            raise broken(str(self.path(part)), error) from error

    def held(self) -> dict[int, int]:
        """Return how many of their flights those parts have that are there and can be read."""
        stems = [file.stem for file in (self.folder / PARTS).glob("*.parquet")]
        parts = sorted(part for part in map(int, filter(str.isdecimal, stems)) if part < self.manifest.parts)
        found = {part: self.count(part) for part in parts}
        return {part: min(count, len(self.manifest.numbers(part))) for part, count in found.items() if count}

    def missing(self) -> list[int]:
        """Return the parts that are still to be flown; a last one that has become longer is one of them."""
        held = self.held()
        return [part for part in range(self.manifest.parts) if held.get(part) != len(self.manifest.numbers(part))]

    def write(self, part: int, table: Any) -> None:
        """Write the rows of a part, whole or not at all.

        Raises:
            CampaignError: The folder cannot be written; what was there before is still there.
        """
        _, parquet = arrow()
        marked = table.replace_schema_metadata({**(table.schema.metadata or {}), MARK: self.manifest.mark(part)})
        with _told(self.folder), _replacing(self.path(part)) as draft:
            parquet.write_table(marked, draft, compression="zstd")

    def rows(self) -> Rows:
        """Return all rows that are there.

        Raises:
            CampaignError: There are none yet.
        """
        pyarrow, _ = arrow()
        held = self.held()
        if not held:
            raise CampaignError(
                f"{self.folder} must hold flights of the campaign in its {MANIFEST} (got none yet); let it go on first"
            )
        short = [part for part, count in held.items() if count < self.manifest.part]
        rest = [self.table(part).slice(0, len(self.manifest.numbers(part))) for part in short]
        return Rows(
            [str(self.path(part)) for part in held if part not in short],
            pyarrow.concat_tables(rest, promote_options="default") if rest else None,
        )

    def dataset(self) -> Any:
        """Return all rows as a `pyarrow.dataset.Dataset`, which is read in pieces however large it is."""
        files, rest = self.rows()
        from pyarrow import dataset

        parts = [dataset.dataset(files, format="parquet")] if files else []
        return dataset.dataset(parts if rest is None else [*parts, dataset.dataset(rest)])


def arrow() -> tuple[Any, Any]:
    """Return pyarrow and its Parquet module.

    Raises:
        MissingExtraError: They are not installed.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise MissingExtraError("pyarrow", "data", "a campaign") from error
    return pyarrow, pyarrow.parquet


def broken(what: str, error: Exception) -> CampaignError:
    """Return the sentence about rows that cannot be read although their part looks whole."""
    said = " ".join(str(error).split())
    return CampaignError(
        f"{what} must hold rows that can be read (got {said}); remove what is broken, and start the campaign again: it flies that once more"
    )


def _require_place(folder: Path, manifest: Manifest) -> None:
    """Raise `CampaignError` unless a campaign can begin or go on in a folder."""
    if (folder / MANIFEST).exists():
        held = Store.read(folder).manifest
        if (what := held.difference(manifest)) is not None:
            raise CampaignError(
                f"{folder} must be an empty folder or one of this campaign (got one {what}); choose another one"
            )
        if held.flights > manifest.flights:
            raise CampaignError(
                f"a campaign that goes on must have at least its {held.flights} flights (got {manifest.flights}); choose another folder"
            )
    elif folder.is_dir() and any(not each.name.startswith((LOCK, DRAFT)) for each in folder.iterdir()):
        raise CampaignError(
            f"{folder} must be an empty folder or one of this campaign (got other files); choose another one"
        )


@contextlib.contextmanager
def _replacing(file: Path) -> Iterator[Path]:
    """Yield a draft that takes the place of a file when the block has ended well, and goes away otherwise."""
    draft = file.with_name(f"{DRAFT}{file.name}")  # one run writes at a time
    try:
        yield draft
        with draft.open("rb+") as written:
            os.fsync(written.fileno())  # what cannot be kept is told here at the latest
        os.replace(draft, file)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise


@contextlib.contextmanager
def _told(folder: Path) -> Iterator[None]:
    """Turn what the system says about a folder into one sentence."""
    try:
        yield
    except OSError as error:
        raise CampaignError(
            f"{folder} must be a folder that can be written (got {error.strerror or error}); make room or choose another one, "
            "and start the same command again: flights that are there are kept"
        ) from error
