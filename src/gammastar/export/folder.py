"""The folder of an export: written whole or not at all, in place of nothing or of an earlier export."""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gammastar.errors import InputError
from gammastar.export.program import Program
from gammastar.export.sizes import state_bytes, table_bytes

FACTS = "export.json"  # by which a folder is known as an export
BUILT = (".o", ".a", ".elf", ".map")  # what a build leaves in it
BUILD = "build"  # and where others do
SELFTEST = "selftest"
WORKBENCH = ".gammastar-"  # how names begin under which an export is made ready; one that was killed leaves it


def facts_of(program: Program, target: str, files: Mapping[str, str]) -> dict[str, Any]:
    """Return what a program that reads about an export wants to know, with units in the keys."""
    pilot = program.autopilot
    return {
        "mission": program.title,
        "name": program.name,
        "target": target,
        "real": program.real,
        "frame": program.frame,
        "interval_s": pilot.interval,
        "rate_Hz": 1 / pilot.interval,
        "operations": program.operations,
        "state_bytes": state_bytes(program),
        "table_bytes": table_bytes(program),
        "command": program.command_names,
        "files": sorted([*files, FACTS]),
        "version": program.version,
    }


def chosen_folder(out: str) -> Path:
    """Return the folder that a user names, or raise `InputError` now if an export cannot be written there.

    It may be new, empty, or hold an earlier export and what was built of it, or what is left of one that was killed.
    """
    if not out:
        raise InputError('out must be a folder (got ""); name one, such as out/autopilot')
    folder = Path(out)
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists() or place.is_symlink())
    if not there.is_dir():
        raise InputError(f"out must be a folder (got {folder}, and {there} is a file); choose another name")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f"out must be a folder that can be written (got {folder}, in {there}); choose another place")
    if there == folder:
        known = _earlier(folder)
        for place in folder.rglob("*") if known else sorted(folder.iterdir()):
            name = place.relative_to(folder)
            is_built = known and (place.suffix in BUILT or BUILD in name.parts[:1] or place.is_dir())
            if not is_built and not name.parts[0].startswith(WORKBENCH) and name.as_posix() not in known:
                raise InputError(
                    f"out must be new, empty, or an earlier export (got {folder}, which holds {name}); choose another folder"
                )
    return folder


def write(folder: Path, files: Mapping[str, str], facts: Mapping[str, Any]) -> None:
    """Write the files of an export and what is known about it; an earlier export in the folder goes.

    Raises:
        OSError: The folder cannot be written.
    """
    texts = {**files, FACTS: json.dumps(facts, indent=2) + "\n"}
    existing = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    with tempfile.TemporaryDirectory(prefix=WORKBENCH, dir=existing) as workbench:
        made, before = Path(workbench, "made"), Path(workbench, "before")
        made.mkdir()
        before.mkdir()
        for name, text in texts.items():
            (made / name).parent.mkdir(exist_ok=True)
            (made / name).write_text(text, encoding="utf-8", newline="\n")
        if existing != folder:
            folder.parent.mkdir(parents=True, exist_ok=True)
            os.replace(made, folder)
            return
        own = Path(workbench).name
        old, new = ([place.name for place in each.iterdir() if place.name != own] for each in (folder, made))
        try:
            for source, target, names in ((folder, before, old), (made, folder, new)):
                for name in names:
                    os.replace(source / name, target / name)
        except BaseException:
            for name in set(new) - {place.name for place in made.iterdir()}:
                os.rename(folder / name, made / name)
            for place in before.iterdir():
                place.rename(folder / place.name)
            raise


def _earlier(folder: Path) -> set[str]:
    """Return the names of the files of an earlier export, also of one that was killed while it replaced another; none if there is none."""
    names = set[str]()
    for place in (folder / FACTS, *folder.glob(f"{WORKBENCH}*/*/{FACTS}")):
        with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
            facts = json.loads(place.read_text(encoding="utf-8"))
            if facts["target"] and facts["operations"]:
                names |= {SELFTEST, *map(str, facts["files"])}
    return names
