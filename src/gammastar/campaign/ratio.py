"""The thrust to weight of every flight of a campaign, which no row tells, from the mission and what varies of it."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from gammastar.errors import GammastarError
from gammastar.mission import Mission
from gammastar.mission.load import parse
from gammastar.vehicle import Buoyancy

THRUST, MASS = "truth.thrust_scale", "truth.mass_scale"
OTHERS = ("vehicle.", "truth.center_of_mass", "truth.forces")  # keys that change it in ways that no factor tells


def thrust_to_weight(mission: str, columns: Collection[str]) -> str | None:
    """Return the most thrust without torque over the weight, of the vehicle that flies, as SQL over columns of rows.

    None where it does not vary, where the vehicle has no rotors or no weight, or where other things vary that change it.

    Args:
        mission: In TOML.
        columns: Of the rows.
    """
    if not {THRUST, MASS} & set(columns) or any(f"{name}.".startswith(OTHERS) for name in columns):
        return None
    try:
        chosen = parse(mission)
    except GammastarError:  # the rows of another version can be read, even where its missions cannot be flown any more
        return None
    vehicle, truth = chosen.truth(), chosen.file.truth
    own = np.asarray(truth.thrust_scale)
    flies_by_rates = chosen.law().interface == "rates"  # such flights have no rotors
    if vehicle.rotors is None or flies_by_rates or vehicle.weight == 0 or own.shape != () or _by_rotor(chosen):
        return None
    lift = sum(float(force.lift) for force in vehicle.forces if isinstance(force, Buoyancy))
    thrust, weight = vehicle.rotors.thrust_range[1], chosen.law().vehicle.mass * vehicle.gravity
    scaled = f"{thrust / float(own):.17e} * {_name(THRUST) if THRUST in columns else f'{float(own):.17e}'}"
    mass = _name(MASS) if MASS in columns else f"{truth.mass_scale:.17e}"
    return f"{scaled} / nullif(abs({weight:.17e} * {mass} - {lift:.17e}), 0)"


def _by_rotor(mission: Mission) -> bool:
    """Return whether thrust scales of single rotors vary; of these lists the column tells places alone."""
    varied = {} if mission.file.campaign is None else mission.file.campaign.distributions(mission.quantities)
    return any(np.ndim(choice) for choice in getattr(varied.get(THRUST), "choices", ()))


def _name(column: str) -> str:
    return f'"{column}"'
