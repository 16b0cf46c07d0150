"""The values of a mission with every default written out, so that they say the same whatever becomes of defaults and files."""

from __future__ import annotations

from typing import Any

from gammastar.export.program import DEFAULT_REAL
from gammastar.law import Law
from gammastar.law.design import CHAINS
from gammastar.mission.sections import COMPILED, ControllerSection, MissionFile, StartSection
from gammastar.mission.tables import plain


def resolved(file: MissionFile, law: Law, feedback: str, rate: float | None) -> dict[str, Any]:
    """Return a mission's nested plain values, those included that its law and its conditions have found."""
    values: dict[str, Any] = plain(with_paths_written(file, file.model_dump(exclude_none=True)))
    values["vehicle"] = plain(file.vehicle.written(file.frame))
    values["limits"] = file.vehicle.limits() | values["limits"]
    for name in ("limits", "replacements"):
        if not values[name]:
            del values[name]
    approach = law.approach
    if approach is not None:
        values["approach"] = vars(approach) | {"thrust_floor": approach.floor(law.vehicle)}
    chains = [chain for chain in CHAINS if chain != "transverse_2" or law.path.components == 2]
    values["controller"]["poles"] = {
        chain: [[pole.real, pole.imag] if pole.imag else pole.real for pole in law.poles[chain]] for chain in chains
    }
    if values["controller"]["interface"] == COMPILED:
        values["controller"] |= {"real": file.controller.real or DEFAULT_REAL}
    controller = values["controller"] | {"feedback": feedback} | ({} if rate is None else {"rate": rate})
    values["controller"] = {key: controller[key] for key in ControllerSection.model_fields if key in controller}
    start = {"thrust": law.vehicle.weight} | values["start"]
    if not {"attitude", "quaternion"} & set(start):
        start = {"roll": 0.0, "pitch": 0.0, "yaw": 0.0} | start
    values["start"] = {key: start[key] for key in StartSection.model_fields if key in start}
    return values


def with_paths_written(file: MissionFile, values: dict[str, Any]) -> dict[str, Any]:
    """Return values with every path as one that needs no file."""
    others = zip(values.get("replacements", []), file.replacements, strict=True)
    written = [table | {"path": section.path.written()} for table, section in others]
    return values | {"path": file.path.written()} | ({"replacements": written} if written else {})
