"""The folder of a study: numbers, figures and a page that holds both."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gammastar.report.folder import to_json
from gammastar.report.place import filled
from gammastar.report.study_page import page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DATA, INDEX = "study.json", "index.html"


def write(folder: Path, found: Mapping[str, Any], figures: Mapping[str, Figure]) -> list[Path]:
    """Write numbers, figures and the page that holds them, all or none; return the files.

    Raises:
        OSError: The folder cannot be written.
    """
    from gammastar.figures import save

    with filled(folder) as made:
        (made / DATA).write_text(to_json(found), encoding="utf-8", newline="\n")
        (made / INDEX).write_text(page(found, list(figures), DATA), encoding="utf-8", newline="\n")
        for name, figure in figures.items():
            save(figure, made / name)
        names = sorted(file.name for file in made.iterdir())
    return [folder / name for name in names]
