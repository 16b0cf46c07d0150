"""What the law is told by sensors with noise, rates, biases, delays and lost samples; drawn as in `draws`."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar import so3
from gammastar.checks import instance, magnitudes, number, three
from gammastar.errors import InputError
from gammastar.flight.draws import LOST, PER_SENSOR, Draws, evaluated, sensor_errors, sensor_pairs
from gammastar.law.measurement import CHANNELS, freshness
from gammastar.vehicle import StateGraph

WIDTHS = (3, 3, 9, 3)  # numbers of a measurement by channel
HELD = sum(WIDTHS)
MOST_DELAY = 500  # control intervals of delay; every one is kept in the state of the loop
ROUNDING = 1e-6  # of an interval, by which a delay or a sampling instant may miss whole intervals


@dataclass(frozen=True, eq=False)
class Channel:
    """One sensor: what it adds to the truth, how often it samples, how late it is and how often a sample is lost.

    Raises:
        InputError: A deviation or a delay is negative, a rate is not positive, or dropout is not a probability below one.
    """

    deviation: ArrayLike = (
        0.0  # standard deviation of one sample, scalar or (3,): [m], [m/s], [rad], [rad/s] by channel
    )
    rate: ArrayLike | None = (
        None  # [Hz], scalar or (3,); None, or above the control rate, is once every control interval
    )
    bias: ArrayLike = 0.0  # constant error, scalar or (3,), unit and axes of the deviation
    delay: float = 0.0  # [s], rounded up to whole control intervals
    dropout: float = 0.0  # probability that a sample is lost; the one before is held on

    def __post_init__(self) -> None:
        for name in ("deviation", "bias"):
            values = magnitudes(three(getattr(self, name), f"{name} of a sensor"), f"{name} of a sensor", (3,))
            object.__setattr__(self, name, values)
        if np.any(np.asarray(self.deviation) < 0):
            raise InputError(
                f"deviation of a sensor must not be negative (got {np.asarray(self.deviation).tolist()}); give standard deviations"
            )
        if self.rate is not None:
            rate = three(self.rate, "rate of a sensor [Hz]")
            if np.any(rate <= 0):
                raise InputError(
                    f"rate of a sensor [Hz] must be positive (got {rate.tolist()}); leave it out for every control interval"
                )
            object.__setattr__(self, "rate", rate)
        object.__setattr__(self, "delay", number(self.delay, "delay of a sensor [s]", at_least=0))
        object.__setattr__(self, "dropout", number(self.dropout, "dropout of a sensor", at_least=0))
        if self.dropout >= 1:
            raise InputError(
                f"dropout of a sensor must be a probability below one (got {self.dropout:g}); give the share of lost samples"
            )

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return everything that enters a graph as a constant."""
        rate = None if self.rate is None else tuple(np.asarray(self.rate))
        return (*np.asarray(self.deviation), *np.asarray(self.bias), rate, self.dropout)

    def late(self, control_rate: float) -> int:
        """Return the delay in control intervals, rounded up.

        Raises:
            InputError: Too many of them.
        """
        wanted = self.delay * control_rate
        if wanted > MOST_DELAY:
            raise InputError(
                f"delay of a sensor must be at most {MOST_DELAY} control intervals (got {wanted:.4g}); shorten it or lower the control rate"
            )
        return math.ceil(wanted - ROUNDING)

    def axes_sampled(self, step: Any, control_rate: float) -> Any:
        """Graph: return SX (3,) flags of the axes that are sampled in a control interval; all are in the first one, step 0.

        Where floor(k f / F) grows: the mean rate is f, and no gap differs from another by more than one interval.
        """
        if self.rate is None:
            return ca.SX.ones(3)
        share = ca.DM(np.minimum(np.asarray(self.rate) / control_rate, 1))
        return ca.floor(share * step + ROUNDING) - ca.floor(share * (step - 1) + ROUNDING)


