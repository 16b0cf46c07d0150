"""One run at a time in the folder of a campaign: readers need no leave, writers do."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from gammastar.errors import CampaignError, MissingExtraError

LOCK = ".lock"  # stays there; what counts is whether a process that lives holds it


@contextlib.contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Keep other runs from writing in a folder meanwhile.

    The operating system lets go of the lock when the process ends, however it does, and so does a network folder that knows locks.

    Raises:
        CampaignError: Another run writes there.
        OSError: The folder cannot be written.
    """
    try:
        import filelock
    except ImportError as error:
        raise MissingExtraError("filelock", "campaign", "a campaign") from error
    lock = filelock.FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0)
    except filelock.Timeout:
        raise CampaignError(
            f"{folder} must have one run at a time (got one that is being written by another run); let that one end, or choose "
            "another folder"
        ) from None
    try:
        yield
    finally:
        lock.release()
