"""Files that appear whole or not at all, and figures whose bytes depend on the figure alone."""

from __future__ import annotations

import io
import os
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gammastar.errors import UnknownNameError
from gammastar.figures import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("png", "svg")  # of every figure that a verb writes
RESOLUTION = 160  # [dots/in] of PNG: figures over time are then 1056 pixels wide
# What a format would write about date and program, switched off: the same figure gives the same bytes.
METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


def save(figure: Figure, stem: Path, formats: Sequence[str] = FORMATS) -> list[Path]:
    """Write a figure as stem.png, stem.svg ... and return the files; each appears whole or not at all.

    Args:
        figure: Any matplotlib figure.
        stem: File without its ending; missing folders are made.
        formats: Of 'png', 'svg', 'pdf'.

    Raises:
        UnknownNameError: A format that is not one of these.
    """
    for name in formats:
        if name not in METADATA:
            raise UnknownNameError("format", name, METADATA)
    files = []
    for name in formats:
        file = stem.with_name(f"{stem.name}.{name}")
        write_whole(file, picture(figure, name))
        files.append(file)
    return files


@style.drawing()
def picture(figure: Figure, kind: str, resolution: float = RESOLUTION) -> bytes:
    """Return the bytes of a figure as 'png', 'svg' or 'pdf'."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind, dpi=resolution, metadata=METADATA[kind])
    return buffer.getvalue()


def write_whole(file: Path, content: bytes) -> None:
    """Write a file under a passing name beside its place and move it there, so that no reader ever finds half of it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    passing = file.with_name(f".{file.name}.{os.getpid()}.{threading.get_ident()}")
    try:
        passing.write_bytes(content)
        os.replace(passing, file)
    finally:
        passing.unlink(missing_ok=True)
