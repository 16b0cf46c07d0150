"""Remarks of section VI that can be checked: the printed attitudes, the effort of the inverted start, the vehicle, the singularities."""

from __future__ import annotations

import functools
import math
from fractions import Fraction
from typing import Any

import numpy as np

from gammastar import so3
from gammastar.claims.claim import Claim, Finding, Method, Verdict, misprint, require
from gammastar.claims.nominal import (
    GRAVITY,
    MASS,
    PRINTED_INVERTED,
    PRINTED_UPRIGHT,
    TRANSVERSE_INERTIA,
    NominalFlight,
    fly_nominal,
)
from gammastar.flight import Status, fly
from gammastar.law import Point, design
from gammastar.path import catalogue
from gammastar.vehicle import State, Vehicle

ROUNDING = 1e-14  # of a projection by singular values: a few units in the last place
DESIGN_POLE = 2.5  # [1/s], the design's choice for the paper's scenarios
TIMES = np.linspace(0.0, 8.0, 8001)  # [s]; peaks fall within the first two seconds
REAL_VEHICLES = {  # mass [kg], moment of inertia about a transverse axis [kg m^2]
    "Crazyflie": (0.030, 1.43e-5),  # RotorPy, crazyflie_params
    "Hummingbird": (0.500, 3.65e-3),  # RotorPy, hummingbird_params
    "racing drone": (0.75, 2.5e-3),  # Sun et al., T-RO 2022, Table II
    "Pelican": (1.923, 0.01152),  # safe_multiquad_pf
    "Lee's": (4.34, 0.0820),  # Lee, Leok, McClamroch, CDC 2010
}


def orthogonality_error(matrix: Any) -> Fraction:
    """Return the largest entry of |R^T R - I| in rational arithmetic, the printed decimals taken at face value."""
    rows = [[Fraction(str(float(entry))) for entry in row] for row in matrix]
    products = {(i, j): sum((row[i] * row[j] for row in rows), Fraction(0)) for i in range(3) for j in range(3)}
    return max(abs(product - (i == j)) for (i, j), product in products.items())


def check_printed_attitude(printed: Any) -> Finding:
    """Section VI, R(0): R^T R = I in rational arithmetic; the nearest rotation, and the distance to it."""
    rotation, distance = so3.project(printed)
    singular_values = np.linalg.svd(np.array(printed), compute_uv=False)
    require(
        abs(distance - np.linalg.norm(singular_values - 1)) < ROUNDING,
        "the distance is not that of the singular values",
    )
    require(
        np.abs(rotation - np.array(printed)).max() <= 0.5e-4,
        "the nearest rotation does not round to the printed digits",
    )
    return misprint(
        orthogonality_error,
        printed=printed,
        corrected=rotation,
        method=Method.NUMERIC,
        tolerance=ROUNDING,
        evidence=f"R^T R differs from I by {{printed}} in rational arithmetic; the nearest rotation is {distance:.3g} away (Frobenius) "
        "and rounds to the printed digits",
        correction="project onto SO(3) and state the distance",
    )


@functools.cache
def nominal_flight(pole: float, inverted: bool) -> NominalFlight:
    """Return the closed-form flight of section VI from one of its two starts, all poles at -pole."""
    attitude, _ = so3.project(PRINTED_INVERTED if inverted else PRINTED_UPRIGHT)
    return fly_nominal(pole, attitude, TIMES)


def extra_effort(pole: float) -> float:
    """Return by how much the peak torque of the inverted start exceeds that of the upright one [N m]."""
    return float(nominal_flight(pole, True).torque.max() - nominal_flight(pole, False).torque.max())


def check_effort() -> Finding:
    """Section VI-B: peak torques of both starts in closed form, as a function of the poles."""
    from scipy.optimize import brentq

    crossing = brentq(extra_effort, 2.0, 4.0, xtol=1e-6)
    require(
        all(extra_effort(pole) > 0 for pole in (1.5, 2.0, DESIGN_POLE)),
        "the inverted start needs less at slow poles too",
    )
    require(all(extra_effort(pole) < 0 for pole in (3.0, 4.0)), "the inverted start needs more at fast poles too")
    require(2.5 < crossing < 3.0, f"the two efforts cross at {crossing:.2f}")
    peaks = {
        pole: [nominal_flight(pole, inverted).torque.max() for inverted in (False, True)] for pole in (DESIGN_POLE, 3.0)
    }
    return Finding(
        Verdict.FALSE,
        Method.NUMERIC,
        f"closed form: peak torque upright and inverted {peaks[2.5][0]:.2f} and {peaks[2.5][1]:.2f} N m with poles -2.5, but "
        f"{peaks[3.0][0]:.2f} and {peaks[3.0][1]:.2f} N m with poles -3; the two cross at -{crossing:.2f}",
        f"holds for poles slower than -{crossing:.1f} per second only; with faster ones the upright start needs more torque",
    )


