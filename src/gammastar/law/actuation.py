"""How a wanted wrench reaches the vehicle: as it is, or through rotors with limits and lag.

Both kinds believe that the command acts from the beginning of an interval on, are asked for a wrench at its middle (`delay` says when
that is felt), and tell what the vehicle really gets, so that observers and thrust states are fed by that and not by wishes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import casadi as ca
import numpy as np

from gammastar.law.allocation import Extra, allocate
from gammastar.vehicle import Rotors, Vehicle

REMAINING_SHARE = (
    1 / 3
)  # of a lag: with less left, rotors have next to nothing to reach within an interval, and the law chatters


class Given(NamedTuple):
    """Graph: what becomes of a wanted wrench."""

    command: Any  # SX (command_size,), to the vehicle
    memory: Any  # SX (size,), at the end of the interval in which the command acts
    mean: Any  # SX (4,) wrench [N, N m], mean over that interval
    reached: Any  # SX (4,) wrench that is given in place of the wanted one
    along: Any  # SX, tangential input that is left
    given_up: Any  # SX, 0 nothing, 1 along, 2 yaw torque, 3 thrust, 4 roll and pitch torque


class Actuation(Protocol):
    """What an autopilot needs to know of the way from a wanted wrench to a real one."""

    @property
    def size(self) -> int:
        """Return how many numbers it remembers."""

    @property
    def command_size(self) -> int:
        """Return how many numbers a command has."""

    def delay(self, interval: float) -> float:
        """Return the time [s] from the beginning of an interval to when the wrench of its command is felt, in the mean."""

    def start(self, thrust: Any) -> Any:
        """Graph: return the first memory (size,) of a vehicle that gives a thrust [N] and no torque."""

    def now(self, memory: Any, held: Any) -> Any:
        """Graph: return the wrench SX (4,) at the beginning of the interval, from the one SX (4,) reached in the interval before."""

    def give(
        self, memory: Any, base: Any, direction: Any, along: Any, extras: Sequence[Extra], within: Any, interval: float
    ) -> Given:
        """Graph: return what becomes of the wrench base + direction along, SX (4,) each, with `along` SX within two ends."""


@dataclass(frozen=True, eq=False)
class Direct:
    """The vehicle takes the wrench itself, at once and without limits, and holds it."""

    @property
    def size(self) -> int:
        """Return zero: nothing to remember."""
        return 0

    @property
    def command_size(self) -> int:
        """Return four: thrust and torque."""
        return 4

    def delay(self, interval: float) -> float:
        """Return half the interval."""
        return interval / 2

    def start(self, thrust: Any) -> Any:
        """Graph: return nothing."""
        return ca.DM(0, 1)

    def now(self, memory: Any, held: Any) -> Any:
        """Graph: return the wrench held until now."""
        return held

    def give(
        self, memory: Any, base: Any, direction: Any, along: Any, extras: Sequence[Extra], within: Any, interval: float
    ) -> Given:
        """Graph: return the wrench as wanted."""
        wrench = base + direction * along
        return Given(wrench, memory, wrench, wrench, along, ca.SX(0))


@dataclass(frozen=True, eq=False)
class RotorSpeeds:
    """Commands are rotor speeds; limits are kept by priority, and a lag is made up for by commanding ahead of it.

    Believed speeds w follow a command c as w' = (c - w) / lag.  To reach the wanted speed with the remaining lag tau_e only, the command is
    c = w + (b / a) (wanted - w) with a = 1 - exp(-h / lag) and b = 1 - exp(-h / tau_e): the inverse of the lag behind a filter of the
    pole 1 / tau_e, with nothing that could wind up, because w is what the cut command really does.
    """

    rotors: Rotors
    remaining_share: float = REMAINING_SHARE  # of the lag; less than an interval is made up for within it

    @property
    def size(self) -> int:
        """Return how many rotors there are: their believed speeds are remembered."""
        return self.rotors.count

    @property
    def command_size(self) -> int:
        """Return how many rotors there are."""
        return self.rotors.count

    def shares(self, interval: float) -> tuple[float, float, float]:
        """Return a, b and the mean lag [s]: the shares of a step that rotors make, and are asked to make, in an interval [s]."""
        lag = float(np.mean(np.asarray(self.rotors.lag)))
        if lag == 0:
            return 1.0, 1.0, 0.0
        remaining = self.remaining_share * lag
        return -np.expm1(-interval / lag), -np.expm1(-interval / remaining) if remaining > interval else 1.0, lag

    def delay(self, interval: float) -> float:
        """Return the centroid of the response to a command: half the interval, what the hold adds to the lag, what is left of it."""
        a, b, lag = self.shares(interval)
        return interval / 2 + (interval + lag - interval / a) + interval * (1 - b) / b

    def start(self, thrust: Any) -> Any:
        """Graph: return the rotor speeds (n,) [rad/s] that share a thrust [N], as far as the limits allow."""
        thrusts = ca.DM(np.linalg.pinv(self.rotors.mixer)[:, 0]) * thrust
        speeds = ca.sqrt(ca.fmax(thrusts, 0) / ca.DM(np.asarray(self.rotors.thrust_coefficient)))
        return ca.fmin(ca.fmax(speeds, self.rotors.slowest), self.rotors.fastest)

    def now(self, memory: Any, held: Any) -> Any:
        """Graph: return the wrench SX (4,) of the believed rotor speeds."""
        return self.rotors.wrench(self.rotors.thrusts(memory))

    def give(
        self, memory: Any, base: Any, direction: Any, along: Any, extras: Sequence[Extra], within: Any, interval: float
    ) -> Given:
        """Graph: return the wrench that rotors can reach, and the speeds to command for it."""
        rotors, (_, b, _) = self.rotors, self.shares(interval)
        lowest, highest = rotors.reachable(memory, interval, b)
        allocated = allocate(rotors, base, direction, along, lowest, highest, extras, within)
        wanted = ca.sqrt(allocated.thrusts / ca.DM(np.asarray(rotors.thrust_coefficient)))
        command = rotors.commands(memory, memory + b * (wanted - memory), interval)
        mean = rotors.wrench(rotors.mean_thrusts(memory, command, interval))
        after = rotors.advanced(memory, command, interval)
        return Given(command, after, mean, allocated.wrench, allocated.along, allocated.given_up)


def actuation_of(vehicle: Vehicle, interface: str) -> Actuation:
    """Return how a vehicle takes commands: by its rotors if it has any; otherwise, or when it takes body rates, as they are."""
    return Direct() if vehicle.rotors is None or interface == "rates" else RotorSpeeds(vehicle.rotors)
