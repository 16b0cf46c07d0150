"""Campaigns: many flights of one mission, each with its own values of what varies.

The room itself can be called, whatever was imported before: `gammastar.campaign(mission, flights, out)` is `campaign` of its module `run`.
"""

from __future__ import annotations

import sys
import types
from typing import Any


class _Room(types.ModuleType):
    """A room that runs campaigns when it is called."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        from gammastar.campaign.run import campaign

        return campaign(*arguments, **named)


sys.modules[__name__].__class__ = _Room