@dataclass(frozen=True, eq=False)
class Sensors:
    """Four sensors of a vehicle; between samples each holds its last one.

    Sample k of a channel depends on seed, flight, channel and k alone: neither on the other channels nor on the length of the flight.
    The memory of the loop holds the last samples and, for each channel, the true values that are on their way.  Attitude errors are
    rotation vectors in body axes, R exp(error), and all axes of an attitude are sampled at once.
    """

    position: Channel = Channel()  # [m], world axes
    velocity: Channel = Channel()  # [m/s], world axes
    attitude: Channel = Channel()  # [rad], body axes
    angular_velocity: Channel = Channel()  # [rad/s], body axes

    def __post_init__(self) -> None:
        for name in CHANNELS:
            instance(getattr(self, name), Channel, f"sensor of {name}", "make one with gs.Channel()")
        if self.attitude.rate is not None and np.ptp(np.asarray(self.attitude.rate)) > 0:
            raise InputError(
                f"rate of the attitude sensor [Hz] must be one number (got {np.asarray(self.attitude.rate).tolist()}); "
                "a rotation is measured whole"
            )

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Return the four channels in their order."""
        return self.position, self.velocity, self.attitude, self.angular_velocity

    def deviations(self) -> dict[str, np.ndarray]:
        """Return the standard deviations (3,) of one sample by channel, which is what a filter needs to know."""
        return {name: np.asarray(channel.deviation) for name, channel in zip(CHANNELS, self.channels, strict=True)}

    def size(self, control_rate: float) -> int:
        """Return how many numbers the sensors remember at a control rate [Hz]."""
        return HELD + sum(
            width * channel.late(control_rate) for width, channel in zip(WIDTHS, self.channels, strict=True)
        )

    @property
    def is_noisy(self) -> bool:
        """Return whether any sample has noise."""
        return any(np.any(deviation) for deviation in self.deviations().values())

    def scaled(self, factor: float) -> Sensors:
        """Return sensors with every standard deviation multiplied by a factor; biases, rates, delays and losses stay."""
        deviations = [factor * np.asarray(each.deviation) for each in self.channels]
        pairs = zip(self.channels, deviations, strict=True)
        return Sensors(*(dataclasses.replace(channel, deviation=deviation) for channel, deviation in pairs))

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return everything that enters the graph of `drawn` as a constant."""
        return tuple(each.signature for each in self.channels)

    def start(self, state: Any, control_rate: float) -> Any:
        """Graph: return the memory (size,) of a vehicle that has long been in a stacked state (20,), with errors by the biases alone."""
        truth = ca.vertsplit(state[:HELD], [0, *np.cumsum(WIDTHS).tolist()])
        biases = [ca.DM(np.asarray(channel.bias)) for channel in self.channels]
        turned = so3.stack(so3.unstack(truth[2]) @ ca.DM(so3.exp(self.attitude.bias)))
        held = [truth[0] + biases[0], truth[1] + biases[1], turned, truth[3] + biases[3]]
        late = [value for value, each in zip(truth, self.channels, strict=True) for _ in range(each.late(control_rate))]
        return ca.vertcat(*held, *late)

    @property
    def pairs(self) -> tuple[int, ...]:
        """Return the pairs of random numbers that a step draws."""
        channels = enumerate(self.channels)
        return tuple(p for i, each in channels for p in sensor_pairs(i, np.asarray(each.deviation), each.dropout))

    def drawn(self, step: Any, draws: Draws, control_rate: float, scale: Any = 1.0) -> Any:
        """Graph: return SX (24,), by channel the error (3,) of a sample taken now and flags (3,) of the axes whose sample arrives.

        The noise in the errors is scaled by a number or a graph.
        """
        rows = []
        for index, channel in enumerate(self.channels):
            noise = sensor_errors(index, np.asarray(channel.deviation), draws)
            rows.append(ca.DM(np.asarray(channel.bias)) + scale * noise)
            kept = draws.uniform(PER_SENSOR * index + LOST)[0] >= channel.dropout if channel.dropout > 0 else 1
            rows.append(kept * channel.axes_sampled(step, control_rate))
        return ca.vertcat(*rows)

    def exogenous(self, seed: int, intervals: int, control_rate: float, flight: int = 0) -> np.ndarray:
        """Return `drawn` as numbers (24, intervals) of a flight."""
        return evaluated(lambda k, d: self.drawn(k, d, control_rate), self.pairs, seed, np.arange(intervals), flight)

    def measured(self, memory: Any, state: StateGraph, outside: Any, control_rate: float) -> tuple[Any, Any]:
        """Graph: return the next memory SX (size,) and the measurement SX (22,) of one control interval.

        Args:
            memory: SX (size,), from the interval before.
            state: True state at the start of the interval.
            outside: SX (24,), from `drawn`.
            control_rate: [Hz].
        """
        truth = [state.position, state.velocity, so3.stack(state.attitude), state.angular_velocity]
        held = ca.vertsplit(memory[:HELD], [0, 3, 6, 15, 18])
        samples, fresh, kept, first = [], [], [], HELD
        for index, (width, channel) in enumerate(zip(WIDTHS, self.channels, strict=True)):
            last = first + width * channel.late(control_rate)
            queue = ca.vertcat(memory[first:last], truth[index])  # the oldest in front
            sample, first = queue[:width], last
            kept.append(queue[width:])
            error, axes = outside[6 * index : 6 * index + 3], outside[6 * index + 3 : 6 * index + 6]
            if width == 9:
                sample, new = so3.stack(so3.unstack(sample) @ so3.exp(error)), axes[0]
            else:
                sample, new = sample + error, axes
            samples.append(new * sample + (1 - new) * held[index])
            fresh.append(freshness(axes))
        told = ca.vertcat(*samples)
        return ca.vertcat(told, *kept), ca.vertcat(told, *fresh)


# Measured on an AscTec Hummingbird: Path-Flyer, Rubi et al.  For the third velocity no rate is printed: the height's is taken.
PATH_FLYER = Sensors(
    position=Channel((0.0224, 0.0224, 0.001), rate=(5, 5, 100)),
    velocity=Channel((0.0224, 0.0224, 0.001), rate=(5, 5, 100)),
    attitude=Channel(0.001, rate=100),
    angular_velocity=Channel((0.01, 0.01, 0.001), rate=100),
)
