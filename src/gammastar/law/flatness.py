"""Attitude, thrust and torque of a motion under forces: the inverse of the vehicle's own acceleration, jerk and snap.

Drag depends on the attitude, which follows from the thrust vector, which balances the drag.  A Newton iteration over turns about the
first two body axes and the thrust solves it; its matrix is the one by which (p, q, zeta2) enter the jerk.  It starts at the attitude
without forces, where it finds none from there at the one that balances the forces at that attitude, and at last at hover, with the
speed growing; of several solutions, as a wing has them, it is the one so found.  Without forces all of it has a closed form.  The
heading is free, with r = r' = 0.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar import engine, so3
from gammastar.law.thrust_axis import is_bare, thrust_axis
from gammastar.vehicle import StateGraph, Vehicle
from gammastar.vehicle.body import cramer

HEADINGS = 8  # over a turn, for the torques of a motion
FEWER_HEADINGS = 4  # over a turn, where the forces depend on them
ITERATIONS = 10  # of Newton, which needs three to five
LONGEST_TURN = 0.5  # [rad] of one iteration
GROWTH = 5  # steps of the speed from hover
CONVERGED = 1e-7  # of the acceleration of gravity or of the motion
SYMMETRIC = 1e-9  # of the force: a difference that is rounding


class Flat(NamedTuple):
    """What a motion asks for, by heading; thrust is zero where no attitude gives the motion, and the rest is infinite."""

    thrust: np.ndarray  # (h, n) [N]
    axis: np.ndarray  # (h, n, 3) R e3, world
    tilt_rate: np.ndarray  # (h, n) [rad/s]
    tilt_acceleration: np.ndarray  # (h, n) [rad/s^2]
    torque: np.ndarray  # (h, n, 3) [N m], body


def flat(vehicle: Vehicle, derivatives: np.ndarray) -> Flat:
    """Return what a motion asks for, from its position and its first four derivatives (n, 5, 3)."""
    if is_bare(vehicle):
        found = [_closed(vehicle, derivatives)]
    else:
        solved = _turn(headings(vehicle))[: _functions(vehicle).different]
        found = [_solved(vehicle, derivatives, angle) for angle in solved]
    thrust, axis, rates, accelerations = (np.stack(values) for values in zip(*found, strict=True))
    turns = _about_third(_turn(headings(vehicle) // len(found)))  # from a heading to others of the same force
    with np.errstate(invalid="ignore"):
        rates, accelerations = (  # rows times R are R^T times columns
            np.concatenate(value[:, None] @ turns[None, :, :, :]) for value in (rates, accelerations)
        )
    thrust, axis = (np.repeat(value, len(turns), axis=0) for value in (thrust, axis))
    inertia = np.asarray(vehicle.inertia)
    with np.errstate(all="ignore"):
        torque = accelerations @ inertia + np.cross(rates, rates @ inertia) + np.asarray(vehicle.bias_torque)
        sizes = (np.linalg.norm(value, axis=2) for value in (rates, accelerations))
        return Flat(thrust, axis, *(np.where(np.isnan(value), np.inf, value) for value in (*sizes, torque)))


def hover(vehicle: Vehicle) -> np.ndarray:
    """Return g e3 - K_t (3,) [m/s^2], world, with forces at rest over the mass: what thrust has to balance there."""
    if is_bare(vehicle):
        return np.asarray((0.0, 0.0, vehicle.gravity) - np.asarray(vehicle.bias_acceleration))
    return np.asarray(_functions(vehicle).at_rest.call([])[0].full()[:, 0])


def _about_third(angles: np.ndarray) -> np.ndarray:
    """Return rotations (k, 3, 3) about the third axis by angles (k,) [rad]."""
    cosines, sines = np.cos(angles), np.sin(angles)
    turns = np.tile(np.eye(3), (len(angles), 1, 1))
    turns[:, 0, 0], turns[:, 0, 1], turns[:, 1, 0], turns[:, 1, 1] = cosines, -sines, sines, cosines
    return turns


def _turn(count: int) -> np.ndarray:
    """Return headings (count,) [rad] over a turn."""
    return np.asarray(2 * np.pi * np.arange(count) / count)


class _Functions(NamedTuple):
    at_rest: Any  # () -> what thrust has to balance at rest (3,) [m/s^2]
    newton: Any  # (R, zeta1, position, v, a) -> (R, zeta1, acceleration that is missing)
    rest: Any  # (R, zeta1, position, v, a, j, s) -> (p, q, 0), (p', q', 0)
    pushed: Any  # (R, zeta1, position, v) -> acceleration
    different: int  # headings that have forces of their own


def _functions(vehicle: Vehicle) -> _Functions:
    made: _Functions = engine.compiled(("flatness", vehicle.signature), functools.partial(_build, vehicle))
    return made


def _build(vehicle: Vehicle) -> _Functions:
    attitude, thrust, thrust_rate = ca.SX.sym("attitude", 3, 3), ca.SX.sym("thrust"), ca.SX.sym("thrust_rate")
    place, velocity, acceleration, jerk, snap = (ca.SX.sym(name, 3) for name in "xvajs")
    tilt = ca.SX.sym("tilt", 2)
    state = StateGraph(place, velocity, attitude, ca.vertcat(tilt, 0), thrust, thrust_rate)
    unknowns = ca.vertcat(tilt, thrust_rate)
    moved = vehicle.jerk(state)
    slope = ca.jacobian(moved, unknowns)
    calm = ca.substitute(moved, unknowns, ca.SX.zeros(3))
    missing = acceleration - vehicle.acceleration(state)
    step = ca.vertcat(*cramer(slope, missing))
    turn = step[:2] * ca.fmin(1, LONGEST_TURN / ca.fmax(ca.norm_2(step[:2]), 1e-12))
    newton = [ca.mtimes(attitude, so3.exp(ca.vertcat(turn, 0))), thrust + step[2], missing]
    rates = ca.vertcat(*cramer(slope, jerk - calm))
    moving = state._replace(angular_velocity=ca.vertcat(rates[:2], 0), thrust_rate=rates[2])
    control = vehicle.input_for(moving, snap, 0)
    turning = vehicle.angular_acceleration(moving.angular_velocity, control[1:])
    resting = ca.SX(
        vehicle.acceleration(StateGraph(ca.SX(3, 1), ca.SX(3, 1), ca.SX.eye(3), ca.SX(3, 1), ca.SX(0), ca.SX(0)))
    )
    pose = [attitude, thrust, place, velocity]
    pushed = ca.Function("pushed", pose, [vehicle.acceleration(state)])
    return _Functions(
        ca.Function("at_rest", [], [resting * vehicle.moved_mass / vehicle.mass]),
        ca.Function("newton", [*pose, acceleration], ca.cse(newton)),
        ca.Function("rest", [*pose, acceleration, jerk, snap], ca.cse([moving.angular_velocity, turning])),
        pushed,
        _different(pushed, vehicle.mass),
    )


def turns_with_heading(vehicle: Vehicle) -> bool:
    """Return whether forces depend on how the body is turned about its thrust axis."""
    return not is_bare(vehicle) and _functions(vehicle).different > 1


def headings(vehicle: Vehicle) -> int:
    """Return how many headings over a turn a motion is solved for."""
    return FEWER_HEADINGS if turns_with_heading(vehicle) else HEADINGS


def _different(force: Any, thrust: float) -> int:
    """Return of how many neighbouring headings forces differ: one, those of half a turn, or all of `FEWER_HEADINGS`.

    Drag is a square in the velocity or odd in it, so it is the same after half a turn about the thrust axis.
    """
    rng, turns = np.random.default_rng(0), _about_third(np.array([0.0, 1.0, np.pi]))
    most = 1
    for _ in range(3):
        attitude, place, velocity = so3.exp(rng.normal(size=3)), rng.normal(size=3), 3 * rng.normal(size=3)
        same, turned, half = (force(attitude @ turn, thrust, place, velocity).full() for turn in turns)
        near = SYMMETRIC * np.abs(same).max()
        if np.abs(half - same).max() > near:
            return FEWER_HEADINGS
        if np.abs(turned - same).max() > near:
            most = FEWER_HEADINGS // 2
    return most


def _closed(vehicle: Vehicle, derivatives: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return thrust (n,), its axis (n, 3), body rates (n, 3) and their rates (n, 3) of a motion without forces, with r = r' = 0.

    The body turns at b3 x b3' in world axes, which changes by b3 x b3''; both are across b3, so r and r' vanish.
    """
    thrust, third, turning, tilting = thrust_axis(vehicle, tuple(np.moveaxis(derivatives, 1, 0)))
    attitude, _ = _first(vehicle, third, 0.0)
    rates, accelerations = (np.einsum("nij,ni->nj", attitude, np.cross(third, each)) for each in (turning, tilting))
    return thrust, third, rates, accelerations


