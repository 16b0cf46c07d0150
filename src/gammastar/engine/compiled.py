"""Graphs built once and used again: flights of the same law over other data need no new one."""

from __future__ import annotations

import collections
from collections.abc import Callable, Hashable
from typing import Any

MOST_KEPT = 256  # graphs; the one used longest ago goes first

_kept: collections.OrderedDict[Hashable, Any] = collections.OrderedDict()
_built = 0


def compiled(key: Hashable, build: Callable[[], Any]) -> Any:
    """Return what `build` returns, built once for a key that names everything that enters the graph as a constant."""
    global _built
    if key not in _kept:
        _kept[key] = build()
        _built += 1
        if len(_kept) > MOST_KEPT:
            _kept.popitem(last=False)
    _kept.move_to_end(key)
    return _kept[key]


def compilations() -> int:
    """Return how many graphs have been built so far in this process."""
    return _built
