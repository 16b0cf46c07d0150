"""Objectives G1-G4 of section III, on flights of the package, against the closed form of `nominal` where there is one."""

from __future__ import annotations

import functools

import numpy as np

from gammastar import so3
from gammastar.claims import witness
from gammastar.claims.claim import Claim, Finding, Method, Verdict, require
from gammastar.claims.coordinates import circular_motion
from gammastar.claims.nominal import (
    GRAVITY,
    MASS,
    PRINTED_INVERTED,
    PRINTED_UPRIGHT,
    START,
    TRANSVERSE_INERTIA,
    fly_nominal,
)
from gammastar.claims.symbols import extended_system
from gammastar.flight import FlightRecord, fly
from gammastar.law import Law, Point, design
from gammastar.vehicle import State, Vehicle

POLE = 2.5  # [1/s], the design's choice for the paper's scenarios
STEP = 2e-3  # [s]; the fourth-order integrator then errs by less than 1e-7 m on these flights
DURATION = 12.0  # [s]; a chain with four poles at -2.5 has forgotten all but 1e-9 of its start
FLIGHT_ERROR = 1e-6  # [m] or [N], of the integrator at this step
SETTLED = 1e-6  # what is left of errors of a few metres at the end, by the poles


def paper_law() -> Law:
    """Return the law of section VI: its vehicle, its circle in its own coordinates, all poles at -2.5."""
    vehicle = Vehicle(mass=MASS, inertia=(TRANSVERSE_INERTIA, TRANSVERSE_INERTIA, 0.0344), gravity=GRAVITY)
    return design(vehicle, witness.paper_circle(), poles=-POLE)


@functools.cache
def recovery(inverted: bool, heading: float = 0.0) -> FlightRecord:
    """Return the flight of section VI-A or VI-B; `heading` [deg] turns the start about its own thrust axis."""
    attitude, _ = so3.project(PRINTED_INVERTED if inverted else PRINTED_UPRIGHT)
    start = State(position=START, attitude=attitude @ so3.yaw(heading))
    return _completed(fly(paper_law(), start, speed=1.0, duration=DURATION, step=STEP))


def _completed(record: FlightRecord) -> FlightRecord:
    require(record.completed, f"a flight ended at {record.status_time:.3g} s: {record.status.value}")
    return record


def check_convergence() -> Finding:
    """G1: both starts of section VI reach the path, along the trajectory that the closed form predicts."""
    left, worst, torque = 0.0, 0.0, 0.0
    for inverted, printed in ((False, PRINTED_UPRIGHT), (True, PRINTED_INVERTED)):
        record = recovery(inverted)
        exact = fly_nominal(POLE, so3.project(printed)[0], record.time)
        worst = max(worst, float(np.abs(record.position - exact.position).max()))
        torque = max(torque, float(np.abs(np.linalg.norm(record.torque, axis=1) - exact.torque).max()))
        left = max(left, _distance(record.position[-1]))
        require(_distance(record.position[0]) > 10, "the start is on the path already")
    require(left < SETTLED, f"{left:.2g} m are left at the end")
    require(worst < FLIGHT_ERROR, f"a flight leaves its closed form by {worst:.2g} m")
    require(torque < FLIGHT_ERROR, f"the torque leaves its closed form by {torque:.2g} N m")
    return Finding(
        Verdict.HOLDS,
        Method.NUMERIC,
        f"upright and inverted start, {DURATION:g} s: the distance falls from {_distance(np.array(START)):.1f} m to {left:.1e} m, "
        f"and the flight stays within {worst:.1e} m of an independent closed form, its torque within {torque:.1e} N m",
        residual=worst,
    )


def _distance(position: np.ndarray) -> float:
    """Return the distance [m] of a position (3,) to the paper's circle, by Pythagoras."""
    return float(np.hypot(np.hypot(position[0], position[1]) - 1, position[2] - 10))


@functools.cache
def on_path_flight() -> FlightRecord:
    """Return a flight that starts on Gamma*, on the circle at 2 rad/s, and slows down to 1 rad/s along it."""
    values = circular_motion()
    start = State.from_vector(witness.state_vector(values))
    return _completed(fly(witness.law_of(values, -POLE), start, speed=1.0, duration=8.0, step=STEP))


def check_invariance() -> Finding:
    """G2: started on Gamma* the vehicle never leaves the path; started on Gamma alone, moving across, it must."""
    record = on_path_flight()
    worst = max(_distance(position) for position in record.position)
    speeds = record.tangential_state[[0, -1], 1]
    require(abs(speeds[0] - 2) < 1e-9 and abs(speeds[1] - 1) < 1e-4, f"the speed along the path went from {speeds}")
    require(worst < 1e-9, f"a flight started on the path leaves it by {worst:.2g} m")
    values = circular_motion()
    values |= dict(zip(extended_system().velocity, (1, 2, 0), strict=True))
    across = fly(
        witness.law_of(values, -POLE),
        State.from_vector(witness.state_vector(values)),
        speed=1.0,
        duration=1.0,
        step=STEP,
    )
    left = max(_distance(position) for position in _completed(across).position)
    require(left > 1e-2, f"a start across the path leaves it by {left:.2g} m only")
    return Finding(
        Verdict.HOLDS,
        Method.NUMERIC,
        f"started on Gamma* and slowed from 2 to 1 rad/s, the vehicle stays within {worst:.1e} m of the path at all times; from Gamma "
        f"alone, with 1 m/s across, it leaves by {left:.2g} m before it returns",
        residual=worst,
    )


