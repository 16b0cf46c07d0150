"""A regular curve sigma(lambda) as a path, in any parameterisation; only its jet at the nearest parameter enters the law."""

from __future__ import annotations

import collections
import functools
from abc import abstractmethod
from collections.abc import Hashable
from typing import Any

import casadi as ca
import numpy as np

from gammastar.path import bishop
from gammastar.path.base import JET_ORDER, Path, PathOutputs
from gammastar.path.jet import Jet, outputs_from_jet, position_from_outputs
from gammastar.path.nearest import nearest
from gammastar.path.search import nearest_of_all
from gammastar.taylor import Series

NEWTON_STEPS = 2  # from a guess off by 1e-3 the error is 1e-6, then 1e-12 (quadratic)
GLOBAL_POINTS = 4096  # samples of the domain among which a nearest point is sought first
SMALLEST_SLOPE = 1e-3  # of the tracking equation, relative: inside the focal set Newton would run to the farthest point
MOST_KEPT = 64  # functions that sample paths; the one used longest ago goes first

_samplers: collections.OrderedDict[tuple[Hashable, int], Any] = collections.OrderedDict()


class ParametricPath(Path):
    """What every parametric curve shares: the law's outputs from its jet, the tracking of its parameter, its normal frames."""

    plane_normal: tuple[float, float, float] | None  # of a planar curve: its normal frame is then closed form

    components = 3

    def with_data(self) -> ParametricPath:
        """Return the same curve with its numbers as data where they can be."""
        return self

    @abstractmethod
    def jet(self, place: Any, order: int = JET_ORDER) -> Jet:
        """Graph: return (sigma, sigma', ..., sigma^(order)), SX (3,) each, at a place."""

    @abstractmethod
    def jets(self, parameters: np.ndarray, order: int = JET_ORDER) -> np.ndarray:
        """Return (n, order + 1, 3): point and derivatives with respect to the parameter, at parameters (n,)."""

    def outputs(self, position: Series, place: Any) -> PathOutputs:
        """Graph: return the outputs along a position series; see `gammastar.path.jet`."""
        return outputs_from_jet(self.jet(place), position, ca.SX(place)[0])

    def track(self, position: Any, place: Any, steps: int = NEWTON_STEPS) -> Any:
        """Graph: return the parameter of the nearest point by Newton steps on <chi - sigma, sigma'> = 0.

        No step is longer than twice the distance to the path, since the nearest point is not farther from the one before.
        """
        place = ca.SX(place)
        parameter, data = place[0], place[1:]
        for _ in range(steps):
            point, tangent, second = self.jet(ca.vertcat(parameter, data), 2)
            error = position - point
            speed_squared = ca.dot(tangent, tangent)
            slope = ca.fmax(speed_squared - ca.dot(error, second), SMALLEST_SLOPE * speed_squared)
            longest = 2 * ca.norm_2(error) / ca.sqrt(speed_squared)
            parameter = parameter + ca.fmin(ca.fmax(ca.dot(error, tangent) / slope, -longest), longest)
        return parameter

    def nearness(self, position: Any, velocity: Any, place: Any) -> tuple[Any, Any, Any]:
        """Graph: return the focal margin [1] at a place, and the rate [1/s] at which a velocity across the path may change it.

        Both as if the place were the nearest point; the third is what is left of the nearest-point equation, relative.
        """
        point, tangent, second = self.jet(place, 2)
        error, speed_squared = position - point, ca.dot(tangent, tangent)
        across = velocity - tangent * ca.dot(tangent, velocity) / speed_squared
        bend = second - tangent * ca.dot(tangent, second) / speed_squared
        rate = ca.norm_2(across) * ca.norm_2(bend) / speed_squared
        return 1 - ca.dot(error, second) / speed_squared, rate, ca.dot(error, tangent) / speed_squared

    def foot(self, position: Any, place: Any) -> Any:
        """Graph: return the point of the path at a place; it is the nearest one where the parameter has been tracked."""
        return self.jet(place, 1)[0]

    def position_series(self, transverse: Any, tangential: Any, guess: Any = None, data: Any = None) -> Series:
        """Graph: return the position series with these outputs; the transverse columns are vectors of the normal plane."""
        place = tangential[0] if data is None else ca.vertcat(tangential[0], data)
        return position_from_outputs(self.jet(place), transverse, tangential)

    def distance(self, position: Any, place: Any, ends: tuple[Any, Any]) -> Any:
        """Graph: return the distance [m] to the nearest point, continued from a place, between two parameters."""
        place = ca.SX(place)
        parameter = ca.fmin(ca.fmax(self.track(position, place), ends[0]), ends[1])
        return ca.norm_2(position - self.jet(ca.vertcat(parameter, place[1:]), 1)[0])

    def start_parameters(self, positions: np.ndarray) -> np.ndarray:
        """Return the parameters (n,) of the nearest points of all, searched by `gammastar.path.search`.

        Raises:
            PathError: More places are equally near than can be looked at.
        """

        def jets(parameters: np.ndarray) -> np.ndarray:
            return np.asarray(self.jets(parameters, 2)[:, :3])

        return nearest_of_all(self.name, jets, positions, self.domain, self.period is not None)[0]

    def points(self, parameters: np.ndarray) -> np.ndarray:
        """Return the points (n, 3) [m] at parameters (n,)."""
        return np.asarray(self.jets(parameters, 2)[:, 0])

    def tangents(self, parameters: np.ndarray) -> np.ndarray:
        """Return the unit tangents (n, 3) at parameters (n,)."""
        derivative = self.jets(parameters, 2)[:, 1]
        return np.asarray(derivative / np.linalg.norm(derivative, axis=1, keepdims=True))

    def normals(self, parameters: np.ndarray, reference: float) -> np.ndarray:
        """Return rotation-minimising normal frames (n, 3, 2), transported from the parameter `reference`."""
        tangents = self.tangents(parameters)
        if self.plane_normal is not None:
            second = np.broadcast_to(np.asarray(self.plane_normal), tangents.shape)
            return np.stack([np.cross(tangents, second), second], axis=-1)
        return bishop.transported_normals(self._tangent_and_rate, parameters, tangents, reference)

    def normal_components(self, parameters: np.ndarray, transverse: np.ndarray) -> np.ndarray:
        """Return the components (k, 2, 4) of normal vectors (k, 3, 4) in a rotation-minimising frame."""
        return np.asarray(np.einsum("kia,kij->kaj", self.normals(parameters, float(parameters[0])), transverse))

    def normal_vectors(self, parameters: np.ndarray, components: np.ndarray, reference: float) -> np.ndarray:
        """Return the normal vectors (k, 3, m) of components (k, 2, m)."""
        return np.asarray(np.einsum("kia,kaj->kij", self.normals(parameters, reference), components))

    def distances(self, positions: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Return the distances (n,) [m] to the nearest points, polished from parameters (n,); of a path that ends, between its ends."""
        feet = self._polished(positions, np.asarray(parameters, dtype=float), NEWTON_STEPS)
        if self.ends is not None:
            feet = np.clip(feet, *self.ends)
        return np.asarray(np.linalg.norm(positions - self.points(feet), axis=1))

    def global_distances(self, positions: np.ndarray) -> np.ndarray:
        """Return the distances (n,) [m] to the nearest points of the whole domain, wherever they are."""
        grid = np.linspace(*self.domain, GLOBAL_POINTS)
        return nearest(positions, grid, self.points(grid), lambda parameters: self.jets(parameters, 2))[1]

    def _sampled(self, parameters: np.ndarray, order: int) -> np.ndarray:
        """Return the graph `jet` evaluated, (n, order + 1, 3), at parameters (n,)."""
        sampler = self._fast_sampler if order <= 2 else self._full_sampler
        rows = sampler(np.vstack([parameters, self.data(parameters)]))
        return np.stack([row.full().T for row in rows[: order + 1]], axis=1)

    def _sampler(self, order: int) -> Any:
        """Return the function place -> derivatives up to an order: one for all paths of one graph."""
        key = self.graph_key, order
        if key not in _samplers:
            place = ca.SX.sym("place", 1 + self.data_size)
            rows = ca.cse([ca.densify(row) for row in self.jet(place, order)])
            _samplers[key] = ca.Function("jet", [place], rows)
            if len(_samplers) > MOST_KEPT:
                _samplers.popitem(last=False)
        _samplers.move_to_end(key)
        return _samplers[key]

    @functools.cached_property
    def _fast_sampler(self) -> Any:
        return self._sampler(2)

    @functools.cached_property
    def _full_sampler(self) -> Any:
        return self._sampler(JET_ORDER)

    def _polished(self, positions: np.ndarray, parameters: np.ndarray, steps: int) -> np.ndarray:
        """Return parameters (n,) after Newton steps towards the nearest points of positions (n, 3): `track` on numbers."""
        data = self.data(parameters)
        for _ in range(steps):
            parameters = np.array(
                self._tracker.map(len(parameters))(positions.T, np.vstack([parameters, data]))
            ).ravel()
            data = self.data(parameters)
        return parameters

    @functools.cached_property
    def _tracker(self) -> Any:
        position, place = ca.SX.sym("position", 3), ca.SX.sym("place", 1 + self.data_size)
        return ca.Function("track", [position, place], [self.track(position, place, 1)])

    def _tangent_and_rate(self, parameter: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the unit tangent (3,) and its derivative (3,) with respect to the parameter."""
        _, first, second = self.jets(np.array([parameter]), 2)[0]
        speed = np.linalg.norm(first)
        tangent = first / speed
        return tangent, (second - tangent * (tangent @ second)) / speed