def _solved(vehicle: Vehicle, derivatives: np.ndarray, heading: float) -> tuple[np.ndarray, ...]:
    """Return thrust (n,), its axis (n, 3), body rates (n, 3) and their rates (n, 3) of a motion, with r = r' = 0, at one heading [rad]."""
    functions = _functions(vehicle)
    place, velocity, acceleration, jerk, snap = np.moveaxis(derivatives, 1, 0)
    balanced = hover(vehicle) * vehicle.mass / vehicle.moved_mass
    size = np.linalg.norm(balanced) + np.linalg.norm(acceleration, axis=1)
    motion = place, velocity, acceleration
    attitude, thrust = _first(vehicle, balanced - acceleration, heading)
    good = _iterate(functions, attitude, thrust, motion, size, np.arange(len(thrust)))

    def take(there: np.ndarray, force: np.ndarray, found: np.ndarray) -> None:
        attitude[found], thrust[found], good[found] = there[found], force[found], True

    if not good.all():
        left, (there, force) = np.flatnonzero(~good), _first(vehicle, balanced - acceleration, heading)
        columns = _columns(there), np.zeros((1, len(force))), place.T, velocity.T
        unbalanced = _mapped(functions.pushed, columns).full().T
        there, force = _first(vehicle, unbalanced - acceleration, heading)
        take(there, force, left[_iterate(functions, there, force, motion, size, left)[left]])
    if not good.all() and np.any(balanced):
        left, (there, force) = (
            np.flatnonzero(~good),
            _first(vehicle, np.broadcast_to(balanced, velocity.shape), heading),
        )
        for share in np.arange(1, GROWTH + 1) / GROWTH:
            slower = place, share * velocity, share**2 * acceleration
            left = left[_iterate(functions, there, force, slower, size, left)[left]]
        take(there, force, left)
    rates, accelerations = np.full((len(thrust), 3), np.inf), np.full((len(thrust), 3), np.inf)
    if good.any():
        columns = (
            _columns(attitude[good]),
            thrust[good][None],
            *(each[good].T for each in (place, velocity, acceleration, jerk, snap)),
        )
        rates[good], accelerations[good] = (value.full().T for value in _mapped(functions.rest, columns))
    return np.where(good, thrust, 0.0), attitude[:, :, 2], rates, accelerations


