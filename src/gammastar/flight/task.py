"""What a flight is asked to do, and which of the flights of a seed it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from gammastar.checks import instance, number
from gammastar.errors import InputError
from gammastar.law import AnyReference, Heading, Law, Speed
from gammastar.law.law import Yaw
from gammastar.law.reference import reference_given


class Chance(NamedTuple):
    """What the random numbers of a flight are keyed by."""

    seed: int
    flight: int


@dataclass(frozen=True, eq=False)
class Task:
    """A law with what it is to do; see `fly`."""

    law: Law
    reference: AnyReference
    yaw: Yaw  # constant reference of beta(r), or a heading
    settled_within: float  # [m]


def task(
    law: Law,
    speed: float | None,
    reference: AnyReference | None,
    yaw_reference: float,
    heading: Heading | None,
    settled_within: float,
) -> Task:
    """Return what `fly` is asked to do, checked.

    Raises:
        InputError: Something is no law, reference or heading, or two of them exclude each other.
    """
    instance(law, Law, "law", "make one with gs.design(vehicle, path)")
    if heading is not None:
        instance(heading, Heading, "heading", "make one with gs.Along(), gs.Azimuth() or gs.Towards()")
        if number(yaw_reference, "yaw reference") != 0:
            raise InputError("a flight has a heading or a yaw reference (got both); leave one of them out")
    if reference is not None:
        reference_given(reference)
    if (speed is None) == (reference is None):
        raise InputError("a flight needs exactly one of speed and reference (got both or none); give one of them")
    wanted: AnyReference = Speed(speed) if speed is not None else reference  # type: ignore[assignment]
    yaw = number(yaw_reference, "yaw reference") if heading is None else heading
    return Task(law, wanted, yaw, number(settled_within, "settled_within [m]", above=0))
