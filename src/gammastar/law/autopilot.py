"""Everything that runs on the vehicle's computer, as one graph of a control interval with explicit state.

(state, what is measured, time, data of path and reference) -> (next state, command, telemetry).  In their order: the estimator, the
observer of what is unknown, the state predicted to when the command will be felt, the law there, the allocation, the thrust states.

The two thrust states zeta1, zeta2 are the law's own.  Where the rotors give another thrust than zeta1, zeta1 takes to what they give, so
it does not wind up.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar import engine
from gammastar.law.actuation import Actuation, Given, actuation_of
from gammastar.law.allocation import Extra
from gammastar.law.approach import FLOOR_SHARE
from gammastar.law.belief import Belief
from gammastar.law.filter import MOTION
from gammastar.law.guidance import Decision, Guidance, Surroundings
from gammastar.law.latency import pending_intervals
from gammastar.law.law import Law
from gammastar.law.lookahead import ahead
from gammastar.law.measurement import SIZE as MEASUREMENT_SIZE
from gammastar.law.measurement import Measurement, split_measurement
from gammastar.law.piecewise import DATA_SIZE
from gammastar.law.rates import RateDecision, decide_by_rates
from gammastar.law.thrust_states import SIZE as THRUST_SIZE
from gammastar.law.thrust_states import ThrustStates
from gammastar.lookup import graph_at
from gammastar.vehicle import StateGraph, Unknown, Vehicle

SLOWING = 6.0  # [1/s] at which the speed along the path is given up while thrust is short ...
RESUMING = 0.1  # [1/s] ... and asked for again afterwards
BEND_SHARE = 0.2  # of the most thrust, from which the bend of the path counts as the reason
NO_CEILING = 1e30  # [N]
SHORT = 1e-6  # of the wanted thrust, by which less counts as short
ALONG_SHARE = 0.5  # of gravity: acceleration along the path that limits of the rotors may cost before yaw pays too
TELEMETRY = {"input": 4, "waiting": 1, "constrained": 1, "given_up": 1, "unknown": 12, "position": 3}
TELEMETRY_SIZE = sum(TELEMETRY.values())


class Stepped(NamedTuple):
    """Graph: what one control interval of an autopilot gives."""

    state: Any  # SX (size,), at the end
    command: Any  # SX (command_size,), to the vehicle
    telemetry: Any  # SX (22,), see `TELEMETRY`
    parameter: Any  # SX, of the point of the path that is followed
    waiting: Any  # SX, 1 while that point waits as a target


@dataclass(frozen=True, eq=False)
class Autopilot:
    """A law with its guidance, as it runs once a control interval."""

    guidance: Guidance
    interval: float  # [s]
    predicts: bool = True  # the state at which the command will be felt; without, the law takes the measured one

    @property
    def law(self) -> Law:
        """Return the law that is flown."""
        return self.guidance.law

    @property
    def vehicle(self) -> Vehicle:
        """Return the vehicle as it is believed to be."""
        return self.guidance.law.vehicle

    @property
    def actuation(self) -> Actuation:
        """Return how commands reach the vehicle."""
        return actuation_of(self.law.vehicle, self.law.interface)

    @property
    def belief(self) -> Belief:
        """Return how it comes to know its motion and what is unknown."""
        return Belief(self.law, self.interval)

    @functools.cached_property
    def thrust_states(self) -> ThrustStates:
        """Return how the thrust states move."""
        return ThrustStates(self.interval, self.law.interface == "rates", *self.thrust_range)

    @property
    def pending(self) -> int:
        """Return how many control intervals pass between a measurement and the beginning of what its command does."""
        return pending_intervals(self.vehicle.latency, self.interval)

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return everything that enters the graph as a constant."""
        return (self.guidance.signature, self.interval, self.predicts)

    @property
    def sizes(self) -> dict[str, int]:
        """Return the parts of the state in their order, with their sizes."""
        return {
            "parameter": 1,  # of the path, as tracked
            "waiting": 1,
            "pace": 1,  # share of the speed along the path that is asked for
            "thrust": THRUST_SIZE,
            "held": 4,  # wrench reached in the interval before [N, N m], or thrust and body rates commanded [N, rad/s]
            "actuation": self.actuation.size,
            "history": 4
            * (self.pending + 1),  # mean wrenches of the interval just flown and of those to come, oldest first
            "rejection": 0 if self.law.rejection is None else self.law.rejection.size,
            "estimate": 0 if self.law.estimator is None else self.law.estimator.size,
        }

    @property
    def size(self) -> int:
        """Return how many numbers the state has."""
        return sum(self.sizes.values())

    def start(self, state: np.ndarray, parameter: float) -> np.ndarray:
        """Return the first state (size,) of a vehicle whose stacked state (20,), nearest to a parameter of the path, is known."""
        waiting = float(self.guidance.starts_waiting(state, parameter))
        return np.array(self.started(ca.DM(state[:MOTION]), state[18], state[19], parameter, waiting)).ravel()

    def started(self, motion: Any, thrust: Any, thrust_rate: Any, parameter: Any, waiting: Any) -> Any:
        """Graph: return the first state (size,) from the motion (18,), the thrust [N] and its rate [N/s], and where the path begins."""
        wrench = ca.vertcat(thrust, 0, 0, 0)
        rejection, estimate = self.belief.start(motion, thrust)
        parts = {
            "parameter": parameter,
            "waiting": waiting,
            "pace": 1,
            "thrust": self.thrust_states.start(thrust, thrust_rate),
            "held": wrench,
            "actuation": self.actuation.start(thrust),
            "history": ca.repmat(wrench, self.pending + 1),
            "rejection": rejection,
            "estimate": estimate,
        }
        return ca.vertcat(*(parts[name] for name in self.sizes))

    @property
    def thrust_range(self) -> tuple[float, float]:
        """Return the thrusts [N] between which the law keeps zeta1: its floor, and what the rotors give."""
        approach, rotors = self.law.approach, self.vehicle.rotors
        floor = -np.inf if approach is None else approach.floor(self.vehicle)
        if rotors is None:
            return floor, np.inf
        least, most = rotors.thrust_range
        return max(floor, FLOOR_SHARE * (self.vehicle.weight or most), least), most

    def step(self, state: Any, measurement: Any, time: Any, around: Surroundings) -> Stepped:
        """Graph: return what the autopilot does from a state SX (size,) and a measurement SX (22,) at a time."""
        now = dict(zip(self.sizes, ca.vertsplit(state, [0, *np.cumsum(list(self.sizes.values()))]), strict=True))
        path = self.law.path
        history = ca.horzsplit(ca.reshape(now["history"], 4, self.pending + 1))
        measured = split_measurement(measurement)
        told, estimate = self.belief.estimated(now["estimate"], now["rejection"], measured, history[0])
        at_place = path.track(told.position, ca.vertcat(now["parameter"], around.path))
        place = ca.if_else(now["waiting"], now["parameter"], at_place)
        rejection, unknown = self.belief.rejected(
            now["rejection"], told, measured, history[0], ca.vertcat(place, around.path)
        )
        seen, later = self._predicted(now, told, history, unknown)
        following = path.track(seen.position, ca.vertcat(now["parameter"], around.path))
        tracked = ca.if_else(now["waiting"], now["parameter"], following)
        parameter, still = self.guidance.mode(seen, tracked, now["waiting"], around.path)
        waiting = ca.logic_or(now["waiting"], still)  # a target that is captured is followed from the next interval on
        at = (seen, tracked, waiting, time + self.horizon, around, later, now["pace"])
        if self.law.interface == "rates":
            slow = decide_by_rates(self.guidance, *at)
            thrust, given, told_input, short = self._actuated_by_rates(now, slow)
            parameter_rate, constrained, turning = slow.parameter_rate, slow.constrained, slow.turning
        else:
            decision = self.guidance.decide(*at)
            thrust, given, told_input, short = self._actuated(now, decision)
            parameter_rate, constrained, turning = decision.parameter_rate, decision.constrained, decision.turning
        parts = {
            "parameter": parameter + self.interval * parameter_rate,
            "waiting": still,
            "pace": self._paced(now["pace"], short, turning),
            "thrust": thrust,
            "held": given.reached,
            "actuation": given.memory,
            "history": ca.vertcat(*history[1:], given.mean),
            "rejection": rejection,
            "estimate": estimate,
        }
        told_of = {
            "input": told_input,
            "waiting": waiting,
            "constrained": ca.logic_or(constrained, given.given_up > 0),
            "given_up": given.given_up,
            "unknown": ca.vertcat(*(ca.SX(ca.DM(each)) if isinstance(each, tuple) else each for each in unknown)),
            "position": told.position,
        }
        telemetry = ca.vertcat(*(told_of[name] for name in TELEMETRY))
        return Stepped(ca.vertcat(*(parts[name] for name in self.sizes)), given.command, telemetry, parameter, waiting)

    def _paced(self, pace: Any, short: Any, turning: Any) -> Any:
        """Graph: return the pace of the next interval: slower while thrust is short, and slowly back to the whole speed.

        Only where the bend of the path takes some of the thrust: a vehicle that turns over has less than it wants at any speed.
        """
        bends = turning * self.vehicle.moved_mass > BEND_SHARE * min(self.thrust_range[1], NO_CEILING)
        rate = ca.if_else(ca.logic_and(short, bends), -SLOWING, RESUMING * (1 - pace))
        return ca.fmin(ca.fmax(pace + self.interval * rate, 0), 1)

    @property
    def dearest_along(self) -> Any:
        """Return the most of the highest derivative along the path that may be given up [m/s^4].

        As much as an error of the acceleration along of half of gravity asks for.  Without a bound the price of an attitude far from
        the wanted one is a jump along the path of any size, and a vehicle of little thrust is thrown off.
        """
        vehicle = self.vehicle
        thrust = vehicle.weight or (vehicle.rotors.thrust_range[1] if vehicle.rotors else vehicle.mass)
        return ALONG_SHARE * thrust / vehicle.moved_mass * self.law.gains["speed"][1]

    @property
    def horizon(self) -> float:
        """Return the time [s] from a measurement to when its command is felt, in the mean."""
        return self.pending * self.interval + self.actuation.delay(self.interval) if self.predicts else 0.0

    def _predicted(
        self, now: dict[str, Any], told: Measurement, history: list[Any], unknown: Unknown
    ) -> tuple[StateGraph, Unknown]:
        """Graph: return the state, and what is unknown, when the command of this interval is felt.

        The wrenches on their way act one after the other; then the one that is given goes over to the one that is held.
        """
        zeta1, zeta2 = self.thrust_states.seen(now["thrust"])
        moved = StateGraph(told.position, told.velocity, told.attitude, told.angular_velocity, zeta1, zeta2)
        if not self.predicts:
            return moved, unknown
        for k, wrench in enumerate(history[1:]):
            moved = self.belief.lookahead.moved(moved, wrench, wrench, self.interval, ahead(unknown, k * self.interval))
        first = self.actuation.now(now["actuation"], now["held"])
        last = ca.vertcat(zeta1, now["held"][1:])
        waited, delay = self.pending * self.interval, self.actuation.delay(self.interval)
        moved = self.belief.lookahead.moved(moved, first, last, delay, ahead(unknown, waited))
        return moved, ahead(unknown, waited + delay)

    def _actuated_by_rates(self, now: dict[str, Any], decision: RateDecision) -> tuple[Any, Given, Any, Any]:
        """Graph: return the next thrust states, what is given, the input that this means, and whether thrust is short."""
        least, most = self.thrust_states.bounds(now["thrust"])
        thrust_rate = ca.fmin(ca.fmax(decision.thrust_rate, least), most)
        thrust = self.thrust_states.advanced(now["thrust"], None, thrust_rate)
        command = ca.vertcat((now["thrust"][0] + thrust[0]) / 2, decision.rates)
        given = Given(command, ca.SX(0, 1), command, command, ca.SX(0), 3 * (thrust_rate != decision.thrust_rate))
        return thrust, given, ca.vertcat(0, decision.rates), decision.thrust_rate > most

    def _actuated(self, now: dict[str, Any], decision: Decision) -> tuple[Any, Given, Any, Any]:
        """Graph: return the next thrust states, what is given, the input SX (4,) that this means, and whether thrust is short."""
        (zeta1, _), (least, most) = self.thrust_states.seen(now["thrust"]), self.thrust_states.bounds(now["thrust"])
        along = decision.along()
        base, direction = ca.vertcat(zeta1, decision.free[1:]), ca.vertcat(0, along[1:])
        limits = Extra(decision.free[0], along[0], least, most)
        most_along = self.dearest_along * decision.per_metre
        given = self.actuation.give(
            now["actuation"], base, direction, ca.SX(0), [limits], (-most_along, most_along), self.interval
        )
        wanted = decision.free[0] + along[0] * given.along
        thrust_ddot = ca.fmin(ca.fmax(wanted, least), most)
        thrust = self.thrust_states.advanced(now["thrust"], given.reached[0], thrust_ddot)
        short = ca.logic_or(wanted > most, given.reached[0] < (1 - SHORT) * zeta1)
        return thrust, given, ca.vertcat(thrust_ddot, given.reached[1:]), short

    def function(self) -> Any:
        """Return the function (state, measurement (22,), time, reference data) -> (next state, command, telemetry) for use by itself.

        The data of the path are looked up in it; those of a reference over time, SX (20,), come from `Piecewise.data`.
        """
        core = engine.compiled(("autopilot", *self.signature), self._core)
        state, told = ca.MX.sym("state", self.size), ca.MX.sym("measurement", MEASUREMENT_SIZE)
        time, wanted = ca.MX.sym("time"), ca.MX.sym("reference", DATA_SIZE)
        reference = self.guidance.reference
        used = graph_at([reference.lookup], state[0]) if reference.over_progress else wanted
        outputs = core(state, told, time, used, graph_at(self.law.path.lookups, state[0]))
        return ca.Function("autopilot", [state, told, time, wanted], list(outputs))

    def _core(self) -> Any:
        state, told, time = ca.SX.sym("state", self.size), ca.SX.sym("measurement", MEASUREMENT_SIZE), ca.SX.sym("time")
        reference, path = ca.SX.sym("reference", DATA_SIZE), ca.SX.sym("path", self.law.path.data_size)
        stepped = self.step(state, told, time, Surroundings(path, reference))
        outputs = ca.cse([ca.densify(each) for each in stepped[:3]])
        return ca.Function("core", [state, told, time, reference, path], outputs)
