"""From a vehicle, a path and a speed to the certificate: the geometry first, then what following it demands."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from gammastar.certificate import wording
from gammastar.certificate.certificate import Certificate, Check, Verdict
from gammastar.certificate.embedding import Approach, closest_approach
from gammastar.certificate.motion import (
    Demands,
    Progress,
    curvature,
    demands,
    hover,
    parameter_speed,
    torque_is_exact,
    unit_derivatives,
)
from gammastar.certificate.scan import Interval
from gammastar.certificate.search import Extreme, Quantity, extremes, negative_stretches
from gammastar.certificate.speeds import Limits, allowed_speeds
from gammastar.checks import instance, number
from gammastar.errors import UnknownNameError
from gammastar.frames import check_frame, convert_vector
from gammastar.path import Path
from gammastar.path.sampling import Place, Samples, sample
from gammastar.path.smoothness import ORDERS, jumping, jumps
from gammastar.vehicle import Vehicle

STANDSTILL = 1e-6  # of the mean |sigma'|: a smaller one counts as zero
ROUNDING = 1e-9  # relative: a value this close to its limit meets it
GEOMETRY = ("self-distance", "curvature", "tube radius")
DEMANDS = (  # name, unit, field of Demands, sign of the extreme, field of Limits
    ("specific thrust", "m/s^2", "specific_thrust", -1, "specific_thrust"),
    ("least thrust", "N", "thrust", -1, None),
    ("most thrust", "N", "thrust", +1, "thrust"),
    ("tilt rate", "rad/s", "tilt_rate", +1, "tilt_rate"),
    ("tilt acceleration", "rad/s^2", "tilt_acceleration", +1, None),
    ("torque", "N m", "torque", +1, "torque"),
)


@dataclass
class _Findings:
    """Rows and sentences as they come up."""

    frame: str  # of the points that are named
    checks: list[Check] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    stretches: list[tuple[Place, Place]] = field(default_factory=list)
    allowed: tuple[Interval, ...] = ()

    def skip(self, *names: str) -> None:
        self.checks += [Check(name, None, "", Verdict.SKIPPED) for name in names]

    def places(self, samples: Samples, parameters: ArrayLike) -> list[Place]:
        """Return the places at parameters (k,), their points in the frame of the certificate."""
        found = samples.places(np.asarray(parameters, dtype=float))
        points = (convert_vector(place.point, self.frame) + 0.0 for place in found)
        return [
            replace(place, point=(x, y, z))
            for place, (x, y, z) in zip(found, map(np.ndarray.tolist, points), strict=True)
        ]


def certify(
    vehicle: Vehicle,
    path: Path,
    speed: float = 1.0,
    *,
    progress: Progress | str = Progress.PARAMETER,
    limits: Limits | None = None,
    frame: str = "ned",
) -> Certificate:
    """Return whether a path is fit to be followed exactly, how fast, and what that demands (Assumption 1).

    Regular, of class C^5, apart from itself; then, at a constant speed: specific thrust, thrust, tilt rates and torque, each
    with the place of its extreme, and every constant speed that would do.  Extremes are located on samples that resolve
    the path's derivatives and narrowed to rounding.  What is much narrower than the spacing of the first samples, a
    four-thousandth of the domain, and changes none of them is not seen: a bump 2 cm wide on 10 km, say.

    Args:
        vehicle: As the law believes it to be.
        path: Curve or implicit path, over its `domain`.  A path may declare `knots`, parameters where its pieces join.
        speed: Constant speed of progress, backwards when negative; the demands are those of its magnitude.
        progress: 'parameter' for a speed in units of the path's parameter a second, 'metres' for metres a second.
        limits: Of the vehicle; by default only the floor of the specific thrust counts.
        frame: 'ned' or 'enu', in which rows and sentences name points; vehicle and path are in `ned` all the same.

    Raises:
        InputError: No vehicle, no path or no limits where one belongs, or a speed that is no number.
        UnknownNameError: Another unit of progress, or another frame.
        PathError: The path has no finite jets.
    """
    check_frame(frame)
    instance(vehicle, Vehicle, "vehicle", "make one with Vehicle(...)")
    instance(path, Path, "path", "make one with gs.paths, gs.waypoints or gs.Curve")
    speed, limits = number(speed, "speed"), Limits() if limits is None else limits
    instance(limits, Limits, "limits", "make them with Limits(...)")
    if progress not in list(Progress):
        raise UnknownNameError("progress", progress, [str(each) for each in Progress])
    progress, samples, findings = Progress(progress), sample(path), _Findings(frame)
    with np.errstate(all="ignore"):
        sound = _class_of(samples, findings)
        metres = (1.0, 1.0)
        margin = np.zeros(len(samples.parameters))
        if sound:
            slowest, fastest = _geometry(samples, findings)
            metres = metres if progress is Progress.METRES else (slowest.value, fastest.value)
            samples, margin = _flight(vehicle, samples, abs(speed), progress, limits, metres, findings)
        else:
            findings.skip(*GEOMETRY, *(row[0] for row in DEMANDS), "largest speed")
    return Certificate(
        path.name,
        frame,
        not findings.reasons,
        tuple(findings.reasons),
        tuple(findings.checks),
        progress,
        speed,
        findings.allowed,
        metres,
        samples.length,
        tuple(findings.stretches),
        samples.parameters,
        samples.arc_lengths,
        samples.jets[:, 0],
        margin,
    )


def _class_of(samples: Samples, findings: _Findings) -> bool:
    """Check that the path is regular and of class C^5, state its length; return whether the rest has a meaning."""
    least = extremes(samples, {"speed": (parameter_speed, -1)})["speed"]
    mean = samples.length / samples.span
    (place,) = findings.places(samples, [least.parameter])
    regular = least.value > STANDSTILL * mean
    verdict = Verdict.OK if regular else Verdict.FAILS
    ratio = least.value / mean if mean > 0 else 0.0
    findings.checks.append(Check("regular", ratio, "of the mean", verdict, place, limit=STANDSTILL))
    if not regular:
        findings.reasons.append(wording.irregular(place))
    found = jumps(samples)
    places = findings.places(samples, [jump.parameter for jump in found])
    if found:
        findings.reasons.append(jumping("the path", found, places))
    lowest = min(found, key=lambda jump: jump.order, default=None)
    findings.checks.append(
        Check(
            "smooth",
            None,
            "",
            Verdict.FAILS if found else Verdict.OK,
            places[found.index(lowest)] if lowest else None,
            note=f"{ORDERS[lowest.order]} is not continuous" if lowest else wording.resolution(samples.unresolved),
        )
    )
    note = f"error about {samples.length_error:.1g} m"
    findings.checks.append(Check("length", samples.length, "m", Verdict.STATED, note=note))
    return regular and all(jump.order > 1 and np.isfinite(jump.size) for jump in found)


def _geometry(samples: Samples, findings: _Findings) -> tuple[Extreme, Extreme]:
    """Check that the path keeps away from itself; return the least and largest |sigma'|."""
    found = extremes(
        samples, {"curvature": (curvature, 1), "slowest": (parameter_speed, -1), "fastest": (parameter_speed, 1)}
    )
    bend = found["curvature"]
    (bent,) = findings.places(samples, [bend.parameter])
    approach = closest_approach(samples, bend.value)
    radius = 1 / bend.value if bend.value > 0 else np.inf
    tube = [Check("tube radius", radius, "m", Verdict.STATED, bent, note="least radius of curvature")]
    if approach is None:
        findings.checks.append(Check("self-distance", None, "m", Verdict.OK, note="nowhere doubles back"))
    else:
        first, second = findings.places(samples, [approach.first, approach.second])
        findings.checks.append(_distance_check(approach, first, second))
        if approach.contact:
            findings.reasons.append(wording.meeting(approach, first, second))
        if approach.distance / 2 < radius * (1 - ROUNDING):
            note = "half the self-distance"
            tube = [Check("tube radius", approach.distance / 2, "m", Verdict.STATED, first, second, note=note)]
    findings.checks += [Check("curvature", bend.value, "1/m", Verdict.STATED, bent), *tube]
    return found["slowest"], found["fastest"]