def _iterate(
    functions: _Functions,
    attitude: np.ndarray,
    thrust: np.ndarray,
    motion: tuple[np.ndarray, np.ndarray, np.ndarray],
    size: np.ndarray,
    chosen: np.ndarray,
) -> np.ndarray:
    """Move attitudes (n, 3, 3) and thrusts (n,) of chosen samples by Newton steps; return (n,) which then give the acceleration.

    The thrust has to be positive for that.  Samples that are settled are left alone.
    """
    good, left = np.zeros(len(thrust), dtype=bool), chosen
    for _ in range(ITERATIONS):
        if not left.size:
            break
        columns = _columns(attitude[left]), thrust[left][None], *(each[left].T for each in motion)
        turned, pushed, missing = (value.full() for value in _mapped(functions.newton, columns))
        attitude[left], thrust[left] = turned.T.reshape(-1, 3, 3).swapaxes(1, 2), pushed[0]
        amount = np.linalg.norm(missing, axis=0)
        settled = amount <= CONVERGED * size[left]  # before this step, which squares what is left
        good[left[settled]] = thrust[left[settled]] > 0
        left = left[~settled & np.isfinite(amount)]
    return good


def _mapped(function: Any, columns: tuple[np.ndarray, ...]) -> Any:
    return function.map(columns[1].shape[1])(*columns)


def _columns(attitude: np.ndarray) -> np.ndarray:
    """Return attitudes (n, 3, 3) beside each other (3, 3 n), as a mapped function takes them."""
    return np.hstack(list(attitude))


def _first(vehicle: Vehicle, force: np.ndarray, heading: float) -> tuple[np.ndarray, np.ndarray]:
    """Return attitudes (n, 3, 3) with the thrust axis along forces over mass (n, 3), and the thrusts (n,)."""
    size = np.linalg.norm(force, axis=1)
    third = np.where(size[:, None] > 0, force / np.where(size > 0, size, 1.0)[:, None], [0.0, 0.0, 1.0])
    aside = np.where(np.abs(third[:, :1]) < 0.8, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    second = np.cross(third, aside)
    second /= np.linalg.norm(second, axis=1)[:, None]
    first = np.cross(second, third)
    attitude = np.stack([first, second, third], axis=2) @ _about_third(np.array([heading]))
    return attitude, size * vehicle.moved_mass
