"""The folder that a verb writes: looked at before the work begins, and filled with all of its files or with none."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from gammastar.errors import InputError


def chosen_folder(out: str, names: Iterable[str], source: Path | None = None) -> Path:
    """Return the folder that a user names, or raise `InputError` now if it could not be made, written or filled later.

    Args:
        out: What the user wrote.
        names: Of the files that will be written there; those that exist are replaced.
        source: File that the work reads, and that must therefore not be among them.
    """
    if not out:
        raise InputError('out must be a folder (got ""); name one, such as out/, or . for the current one')
    folder = Path(out)
    if (
        lost := next((place for place in (folder, *folder.parents) if place.is_symlink() and not place.exists()), None)
    ) is not None:
        raise InputError(
            f"out must be a folder (got {folder}, and {lost} is a link that leads nowhere); choose another name"
        )
    there = _nearest(folder)
    if not there.is_dir():
        raise InputError(f"out must be a folder (got {folder}, and {there} is a file); choose another name")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f"out must be a folder that can be written (got {folder}, in {there}); choose another place")
    targets = [folder / name for name in names]
    _require_room(targets)
    if source is not None and any(target.exists() and target.samefile(source) for target in targets):
        raise InputError(
            f"out must be a folder whose files may be replaced (got {folder}, which holds the mission to fly, {source}); "
            "choose another one"
        )
    return folder


def chosen_file(out: str, ending: str, source: Path | None = None) -> Path:
    """Return the file that a user names, by its ending, or raise `InputError` now if it could not be written later."""
    file = Path(out)
    if file.suffix != ending:
        raise InputError(f'out must be a file that ends in {ending} (got "{out}"); name one, such as tuned{ending}')
    return chosen_folder(str(file.parent), [file.name], source) / file.name


def written(file: Path, content: str) -> None:
    """Write a text as a file, whole or not at all; one of the same name is replaced."""
    with filled(file.parent) as made:
        (made / file.name).write_text(content, encoding="utf-8", newline="\n")


@contextmanager
def filled(folder: Path) -> Iterator[Path]:
    """Yield an empty folder to make files in; when the block has ended well they move into `folder` together.

    Files of the same names are replaced, others are left alone.  Whatever goes wrong before leaves nothing behind.
    """
    with tempfile.TemporaryDirectory(prefix=".gammastar-", dir=_nearest(folder)) as workbench:
        yield Path(workbench)
        files = sorted(Path(workbench).iterdir())
        _require_room([folder / file.name for file in files])
        folder.mkdir(parents=True, exist_ok=True)
        for file in files:
            os.replace(file, folder / file.name)


def _nearest(folder: Path) -> Path:
    """Return the folder, or the nearest one above it that exists: what is made there can be moved below without copying."""
    return next(place for place in (folder, *folder.absolute().parents) if place.exists())


def _require_room(targets: Iterable[Path]) -> None:
    for target in targets:
        if target.is_dir():
            raise InputError(
                f"{target.name} must be a file to write (got a folder of that name, {target}); choose another --out"
            )
