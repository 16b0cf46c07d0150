"""A speed along a path that the vehicle can fly everywhere: as wanted where it can be, slower where it cannot.

On the path the demands of a motion are functions of the place and of the speed with its derivatives.  At many places the largest
constant speed within the limits is found first; between knots, each as slow as the slowest place on either side, the speed changes
smoothly.  Changing it demands something too, so knots are lowered until the motion itself keeps to the limits everywhere it is looked
at.  Of several numbers of knots the quickest profile is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gammastar.certificate.motion import demands
from gammastar.certificate.speeds import Limits
from gammastar.checks import instance, number
from gammastar.errors import InputError
from gammastar.law import Profile
from gammastar.path import Path
from gammastar.vehicle import Vehicle

PLACES = 720  # of the path, at which demands are looked at
KNOTS = (16, 32, 64)
LOWERING = 0.97  # of a knot beside a place that demands too much
ROUNDS = 200
BISECTIONS = 30
SLOWEST = 1e-3  # of the largest speed at any place; a vehicle that needs to be slower elsewhere cannot fly the path
LEAST = 1e-60  # of the speed wanted: far below anything


def feasible_profile(
    vehicle: Vehicle, path: Path, speed: float, limits: Limits | None = None, reserve: float = 0.1
) -> Profile:
    """Return the speed over progress that is `speed` where the vehicle can fly it exactly, and less where it cannot.

    Args:
        vehicle: Its rotors, if it has any, are its limits too.
        path: Curve or implicit path, over its `domain`.
        speed: Wanted [path parameter/s]; backwards when negative.
        limits: More limits of the vehicle, and the least specific thrust.
        reserve: Share of every limit that is kept for disturbances and feedback.

    Returns:
        A profile over progress; on a path that ends, it comes to rest there.  Demands are looked at in 720 places: of a path that is
        sharp between them, the certificate of a slow enough speed says more.

    Raises:
        InputError: The speed is zero, the reserve no share, or the vehicle cannot fly the path even at a thousandth of its fastest speed.
    """
    instance(vehicle, Vehicle, "vehicle", "make one with gs.Vehicle(mass, inertia)")
    instance(path, Path, "path", "make one with gs.paths, such as gs.paths.circle()")
    limits = Limits() if limits is None else limits
    instance(limits, Limits, "limits", "make them with gs.Limits()")
    reserve = number(reserve, "reserve", at_least=0)
    if number(speed, "speed [path parameter/s]") == 0 or reserve >= 1:
        raise InputError(
            f"a feasible profile needs a speed other than zero and a reserve below one (got {speed:g} and {reserve:g}); correct them"
        )
    search = _Search(vehicle, path, limits, 1 - reserve)
    caps = search.caps(abs(speed))
    found = [profile for count in KNOTS if (profile := search.lowered(caps, count)) is not None]
    if not found:
        raise InputError(
            "no profile of the speed keeps to the limits of the vehicle along the path (got demands above them however slow); "
            "certify says where and why"
        )
    points = min(found, key=search.duration)
    return Profile(points if speed > 0 else points * [1, -1])


@dataclass(frozen=True, eq=False)
class _Search:
    vehicle: Vehicle
    path: Path
    limits: Limits
    share: float  # of the limits that may be used

    @property
    def places(self) -> np.ndarray:
        low, high = self.path.ends or self.path.domain
        return np.linspace(low, high, PLACES, endpoint=self.path.period is None)

    def usage(self, derivatives: np.ndarray, speed: np.ndarray | float = 1.0) -> np.ndarray:
        """Return the largest share (n,) of a limit that a motion uses, over the share that it may use."""
        found = demands(self.vehicle, derivatives, speed)
        floor = self.limits.floor(self.vehicle)
        with np.errstate(divide="ignore", invalid="ignore"):
            used = [floor / found.specific_thrust * self.share]  # the floor is a reserve in itself
            most = {"thrust": found.thrust, "tilt_rate": found.tilt_rate, "torque": found.torque}
            used += [value / limit for name, value in most.items() if (limit := getattr(self.limits, name)) is not None]
            used.append(found.rotor_share)
        return np.asarray(np.nan_to_num(np.max(used, axis=0), nan=np.inf) / self.share)

    def caps(self, speed: float) -> np.ndarray:
        """Return the largest constant speed (n,) at each place that the limits allow, at most the one wanted."""
        derivatives = self.path.jets(self.places)[:, :5]
        high = np.full(PLACES, speed)
        fits = self.usage(derivatives, high) <= 1
        while not fits.all() and high.min() > LEAST * speed:  # a wish of any size: to the decade first
            smaller = np.where(fits, high, high / 10)
            fits |= self.usage(derivatives, smaller) <= 1
            high = np.where(fits, high, smaller)
        low = np.where(self.usage(derivatives, high) <= 1, high, 0.0)
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            fits = self.usage(derivatives, middle) <= 1
            low, high = np.where(fits, middle, low), np.where(fits, high, middle)
        return low

    def lowered(self, caps: np.ndarray, count: int) -> np.ndarray | None:
        """Return the points (count, 2) of a profile within the limits, or None when there is none with as many knots."""
        closed, places = self.path.period is not None, self.places
        knots = np.linspace(places[0], self._end, count + 1)[: count if closed else None]
        index = np.minimum(((places - knots[0]) / (self._end - knots[0]) * count).astype(int), count - 1)
        slowest = np.array([caps[index == k].min() for k in range(count)])
        before = np.roll(slowest, 1) if closed else np.concatenate([slowest[:1], slowest])
        after = slowest if closed else np.concatenate([slowest, slowest[-1:]])
        speeds, least = np.minimum(before, after), SLOWEST * caps.max()
        rest = self.path.ends is not None
        for _ in range(ROUNDS):
            if not np.all(speeds > least):
                return None
            points = np.column_stack([knots, speeds])
            if rest:
                points[-1, 1] = 0.0
            over = self.usage(self.motion(points)) > 1
            if not over.any():
                return self._simplified(points)
            first = np.unique(index[over])
            second = (first + 1) % len(speeds)
            faster = speeds[first] / speeds[second]  # of two knots of different speeds the faster one asks for more
            lowered = np.concatenate([first[faster > LOWERING], second[faster < 1 / LOWERING]])
            speeds[np.unique(lowered)] *= LOWERING
        return None

    @property
    def _end(self) -> float:
        low = self.places[0]
        return float(low + self.path.period if self.path.period is not None else self.places[-1])

    def motion(self, points: np.ndarray) -> np.ndarray:
        """Return position and its first four time derivatives (n, 5, 3) along a profile."""
        rates = self._rates(points)
        sigma = np.moveaxis(self.path.jets(self.places)[:, :5], 1, 0)
        one, two, three, four = (rates[:, k, None] for k in range(1, 5))
        return np.stack(
            [
                sigma[0],
                sigma[1] * one,
                sigma[2] * one**2 + sigma[1] * two,
                sigma[3] * one**3 + 3 * sigma[2] * one * two + sigma[1] * three,
                sigma[4] * one**4
                + 6 * sigma[3] * one**2 * two
                + sigma[2] * (3 * two**2 + 4 * one * three)
                + sigma[1] * four,
            ],
            axis=1,
        )

    def _rates(self, points: np.ndarray) -> np.ndarray:
        """Return the parameter and its first four time derivatives (n, 5) along a profile."""
        reference = Profile(points).resolved(self.path, float(points[0, 0]))
        rates = np.zeros((PLACES, 5))
        rates[:, 0] = self.places
        for k in range(1, 5):  # the derivative k of w(lambda(t)) needs the ones below it
            rates[:, k] = reference.jets(np.zeros(PLACES), rates[:, :4])[:, k]
        return rates

    def duration(self, points: np.ndarray) -> float:
        """Return the time [s] that a profile takes, up to what is left at a place of rest."""
        moving = self._rates(points)[:-1, 1]
        return float(np.sum(np.diff(self.places) / moving))

    def _simplified(self, points: np.ndarray) -> np.ndarray:
        """Return a profile of one speed as one point."""
        if self.path.ends is None and np.ptp(points[:, 1]) == 0:
            return points[:1]
        return points