def check_plausibility() -> Finding:
    """Section VI: radius of gyration sqrt(J/m), and the rotor arm that the peak torque would need, max |tau|/T."""
    radius = math.sqrt(TRANSVERSE_INERTIA / MASS)
    others = {name: math.sqrt(inertia / mass) for name, (mass, inertia) in REAL_VEHICLES.items()}
    widest = max(others, key=lambda name: others[name])
    require(
        radius > 3 * others[widest],
        f"{widest} has a radius of gyration of {others[widest]:.3g} m, as large as the paper's",
    )
    flight = nominal_flight(DESIGN_POLE, True)
    arm = float(np.max(flight.torque / flight.thrust))
    require(arm > radius, "rotors within the radius of gyration could give the torque")
    return Finding(
        Verdict.FALSE,
        Method.NUMERIC,
        f"its 0.1 kg have a radius of gyration of {radius:.2f} m, against {others['Crazyflie']:.3f} to {others[widest]:.3f} m of five real "
        f"quadrotors; the inverted start with poles -2.5 needs |tau|/T up to {arm:.1f} m, a lower bound of the rotors' arm",
        "the torques follow from an implausible vehicle; they say nothing about a typical quadrotor",
    )


def check_singularities() -> Finding:
    """Section VI-A: a start above the circle, at rest and upright, far from the axis, whose flight reaches zero thrust.

    There alpha2 = -h e^{-s} (1 + s + s^2/2 + s^3/6) with s = p t, so the downward acceleration h p^2 (s^2/2 - s^3/6) e^{-s} has its
    maximum at s = 3 - sqrt(3); it exceeds g when h is large enough, and then zeta1 = m (g - acceleration) passes zero.
    """

    def needed(s: float) -> float:
        return DESIGN_POLE**2 * (s**2 / 2 - s**3 / 6) * math.exp(-s)

    limit = GRAVITY / needed(3 - math.sqrt(3))
    vehicle = Vehicle(mass=MASS, inertia=(TRANSVERSE_INERTIA, TRANSVERSE_INERTIA, 0.0344), gravity=GRAVITY)
    law = design(vehicle, catalogue.circle(radius=1.0, center=(0, 0, 10)), poles=-DESIGN_POLE)
    ends = {}
    for factor in (0.95, 1.05):
        start = State(position=(1.0, 0.0, 10.0 - factor * limit))
        record = fly(law, start, reference=Point(0.0), duration=2.0, step=2e-3)
        ends[factor] = record
        require(record.focal_margin.min() > 0.9, "the start is near the axis of the circle")
    require(ends[0.95].completed, f"5 % below the limit the flight ends: {ends[0.95].status.value}")
    require(
        ends[1.05].status is Status.FREE_FALL,
        f"5 % above the limit the flight ends otherwise: {ends[1.05].status.value}",
    )
    lowest = float(ends[0.95].thrust.min())
    predicted = MASS * (GRAVITY - 0.95 * GRAVITY)
    require(
        abs(lowest - predicted) < 1e-4 * MASS * GRAVITY, f"lowest thrust {lowest:.6f} N, predicted {predicted:.6f} N"
    )
    return Finding(
        Verdict.FALSE,
        Method.NUMERIC,
        f"at rest, upright, one metre from the axis and more than {limit:.2f} m above the circle, poles -2.5: the thrust must pass zero; "
        f"flown, 5 % less ends well (lowest thrust as predicted to {abs(lowest - predicted):.0e} N), 5 % more ends in free fall after "
        f"{ends[1.05].status_time:.2f} s",
        "two singularities: the axis of the circle (focal points) and free fall, zeta1 = 0; Q with zeta1 > 0 is not invariant",
    )


CLAIMS = (
    Claim(
        "R(0) upright",
        "VI-A",
        "R(0) = [.9980 -.0517 .0358; .0523 .9985 -.0156; -.0349 .0174 .9992] is the initial attitude",
        functools.partial(check_printed_attitude, PRINTED_UPRIGHT),
    ),
    Claim(
        "R(0) inverted",
        "VI-B",
        "R(0) = [1 0 0; 0 -.9998 -.0175; 0 .0175 -.9998] is the initial attitude",
        functools.partial(check_printed_attitude, PRINTED_INVERTED),
    ),
    Claim(
        "singularity",
        "VI-A",
        "the controller is defined everywhere except at the centre of the circle",
        check_singularities,
    ),
    Claim("effort", "VI-B", "the inverted start needs more control effort, due to the flip", check_effort),
    Claim(
        "vehicle", "VI-A, VI-B", "the efforts are within the range of commonly available quadrotors", check_plausibility
    ),
)
