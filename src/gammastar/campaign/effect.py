"""Whether what a campaign varies makes a difference in the flights of its mission, and can be data for their one program."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gammastar.errors import InputError, MissionError
from gammastar.mission import Mission
from gammastar.mission.campaign import Way, quantity
from gammastar.mission.changes import PATH, POLES
from gammastar.mission.complaint import within
from gammastar.mission.references import FeasibleSection
from gammastar.mission.sections import MissionFile

SPEED = "speed"  # kind of the references of which each flight may have its own


def serves(file: MissionFile, name: str) -> bool:
    """Return whether a quantity can be data for one program of a mission's flights; as a list or grid it can be varied in any case."""
    way = quantity(name).way
    if name.startswith(f"{PATH}."):
        return not file.path.is_implicit and not isinstance(file.reference, FeasibleSection)
    if way is Way.SPEED:
        return getattr(file.reference, "kind", None) == SPEED
    return way is not Way.LAW or file.integral is None


def require_effect(mission: Mission, names: Iterable[str]) -> None:
    """Raise `InputError` unless each of some quantities is data for a program of a mission's flights and makes a difference in them."""
    of = {name: quantity(name).way for name in names}
    with within("[campaign]"):
        mission.require_possible({quantity(name).parameter: np.ones((1, 1)) for name in of if of[name] is Way.TRUTH})
        for name in of:
            if of[name] is Way.SPEED and not serves(mission.file, name):
                raise MissionError(
                    f'{name} must be that of a reference of the kind "{SPEED}" (got another kind); vary it as a list, or take that kind',
                    "reference.kind",
                )
            if of[name] is Way.LAW:
                _require_tuned(mission, name)


def acting_chains(mission: Mission) -> tuple[str, ...]:
    """Return the chains of a mission's law whose poles make a difference."""
    pilot, _, _ = mission.autopilot()
    along = "tangential" if pilot.guidance.reference.holds_position else "speed"
    across = ("transverse",) if mission.law().path.components == 3 else ("transverse", "transverse_2")
    return *across, along, "yaw"


def _require_tuned(mission: Mission, name: str) -> None:
    """Raise `InputError` unless a mission's law becomes another one by other values of a quantity."""
    if name.startswith(f"{PATH}."):
        _require_curve(mission, name)
    elif not name.startswith(POLES):
        mission.retuned({name: 1.0})
    else:
        _require_acting(mission, name)


def _require_curve(mission: Mission, name: str) -> None:
    """Raise `InputError` unless a number of the path can be data for one program."""
    if not serves(mission.file, name):
        found = "an implicit path" if mission.file.path.is_implicit else "a feasible one"
        raise MissionError(
            f"{name} must be that of a curve, at a speed that is not made for it (got {found}); vary it as a list, each choice of which is "
            "a program of its own",
            name,
        )


def _require_acting(mission: Mission, name: str) -> None:
    """Raise `InputError` unless some poles are those of a chain that makes a difference."""
    own = mission.law()
    other = mission.retuned({name: -2 * max(abs(pole) for poles in own.poles.values() for pole in poles)})
    chains = acting_chains(mission)
    if all(own.poles[chain] == other.poles[chain] for chain in chains):
        raise InputError(f"{name} must be poles of a chain that acts (got another one); known are {', '.join(chains)}")
