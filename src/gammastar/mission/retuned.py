"""The law of a mission with other numbers: poles, speed of the approach, bandwidths of observers, its path; all else is the same object."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from gammastar.errors import MissionError
from gammastar.law import IntegralAction, Law
from gammastar.law.design import chains_of
from gammastar.mission.changes import PATH, POLES, changed
from gammastar.mission.complaint import complaint, within
from gammastar.mission.paths import PathSection, path_section
from gammastar.mission.sections import ControllerSection, MissionFile


def retuned(file: MissionFile, law: Law, values: Mapping[str, Any]) -> Law:
    """Return the law of a mission with other values of its tuning and its path, by the keys that they have in the mission's file.

    It is the law that the mission with these values has, and takes some tenths of a millisecond, with another path some milliseconds.  The
    numbers of such a path are data.

    Args:
        file: Of the mission.
        law: Of the mission.
        values: Of `controller.poles` and keys below it, `approach.speed`, `observer.force` and `observer.torque`, checked for their types,
            and of keys below `path`.

    Raises:
        InputError: There is no such law, or the mission has no approach or observers to be tuned, or poles that an integral goes with.
    """
    changes = dict[str, Any]()
    if numbers := {key: value for key, value in values.items() if key.startswith(f"{PATH}.")}:
        with within("[path]"):
            changes["path"] = _path_section(changed({PATH: _said(file)}, numbers)[PATH]).path(file.frame).with_data()
    if poles := {key: value for key, value in values.items() if key.startswith(POLES)}:
        if isinstance(law.rejection, IntegralAction):
            raise MissionError(
                "poles must be of a law without integral action where they are varied (got [integral], which goes with them); put "
                "[observer] in its place, or vary them as a list",
                "integral",
            )
        with within("[controller]"):
            own = {"controller": {"poles": file.controller.poles}}
            section = ControllerSection.model_validate(changed(own, poles)["controller"])
            changes["poles"] = chains_of(section.design_poles(), law.path, law.interface)
    if "approach.speed" in values:
        if law.approach is None:
            raise MissionError("approach.speed needs an approach (got none); add [approach]", "approach")
        with within("[approach]"):
            changes["approach"] = dataclasses.replace(law.approach, speed=values["approach.speed"])
    if observers := {key: value for key, value in values.items() if key.startswith("observer.")}:
        if file.observer is None:
            raise MissionError(f"{next(iter(observers))} needs an observer (got none); add [observer]", "observer")
        with within("[observer]"):
            bandwidths = {key.removeprefix("observer."): value for key, value in observers.items()}
            changes["rejection"] = file.observer.model_copy(update=bandwidths).rejection()
    result = dataclasses.replace(law, **changes)
    with within("[controller]"):
        assert result.gains  # refuses bad poles now
    return result


def _path_section(values: Any) -> PathSection:
    """Return the section that a [path] table asks for; of what it refuses, such as a scale below zero, the sentence."""
    try:
        return path_section(values)
    except ValidationError as error:
        raise complaint(error) from None


def _said(file: MissionFile) -> dict[str, Any]:
    """Return the section of the path without what is left at its default: a place at the origin, unless it varies, is not said."""
    return file.path.model_dump(exclude_defaults=True) | {"name": file.path.model_dump()["name"]}