def _distance_check(approach: Approach, first: Place, second: Place) -> Check:
    verdict = Verdict.FAILS if approach.contact else Verdict.OK
    note = approach.kind if approach.contact else ""
    return Check("self-distance", approach.distance, "m", verdict, first, second, 0.0, note)


def _flight(
    vehicle: Vehicle,
    samples: Samples,
    speed: float,
    progress: Progress,
    limits: Limits,
    metres: tuple[float, float],
    findings: _Findings,
) -> tuple[Samples, np.ndarray]:
    """Check what a speed demands; return samples that hold every extreme, and the tightest margin (n,) at them."""

    def quantity(name: str) -> Quantity:
        return lambda jets: np.asarray(getattr(demands(vehicle, unit_derivatives(jets, progress), speed), name))

    floor = limits.floor(vehicle)
    found = extremes(samples, {row[0]: (quantity(row[2]), row[3]) for row in DEMANDS})
    samples = samples.with_parameters(np.array([each.parameter for each in found.values()]))
    places = dict(zip(found, findings.places(samples, [each.parameter for each in found.values()]), strict=True))
    allowed = findings.allowed = allowed_speeds(samples, vehicle, progress, limits)
    weightless = float(np.linalg.norm(hover(vehicle))) <= floor
    remedy = wording.advice(allowed, speed, progress, metres, weightless)
    for name, unit, _, sign, limited_by in DEMANDS:
        value, place = found[name].value, places[name]
        limit = floor if limited_by == "specific_thrust" else getattr(limits, limited_by) if limited_by else None
        fails = limit is not None and sign * value > sign * limit * (1 + sign * ROUNDING)
        verdict = Verdict.STATED if limit is None else Verdict.FAILS if fails else Verdict.OK
        note = "bound over all headings" if name == "torque" and not torque_is_exact(vehicle) else ""
        findings.checks.append(Check(name, value, unit, verdict, place, limit=limit, note=note))
        if fails and limit is not None and sign < 0:
            _fall(samples, quantity("specific_thrust"), found[name], place, limit, remedy, findings)
        elif fails and limit is not None:
            findings.reasons.append(
                wording.exceeding(str(limited_by).replace("_", " "), unit, value, limit, place, remedy)
            )
    largest = allowed[0][1] if allowed else None
    findings.checks.append(
        Check("largest speed", largest, progress.unit, Verdict.STATED, note=wording.intervals(allowed))
    )
    return samples, _margins(demands(vehicle, unit_derivatives(samples.jets, progress), speed), floor, limits)


def _fall(
    samples: Samples, quantity: Quantity, least: Extreme, place: Place, floor: float, remedy: str, findings: _Findings
) -> None:
    """Name the stretches where the specific thrust is below its floor."""
    stretches = negative_stretches(samples, lambda jets: quantity(jets) - floor)
    for first, last in stretches:
        start, end = findings.places(samples, [first, last])
        if last - first >= samples.span * (1 - ROUNDING):  # the whole path: the end is not the start again
            end = Place(samples.low + samples.span, samples.length, end.point)
        findings.stretches.append((start, end))
    findings.reasons.append(wording.falling(least.value, floor, place, findings.stretches, remedy))


def _margins(found: Demands, floor: float, limits: Limits) -> np.ndarray:
    """Return 1 minus the largest used share of any limit (n,), between -1 and 1."""
    shares = [floor / np.maximum(found.specific_thrust, floor / 4)]
    for name in ("thrust", "tilt_rate", "torque"):
        if (limit := getattr(limits, name)) is not None:
            shares.append(getattr(found, name) / limit)
    return np.asarray(np.clip(1 - np.max(shares, axis=0), -1.0, 1.0))
