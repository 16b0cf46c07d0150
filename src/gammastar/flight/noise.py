"""White noise on everything that the law measures, one sample a control interval; drawn as in `draws`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar import so3
from gammastar.checks import magnitudes, number
from gammastar.errors import InputError
from gammastar.flight.draws import Draws, evaluated, sensor_errors, sensor_pairs
from gammastar.law.measurement import CHANNELS
from gammastar.vehicle import StateGraph

SIZE = 12  # of a sample: three numbers a channel


@dataclass(frozen=True, eq=False)
class SensorNoise:
    """Standard deviations of white noise, one sample per control interval; thrust states are the law's own and exact."""

    position: ArrayLike = (0.0, 0.0, 0.0)  # (3,) [m], world axes
    velocity: ArrayLike = (0.0, 0.0, 0.0)  # (3,) [m/s], world axes
    attitude: ArrayLike = (0.0, 0.0, 0.0)  # (3,) [rad], rotation vector in body axes: measured R is R exp(noise)
    angular_velocity: ArrayLike = (0.0, 0.0, 0.0)  # (3,) [rad/s], body axes

    def __post_init__(self) -> None:
        for channel in CHANNELS:
            values = magnitudes(getattr(self, channel), f"noise of {channel}", (3,))
            if np.any(values < 0):
                raise InputError(
                    f"noise of {channel} must not be negative (got {values.tolist()}); give standard deviations"
                )
            object.__setattr__(self, channel, values)

    def deviations(self) -> np.ndarray:
        """Return the twelve standard deviations in the order of the channels."""
        return np.concatenate([np.asarray(getattr(self, channel)) for channel in CHANNELS])

    @property
    def is_noisy(self) -> bool:
        """Return whether anything is measured with noise."""
        return bool(np.any(self.deviations()))

    def scaled(self, factor: float) -> SensorNoise:
        """Return noise with every standard deviation multiplied by a factor."""
        return SensorNoise(*(factor * np.asarray(getattr(self, channel)) for channel in CHANNELS))

    @property
    def pairs(self) -> tuple[int, ...]:
        """Return the pairs of random numbers that a step draws."""
        channels = enumerate(self.deviations().reshape(-1, 3))
        return tuple(pair for index, deviation in channels for pair in sensor_pairs(index, deviation))

    def sample(self, draws: Draws) -> Any:
        """Graph: return the noise SX (12,) of a step."""
        channels = enumerate(self.deviations().reshape(-1, 3))
        return ca.vertcat(*(sensor_errors(index, deviation, draws) for index, deviation in channels))

    def samples(self, seed: int, steps: int, flight: int = 0) -> np.ndarray:
        """Return (12, steps) noise of a flight; sample k of a channel depends on seed, flight, channel and k alone."""
        return evaluated(lambda _, draws: self.sample(draws), self.pairs, seed, np.arange(steps), flight)


def density_preserving(deviation: float, sensor_rate: float, control_rate: float) -> float:
    """Return the standard deviation at the control rate with the power spectral density of a sensor at its own rate.

    White noise sampled at f with deviation s has the density s^2 / f; what a loop much slower than both rates feels is
    the density, so s^2 / f is kept: s_control = s sqrt(f_control / f_sensor).
    """
    deviation = number(deviation, "noise deviation", at_least=0)
    ratio = number(control_rate, "control rate [Hz]", above=0) / number(sensor_rate, "sensor rate [Hz]", above=0)
    return deviation * float(np.sqrt(ratio))


def measured(state: StateGraph, noise: Any) -> StateGraph:
    """Graph: return the state as the sensors tell it, from a noise sample SX (12,)."""
    return StateGraph(
        state.position + noise[0:3],
        state.velocity + noise[3:6],
        state.attitude @ so3.exp(noise[6:9]),
        state.angular_velocity + noise[9:12],
        state.thrust,
        state.thrust_rate,
    )
