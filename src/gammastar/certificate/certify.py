"""From a vehicle, a path and a speed to the certificate: the geometry first, then what following it demands."""

from __future__ import annotations

import numpy as np

from gammastar.certificate import wording
from gammastar.certificate.certificate import Certificate, Check, Verdict
from gammastar.certificate.embedding import Approach, closest_approach
from gammastar.certificate.findings import Findings
from gammastar.certificate.motion import (
    Progress,
    curvature,
    parameter_speed,
)
from gammastar.certificate.search import Extreme, extremes
from gammastar.certificate.speed_checks import check_speed, rows_of
from gammastar.certificate.speeds import Limits
from gammastar.checks import instance, number
from gammastar.errors import UnknownNameError
from gammastar.frames import check_frame
from gammastar.path import Path
from gammastar.path.sampling import Place, Samples, sample
from gammastar.path.smoothness import ORDERS, jumping, jumps
from gammastar.vehicle import Vehicle

STANDSTILL = 1e-6  # of the mean |sigma'|: a smaller one counts as zero
ROUNDING = 1e-9  # relative: a value this close to its limit meets it
GEOMETRY = ("self-distance", "curvature", "tube radius")


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
        limits: Of the vehicle, besides those of its rotors; by default only the floor of the specific thrust counts.
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
    progress, samples, findings = Progress(progress), sample(path), Findings(frame)
    with np.errstate(all="ignore"):
        sound = _class_of(samples, findings)
        metres = (1.0, 1.0)
        margin = np.zeros(len(samples.parameters))
        if sound:
            slowest, fastest = _geometry(samples, findings)
            metres = metres if progress is Progress.METRES else (slowest.value, fastest.value)
            samples, margin = check_speed(vehicle, samples, abs(speed), progress, limits, metres, findings)
        else:
            findings.skip(*GEOMETRY, *(row[0] for row in rows_of(vehicle)), "largest speed")
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
        tuple(findings.saturated),
        samples.parameters,
        samples.arc_lengths,
        samples.jets[:, 0],
        margin,
    )


def _class_of(samples: Samples, findings: Findings) -> bool:
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


def _geometry(samples: Samples, findings: Findings) -> tuple[Extreme, Extreme]:
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
