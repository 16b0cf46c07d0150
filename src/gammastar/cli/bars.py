"""How far a verb has come: bars on stderr where it is a terminal, nothing elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def progress(verb: str) -> Iterator[Callable[[int, int], None] | None]:
    """Yield what draws a bar from (done, in all) on a terminal, or None where nobody would see it."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(verb, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def flights() -> Iterator[Callable[[int, int], None] | None]:
    """Yield what draws a bar from (flights done, flights in all), with rate and remaining time, or None where nobody would see it."""
    if not sys.stderr.isatty():
        yield None
        return
    import time

    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    columns = BarColumn(), TaskProgressColumn(), TextColumn("{task.description}")
    begun: list[tuple[float, int]] = []
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("preparing", total=None)

        def draw(done: int, total: int) -> None:
            now = time.monotonic()
            if not begun:
                begun.append((now, done))
            since, before = begun[0]
            words = f"{done} of {total} flights"
            if done > before:
                rate = (done - before) / (now - since)
                words += f", {rate:.3g}/s, {remaining((total - done) / rate)} left"
            bar.update(task, description=words, completed=done, total=total)

        yield draw


def remaining(seconds: float) -> str:
    """Return a time to go, in the unit that a person would take."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.0f} s"


@contextmanager
def counter(verb: str, total: int) -> Iterator[Callable[[Any], None] | None]:
    """Yield what advances a bar by one whenever it is called with a result, or None where nobody would see it."""
    with progress(verb) as draw:
        if draw is None:
            yield None
            return
        finished: list[Any] = []

        def count(result: Any) -> None:
            finished.append(result)
            draw(len(finished), total)

        yield count
