"""The rows of a certificate that depend on the speed: what following a path demands, and whether the vehicle has it."""

from __future__ import annotations

import numpy as np

from gammastar.certificate import wording
from gammastar.certificate.certificate import Check, Verdict
from gammastar.certificate.findings import Findings
from gammastar.certificate.motion import Demands, Progress, demands, torque_is_exact, unit_derivatives
from gammastar.certificate.search import Quantity, extremes, negative_stretches
from gammastar.certificate.speeds import Limits, allowed_speeds
from gammastar.law.flatness import headings, hover
from gammastar.law.thrust_axis import is_bare
from gammastar.path.sampling import Place, Samples
from gammastar.vehicle import Vehicle

FEWER = 8  # local extremes that are narrowed where every value is the root of equations
ROUNDING = 1e-9  # relative: a value this close to its limit meets it
DEMANDS = (  # name, unit, field of Demands, sign of the extreme, field of Limits
    ("specific thrust", "m/s^2", "specific_thrust", -1, "specific_thrust"),
    ("least thrust", "N", "least_thrust", -1, None),
    ("most thrust", "N", "thrust", +1, "thrust"),
    ("tilt rate", "rad/s", "tilt_rate", +1, "tilt_rate"),
    ("tilt acceleration", "rad/s^2", "tilt_acceleration", +1, None),
    ("torque", "N m", "torque", +1, "torque"),
)
ROTORS = ("rotor share", "of the range", "rotor_share", +1, "rotors")  # one more where there are rotors


def rows_of(vehicle: Vehicle) -> tuple[tuple[str, str, str, int, str | None], ...]:
    """Return the rows of demands that a certificate of a vehicle has."""
    return DEMANDS if vehicle.rotors is None else (*DEMANDS, ROTORS)


def check_speed(
    vehicle: Vehicle,
    samples: Samples,
    speed: float,
    progress: Progress,
    limits: Limits,
    metres: tuple[float, float],
    findings: Findings,
) -> tuple[Samples, np.ndarray]:
    """Check what a speed demands; return samples that hold every extreme, and the tightest margin (n,) at them."""
    at_samples = demands(vehicle, unit_derivatives(samples.jets, progress), speed)
    all_jets = samples.jets

    def quantity(name: str) -> Quantity:
        def value(jets: np.ndarray) -> np.ndarray:
            known = jets is all_jets
            found = at_samples if known else demands(vehicle, unit_derivatives(jets, progress), speed)
            return np.asarray(getattr(found, name))

        return value

    floor, rows = limits.floor(vehicle), rows_of(vehicle)
    found = extremes(samples, {row[0]: (quantity(row[2]), row[3]) for row in rows}, None if is_bare(vehicle) else FEWER)
    samples = samples.with_parameters(np.array([each.parameter for each in found.values()]))
    places = dict(zip(found, findings.places(samples, [each.parameter for each in found.values()]), strict=True))
    allowed = findings.allowed = allowed_speeds(samples, vehicle, progress, limits)
    weightless = float(np.linalg.norm(hover(vehicle))) <= floor
    remedy = wording.advice(allowed, speed, progress, metres, weightless)
    for name, unit, _, sign, limited_by in rows:
        value, place = found[name].value, places[name]
        limit = _limit(limited_by, floor, limits)
        fails = limit is not None and sign * value > sign * limit * (1 + sign * ROUNDING)
        verdict = Verdict.STATED if limit is None else Verdict.FAILS if fails else Verdict.OK
        findings.checks.append(Check(name, value, unit, verdict, place, limit=limit, note=_note(name, vehicle)))
        if not fails or limit is None:
            continue
        if limited_by == "specific_thrust":
            findings.stretches += _stretches(samples, quantity("specific_thrust"), limit, -1, findings)
            findings.reasons.append(wording.falling(value, limit, place, findings.stretches, remedy))
        elif limited_by == "rotors":
            findings.saturated += _stretches(samples, quantity("rotor_share"), limit, +1, findings)
            findings.reasons.append(wording.saturated(value, place, findings.saturated, remedy))
        else:
            what = str(limited_by).replace("_", " ")
            findings.reasons.append(wording.exceeding(what, unit, value, limit, place, remedy))
    if vehicle.rotors is not None:
        findings.checks += _abilities(vehicle)
    largest = allowed[0][1] if allowed else None
    findings.checks.append(
        Check("largest speed", largest, progress.unit, Verdict.STATED, note=wording.intervals(allowed))
    )
    return samples, _margins(demands(vehicle, unit_derivatives(samples.jets, progress), speed), floor, limits)


def _limit(limited_by: str | None, floor: float, limits: Limits) -> float | None:
    """Return what a demand has to keep to."""
    if limited_by == "specific_thrust":
        return floor
    if limited_by == "rotors":
        return 1.0
    return None if limited_by is None else getattr(limits, limited_by)


def _note(name: str, vehicle: Vehicle) -> str:
    """Return a word about how a demand was found."""
    if name == "torque" and is_bare(vehicle):
        return "" if torque_is_exact(vehicle) else "bound over all headings"
    if name == "rotor share" or (name == "torque" and not is_bare(vehicle)):
        return f"largest of {headings(vehicle)} headings"
    return ""


def _abilities(vehicle: Vehicle) -> list[Check]:
    """Return what the rotors can do, whatever the path."""
    assert vehicle.rotors is not None
    least, most = vehicle.rotors.thrust_range
    rows = [
        Check("rotors' least thrust", least, "N", Verdict.STATED, note="without torque"),
        Check("rotors' most thrust", most, "N", Verdict.STATED, note="without torque"),
    ]
    if vehicle.weight > 0:
        throttle = vehicle.rotors.hover(vehicle.weight).throttle
        rows.append(Check("hover throttle", throttle, "of the fastest speed", Verdict.STATED))
    return rows


def _stretches(
    samples: Samples, quantity: Quantity, limit: float, sign: int, findings: Findings
) -> list[tuple[Place, Place]]:
    """Return the stretches where a quantity is below (sign -1) or above (+1) its limit."""
    found = []
    for first, last in negative_stretches(samples, lambda jets: sign * (limit - quantity(jets))):
        start, end = findings.places(samples, [first, last])
        if last - first >= samples.span * (1 - ROUNDING):  # the whole path: the end is not the start again
            end = Place(samples.low + samples.span, samples.length, end.point)
        found.append((start, end))
    return found


def _margins(found: Demands, floor: float, limits: Limits) -> np.ndarray:
    """Return 1 minus the largest used share of any limit (n,), between -1 and 1."""
    shares = [floor / np.maximum(found.specific_thrust, floor / 4), found.rotor_share]
    for name in ("thrust", "tilt_rate", "torque"):
        if (limit := getattr(limits, name)) is not None:
            shares.append(getattr(found, name) / limit)
    return np.asarray(np.clip(1 - np.max(shares, axis=0), -1.0, 1.0))
