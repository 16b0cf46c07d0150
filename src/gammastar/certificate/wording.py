"""Sentences of a refusal: what was expected, what came and where, what to do."""

from __future__ import annotations

import math

import numpy as np

from gammastar.certificate.embedding import Approach
from gammastar.certificate.motion import Progress
from gammastar.certificate.scan import Interval
from gammastar.path.sampling import Place

DIGITS = 4  # of a recommended speed, rounded towards the safe side
SHOWN = 3  # places or stretches that are named; the others are counted


def irregular(place: Place) -> str:
    """Return why a path that stands still somewhere is refused."""
    return (
        f"the path must move on with its parameter everywhere (got zero speed of the parameterisation, such as a cusp, at {place}); "
        "round the place off, or change the parameterisation"
    )


def resolution(unresolved: np.ndarray) -> str:
    """Return what is said of a smooth path, and where its samples may have missed an extreme."""
    sound = "five continuous derivatives"
    if not unresolved.size:
        return sound
    return f"{sound}, but too sharp for {unresolved.size} of the samples, first at parameter {unresolved[0]:.6g}: extremes may be larger"


def meeting(approach: Approach, first: Place, second: Place) -> str:
    """Return why a path that meets itself is refused."""
    if approach.kind == "meets itself at its ends":
        remedy = "give its period to make it a closed path, or let it end earlier"
    elif approach.kind == "runs over itself":
        remedy = "shorten its domain or period to one run, or move the runs apart"
    else:
        remedy = "move the two parts apart, for example in height"
    return (
        f"the path must keep away from itself (got a path that {approach.kind}: {approach.distance:.2g} m between "
        f"{first} and {second}); {remedy}"
    )


def saturated(share: float, place: Place, stretches: list[tuple[Place, Place]], remedy: str) -> str:
    """Return why a speed at which the rotors cannot give the wrench on the way is refused."""
    got = f"{share:.4g} of their range" if math.isfinite(share) else "no bound"
    return (
        f"rotors must be able to give the thrust and torque (got {got} at {place}; beyond it {_where(stretches)}); {remedy}, "
        "or ask for a feasible profile of the speed, which slows down there"
    )


def falling(
    least: float,
    floor: float,
    place: Place,
    stretches: list[tuple[Place, Place]],
    remedy: str,
) -> str:
    """Return why a speed with free fall, or nearly so, on the way is refused."""
    what = "free fall" if least <= 1e-6 * floor else f"a least of {least:.3g} m/s^2"
    return f"specific thrust must stay above {floor:.3g} m/s^2 (got {what} at {place}; below it {_where(stretches)}); {remedy}"


def exceeding(name: str, unit: str, value: float, limit: float, place: Place, remedy: str) -> str:
    """Return why a speed that demands more than a limit is refused."""
    got = f"{value:.4g} {unit}" if math.isfinite(value) else "no bound"
    return f"{name} must stay within {limit:.4g} {unit} (got {got} at {place}); {remedy}"


def advice(
    allowed: tuple[Interval, ...], speed: float, progress: Progress, metres: tuple[float, float], weightless: bool
) -> str:
    """Return what to do about the speed: the nearest allowed ones below and above, in the unit of progress and in m/s."""
    slower = [high for _, high in allowed if high < speed]
    faster = [low for low, _ in allowed if low > speed]
    parts = []
    if slower:
        parts.append(f"fly at most {_speed(max(slower), -1, progress, metres)}")
    if faster:
        parts.append(f"{'or' if slower else 'fly'} at least {_speed(min(faster), +1, progress, metres)}")
    if parts:
        return ", ".join(parts)
    if allowed:
        return "fly slower"
    if weightless:
        return (
            "no constant speed will do: with gravity zero or balanced, a straight stretch at constant speed needs no thrust, "
            "which is free fall; bend the path there, vary the speed, or fly against a constant load"
        )
    return "no constant speed will do; change the path, or raise what limits it"


def intervals(allowed: tuple[Interval, ...]) -> str:
    """Return the allowed speeds in words."""
    if not allowed:
        return "no constant speed will do"
    return "allowed: " + ", ".join(
        f"{low:.4g} to {high:.4g}" if math.isfinite(high) else f"from {low:.4g}" for low, high in allowed
    )


def _where(stretches: list[tuple[Place, Place]]) -> str:
    """Return stretches in words."""
    where = "; ".join(
        f"from parameter {first.parameter:.4g} to {last.parameter:.4g} ({first.arc_length:.4g} to {last.arc_length:.4g} m)"
        for first, last in stretches[:SHOWN]
    )
    return where + _more(len(stretches), "stretch")


def _more(count: int, what: str) -> str:
    """Return how many things of a kind are left unnamed."""
    left = count - SHOWN
    return f" and {left} more {what}{('es' if what.endswith('h') else 's') if left > 1 else ''}" if left > 0 else ""


def _speed(value: float, side: int, progress: Progress, metres: tuple[float, float]) -> str:
    """Return a speed rounded downward (side -1) or upward (+1), with its range in m/s if that is another unit."""
    rounded = _rounded(value, side)
    if progress is Progress.METRES:
        return f"{rounded:.{DIGITS}g} m/s"
    low, high = (f"{rounded * each:.{DIGITS}g}" for each in metres)
    return f"{rounded:.{DIGITS}g} {progress.unit} ({low if low == high else f'{low} to {high}'} m/s)"


def _rounded(value: float, side: int) -> float:
    """Return a positive number with few digits, not above it (side -1) or not below it (+1)."""
    if value == 0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(value)) + 1 - DIGITS)
    return float((np.floor if side < 0 else np.ceil)(value / step) * step)