def check_progress() -> Finding:
    """G3: the speed along the path reaches its profile, and a point of the path is stabilised."""
    record = recovery(True)
    speed_error = float(np.abs(record.tangential_state[-1] - [record.tangential_state[-1, 0], 1, 0, 0]).max())
    along = np.unwrap(np.arctan2(record.position[:, 1], record.position[:, 0]))
    measured = float((along[-1] - along[-501]) / (record.time[-1] - record.time[-501]))
    require(
        speed_error < SETTLED and abs(measured - 1) < SETTLED, f"the speed along the path ends at {measured:.8f} rad/s"
    )
    values = circular_motion()
    start = State.from_vector(witness.state_vector(values))
    held = _completed(fly(witness.law_of(values, -POLE), start, reference=Point(2.0), duration=DURATION, step=STEP))
    target = np.array([np.cos(2.0), np.sin(2.0), 10.0])
    miss = float(np.linalg.norm(held.position[-1] - target))
    at_rest = float(np.linalg.norm(held.velocity[-1]))
    away = max(_distance(position) for position in held.position)
    require(miss < SETTLED and at_rest < SETTLED, f"the point is missed by {miss:.2g} m at {at_rest:.2g} m/s")
    require(away < 1e-9, f"on its way to the point the vehicle leaves the path by {away:.2g} m")
    return Finding(
        Verdict.HOLDS,
        Method.NUMERIC,
        f"after the inverted start the angle advances at 1 rad/s within {abs(measured - 1):.0e}; the point at 2 rad is reached to "
        f"{miss:.0e} m and held without leaving the path",
        residual=max(speed_error, miss),
    )


def check_internal_states() -> Finding:
    """G4: zeta1 = |F| of the closed form, |r_ij| <= 1, and starts that differ in heading share all of (xi, eta) and zeta1."""
    record, turned = recovery(True), recovery(True, 120.0)
    exact = fly_nominal(POLE, so3.project(PRINTED_INVERTED)[0], record.time)
    thrust_error = float(np.abs(record.internal_state[:, 6] - exact.thrust).max())
    require(thrust_error < FLIGHT_ERROR, f"zeta1 is not |F|: they differ by {thrust_error:.2g} N")
    shared = max(
        _difference(record, turned, name) for name in ("transverse_state", "tangential_state", "thrust", "position")
    )
    require(shared < FLIGHT_ERROR, f"the heading is seen by the chains: {shared:.2g}")
    apart = float(np.abs(record.internal_state - turned.internal_state)[:, :6].max())
    require(apart > 0.5, f"the headings differ by {apart:.2g} only")
    largest = float(max(np.abs(each.internal_state[:, :6]).max() for each in (record, turned)))
    require(largest < 1 + 1e-12, f"an entry of R reaches {largest:.15f}")
    spread = np.abs(so3.stack(record.attitude[-1])[6:] - so3.stack(turned.attitude[-1])[6:]).max()
    require(float(spread) < FLIGHT_ERROR, "the thrust axes differ at the end")
    lowest, highest = float(record.thrust.min() / (MASS * GRAVITY)), float(record.thrust.max() / (MASS * GRAVITY))
    return Finding(
        Verdict.HOLDS,
        Method.NUMERIC,
        f"inverted start: zeta1 stays between {lowest:.2f} and {highest:.2f} m g and is |F| of the closed form to {thrust_error:.0e} N; "
        f"a start turned by 120 deg about its thrust axis has the same (xi, eta, zeta1) to {shared:.0e} and another heading for ever; "
        "|r_ij| <= 1",
        residual=max(thrust_error, shared),
    )


def _difference(first: FlightRecord, second: FlightRecord, name: str) -> float:
    """Return the largest difference of one array of two records."""
    ours, theirs = np.asarray(getattr(first, name)), np.asarray(getattr(second, name))
    return float(np.abs(ours - theirs).max() / max(1.0, np.abs(ours).max()))


CLAIMS = (
    Claim("G1", "III", "|h(x(t))|_gamma -> 0 as t -> infinity", check_convergence),
    Claim("G2", "III", "the zero set of s is output invariant for all t >= 0", check_invariance),
    Claim("G3", "III", "the speed profile is met, or a point of the path is stabilised", check_progress),
    Claim("G4", "III, V", "internal dynamics are stable and internal states bounded", check_internal_states),
)
