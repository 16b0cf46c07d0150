"""What really flies: the true vehicle with its rotors, in wind, moved by commands that arrive late.

State: position, velocity, attitude, angular velocity (18 numbers), rotor speeds, and the commands that are on their way, oldest first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar.flight.integrator import Integrator
from gammastar.flight.variation import unknown_in
from gammastar.law.actuation import actuation_of
from gammastar.law.latency import pending_intervals
from gammastar.vehicle import Rotors, StateGraph, Vehicle

MOTION = 18  # position, velocity, attitude, angular velocity


@dataclass(frozen=True, eq=False)
class Plant:
    """A vehicle that takes one command a control interval: a wrench, or rotor speeds if it has rotors."""

    vehicle: Vehicle
    interval: float  # [s]
    substeps: int  # integration steps in an interval
    integrator: Integrator
    interface: str = "wrench"  # or 'rates': commands are thrust and body rates, followed by an inner loop
    thrust_scale: Any = 1.0  # of the rotors' thrust coefficients; a number or a graph
    lag_scale: Any = 1.0  # of the rotors' lag; a number or a graph

    @property
    def rotors(self) -> Rotors | None:
        """Return the rotors that are commanded; an inner loop keeps its own to itself."""
        return None if self.interface == "rates" else self.vehicle.rotors

    @property
    def rotor_count(self) -> int:
        """Return how many rotors there are."""
        return 0 if self.rotors is None else self.rotors.count

    @property
    def command_size(self) -> int:
        """Return how many numbers a command has."""
        return actuation_of(self.vehicle, self.interface).command_size

    @property
    def pending(self) -> int:
        """Return how many commands are on their way."""
        return pending_intervals(self.vehicle.latency, self.interval)

    @property
    def size(self) -> int:
        """Return how many numbers the state has."""
        return MOTION + self.rotor_count + self.pending * self.command_size

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return everything that enters the graph as a constant."""
        return (self.vehicle.signature, self.interval, self.substeps, self.integrator.name, self.interface)

    def start(self, state: Any) -> Any:
        """Graph: return the first state (size,) of a vehicle with a stacked state (20,), whose actuators give the thrust in it."""
        actuation = actuation_of(self.vehicle, self.interface)
        held = ca.vertcat(state[18], 0, 0, 0)
        if self.rotor_count:
            held = actuation.start(state[18] / self.thrust_scale)
        return ca.vertcat(state[:MOTION], *([held] if self.rotor_count else []), *([held] * self.pending))

    def acting(self, state: Any, command: Any) -> Any:
        """Graph: return the command that acts in this interval, when another one is given now; rotors take it within their limits."""
        acting = state[MOTION + self.rotor_count :][: self.command_size] if self.pending else command
        rotors = self.rotors
        return acting if rotors is None else ca.fmin(ca.fmax(acting, rotors.slowest), rotors.fastest)

    def speeds(self, state: Any, acting: Any) -> Any:
        """Graph: return the rotor speeds SX (n,) [rad/s] as the interval begins: those without lag are what is commanded."""
        if self.rotors is None:
            return ca.SX(0, 1)
        speeds = state[MOTION : MOTION + self.rotor_count]
        up, down = (float(lag == 0) for lag in np.asarray(self.rotors.lag))
        return ca.if_else(ca.if_else(acting > speeds, up, down), acting, speeds)

    def motion(self, state: Any, acting: Any) -> tuple[StateGraph, Any]:
        """Graph: return the motion with the thrust and its rate, and the wrench SX (4,), as the interval begins."""
        rotors, thrust_rate = self.rotors, ca.SX(0)
        wrench = acting
        if rotors is not None:
            speeds = self.speeds(state, acting)
            wrench = self._wrench(rotors, speeds)
            coefficient = self.thrust_scale * ca.DM(np.asarray(rotors.thrust_coefficient))
            thrust_rate = ca.sum1(2 * coefficient * speeds * self._speed_rates(speeds, acting))
        attitude, rates = ca.reshape(state[6:15], 3, 3), state[15:18]
        if self.interface == "rates":
            gyroscopic = ca.cross(rates, self.vehicle.momentum(rates))
            wrench = ca.vertcat(acting[0], self.vehicle.momentum(self._following(rates, acting)) + gyroscopic)
        return StateGraph(state[0:3], state[3:6], attitude, rates, wrench[0], thrust_rate), wrench

    def _following(self, angular_velocity: Any, acting: Any) -> Any:
        """Graph: return the angular acceleration SX (3,) [rad/s^2] with which an inner loop follows commanded body rates."""
        return self.vehicle.rate_bandwidth * (acting[1:] - angular_velocity)

    def step(self, state: Any, command: Any, wind: Any) -> Any:
        """Graph: return the state SX (size,) after an interval in steady wind SX (3,) [m/s], when a command is given at its start."""
        acting, attitude = self.acting(state, command), ca.reshape(state[6:15], 3, 3)
        symbols = [ca.SX.sym("attitude", 3, 3), ca.SX.sym("euclidean", 9)]
        constants = [
            ca.SX.sym("speeds", self.rotor_count),
            ca.SX.sym("command", self.command_size),
            ca.SX.sym("wind", 3),
        ]
        length = self.interval / self.substeps

        def field(now: float, attitude: Any, euclidean: Any) -> tuple[Any, Any]:
            speeds, command, wind = constants
            return self._field(attitude, euclidean, self._followed(speeds, command, now), command, wind)

        moved = self.integrator.advance(field, 0.0, symbols[0], symbols[1], length)
        results = [*moved, self._followed(constants[0], constants[1], length)]
        free = unknown_in(results, [*symbols, *constants])
        substep = ca.Function("substep", [*symbols, *constants, free], ca.cse(results))
        euclidean, speeds = ca.vertcat(state[0:6], state[15:MOTION]), self.speeds(state, acting)
        for _ in range(self.substeps):
            attitude, euclidean, speeds = substep(attitude, euclidean, speeds, acting, wind, free)
        queue = ca.vertcat(state[MOTION + self.rotor_count :], command)[self.command_size :]
        pending = queue if self.pending else ca.SX(0, 1)
        return ca.vertcat(euclidean[:6], ca.vec(attitude), euclidean[6:], speeds, pending)

    def _field(self, attitude: Any, euclidean: Any, speeds: Any, command: Any, wind: Any) -> tuple[Any, Any]:
        """Graph: return the body rates, and the rates of everything but the attitude and the rotors."""
        velocity, rates = euclidean[3:6], euclidean[6:9]
        wrench = command if self.rotors is None else self._wrench(self.rotors, speeds)
        state = StateGraph(euclidean[0:3], velocity, attitude, rates, wrench[0], ca.SX(0))
        acceleration = self.vehicle.acceleration(state, wind=wind)
        by_rates = self.interface == "rates"
        turning = self._following(rates, command) if by_rates else self.vehicle.angular_acceleration(rates, wrench[1:])
        return rates, ca.vertcat(velocity, acceleration, turning)

    def _wrench(self, rotors: Rotors, speeds: Any) -> Any:
        """Graph: return the wrench SX (4,) of rotors at speeds SX (n,); their yaw torque does not scale with the thrust."""
        return ca.vertcat(*(3 * [self.thrust_scale]), 1) * rotors.wrench(rotors.thrusts(speeds))

    def _followed(self, speeds: Any, command: Any, time: float) -> Any:
        """Graph: return the rotor speeds SX (n,) [rad/s] a time [s] into a held command: known exactly, however short the lag.

        With a lag that is longer by a factor all takes longer by that factor.
        """
        return speeds if self.rotors is None else self.rotors.advanced(speeds, command, time / self.lag_scale)

    def _speed_rates(self, speeds: Any, command: Any) -> Any:
        """Graph: return the rates of the rotor speeds SX (n,) [rad/s^2], zero where there is no lag."""
        if self.rotors is None:
            return ca.SX(0, 1)
        up, down = (1 / lag if lag > 0 else 0.0 for lag in np.asarray(self.rotors.lag))
        return (command - speeds) * ca.if_else(command > speeds, up, down) / self.lag_scale
