"""Where the parts of a campaign are flown: in this process, or by the workers of a cluster that Dask schedules."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import functools
import logging
import threading
import uuid
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from gammastar.campaign.flown import Progress, rows
from gammastar.campaign.manifest import Manifest
from gammastar.campaign.setting import Setting
from gammastar.errors import CampaignError, MissingExtraError
from gammastar.mission.load import parse
from gammastar.version import VERSION

PATIENCE = 8.0  # [s] for a scheduler to answer and a worker to be there
AHEAD = 2  # parts that wait for each worker, so that none stands idle

Flyer = Callable[[Setting, Manifest, Sequence[int], Progress], Iterator[tuple[int, Any]]]
"""Yields parts with their rows, in any order, and tells how many flights of the one in work are done."""


@contextlib.contextmanager
def here(threads: int | None) -> Iterator[Flyer]:
    """Yield what flies parts in this process, one after the other."""

    def fly(
        setting: Setting, manifest: Manifest, parts: Sequence[int], progress: Progress
    ) -> Iterator[tuple[int, Any]]:
        for part in parts:
            yield part, rows(setting, manifest.numbers(part), manifest.machine, threads, progress)

    yield fly


@contextlib.contextmanager
def cluster_of(address: str, threads: int | None) -> Iterator[Flyer]:
    """Yield what flies parts on the workers of a scheduler; a part whose worker is lost is flown by another one.

    Raises:
        CampaignError: The scheduler does not answer, has no workers, or one of them has another version of gammastar.
    """
    try:
        import distributed
    except ImportError as error:
        raise MissingExtraError("distributed", "campaign", "a cluster") from error
    with _silence(), contextlib.ExitStack() as stack:
        connect: Any = distributed.Client  # untyped
        try:
            client = stack.enter_context(connect(address, timeout=PATIENCE, set_as_default=False))
            client.wait_for_workers(1, timeout=PATIENCE)
        except (OSError, ValueError, TypeError, ImportError) as error:
            said = " ".join(str(error).split()) or type(error).__name__
            raise CampaignError(
                f"a cluster must be a scheduler that answers and has workers (got {address!r}: {said}); start dask scheduler and "
                "dask worker, and give the scheduler's address"
            ) from error
        _require_version(client)
        yield functools.partial(_fly, client, threads)


def fly_part(source: str, seed: int, numbers: range, machine: str, threads: int | None, version: str) -> Any:
    """Return the rows of a part; what a worker of the cluster does, with all of its threads for one part at a time.

    Building graphs is for one thread of a process alone.
    """
    import distributed

    if version != VERSION:
        raise CampaignError(_other_versions([VERSION], version))
    with _ALONE:
        every = distributed.get_worker().state.nthreads
        return rows(_setting(source, seed), numbers, machine, threads or every)


_ALONE = threading.Lock()


@functools.lru_cache(1)
def _setting(source: str, seed: int) -> Setting:
    return Setting(parse(source), seed)


def _fly(
    client: Any, threads: int | None, setting: Setting, manifest: Manifest, parts: Sequence[int], progress: Progress
) -> Iterator[tuple[int, Any]]:
    from distributed import KilledWorker, as_completed

    run, waiting, of = uuid.uuid4().hex, iter(parts), dict[str, int]()
    collect: Any = as_completed  # untyped
    futures = collect(loop=client.loop)

    def submit() -> None:
        for part in waiting:
            key = of_part(part)
            given = manifest.mission, manifest.seed, manifest.numbers(part), manifest.machine, threads, VERSION
            futures.add(client.submit(fly_part, *given, key=key))
            of[key] = part
            if len(of) >= AHEAD * max(1, len(client.nthreads())):
                break

    def of_part(part: int) -> str:
        return f"gammastar-{run}-{part}"

    submit()
    for future in futures:
        part = of.pop(future.key)
        try:
            table = future.result()
        except KilledWorker as error:
            raise CampaignError(
                f"a part must be flown by a worker that lives (got part {part}, under which several have died); look at their memory, and "
                "start the same command again: flights that are there are kept"
            ) from error
        except (OSError, asyncio.CancelledError, concurrent.futures.CancelledError) as error:
            raise CampaignError(
                "a cluster must stay there until the last flight (got a scheduler that has gone); start the same command again: flights "
                "that are there are kept"
            ) from error
        submit()
        yield part, table


def _require_version(client: Any) -> None:
    """Raise `CampaignError` unless all workers have this version; asked for by a built-in function, which any worker has."""
    found = client.run(eval, "__import__('gammastar').__version__", on_error="return").values()
    others = sorted({each if isinstance(each, str) else "none" for each in found} - {VERSION})
    if others:
        raise CampaignError(_other_versions(others, VERSION))


def _other_versions(found: Sequence[str], wanted: str) -> str:
    return f"workers must have gammastar {wanted} as this process has (got {' and '.join(found)}); install it there"


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Let Dask not write on stderr of workers that come and go: what matters is raised."""
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] == "distributed"]
    loggers = [logging.getLogger(name) for name in names]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
