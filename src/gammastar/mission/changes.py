"""The values of a mission with some changed by their dotted keys, as `Mission.with_values`, `--set` and campaigns do it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gammastar.law.design import by_chain
from gammastar.mission.tables import plain, put

POLES, PATH = "controller.poles", "path"


def changed(values: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested values, plain, with some changed, named by dotted keys such as 'path.radius' or 'controller.poles.yaw'."""
    result: dict[str, Any] = plain(values)
    for key, value in changes.items():
        if key.startswith(f"{POLES}."):
            _part_poles(result.get("controller"))
        put(result, key, value)
    return result


def _part_poles(controller: Any) -> None:
    """Give each chain of a controller poles of its own where a number or a list is given for all, so that one of them can be changed."""
    if isinstance(controller, dict) and "poles" in controller:
        controller["poles"] = by_chain(controller["poles"])
