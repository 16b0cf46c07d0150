"""A flight along one path after another: each is a phase with its own law and reference, flown by the same compiled graph if it fits."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from gammastar.checks import instance, number, shortened
from gammastar.errors import InputError
from gammastar.law import AnyReference, Law
from gammastar.law.reference import reference_given
from gammastar.path import Path


@dataclass(frozen=True, eq=False)
class Replacement:
    """Another path from some time on.

    The new path is followed from the point nearest to the vehicle then.  Attitude, thrust and their rates are states and go on without
    a jump, as does an input that is held; only what the law asks for next changes.
    """

    time: float  # [s] it takes effect at the next row of the record
    path: Path
    reference: AnyReference | None = None  # along the new path, beginning then; that of the flight, anew, when left out

    def __post_init__(self) -> None:
        number(self.time, "time of a replacement [s]", above=0)
        instance(self.path, Path, "path of a replacement", "make one with gs.paths, such as gs.paths.circle()")
        if self.reference is not None:
            reference_given(self.reference)


@dataclass(frozen=True, eq=False)
class Phase:
    """The part of a flight that follows one path."""

    row: int  # of the record, the first
    law: Law
    reference: AnyReference


def phases_of(
    law: Law, reference: AnyReference, replacements: Sequence[Replacement], interval: float, steps: int
) -> list[Phase]:
    """Return the phases of a flight of some steps of an interval [s].

    Raises:
        InputError: The replacements are no list of them, not in the order of time, or one comes after the end.
    """
    if isinstance(replacements, Replacement) or not isinstance(replacements, Iterable):
        raise InputError(
            f"replacements must be a list (got {shortened(replacements)}); write [gs.Replacement(time, path)]"
        )
    phases = [Phase(0, law, reference)]
    for replacement in replacements:
        instance(replacement, Replacement, "each of the replacements", "make one with gs.Replacement(time, path)")
        row = max(1, int(np.ceil(min(replacement.time / interval - 1e-6, steps + 1.0))))
        if row > steps:
            raise InputError(
                f"a replacement must come before the end of the flight (got {replacement.time:g} s of {steps * interval:g} s); "
                "fly longer or replace earlier"
            )
        changed = dataclasses.replace(law, path=replacement.path)
        phases.append(Phase(row, changed, replacement.reference or reference))
    for before, after in itertools.pairwise(phases):
        if after.row <= before.row:
            raise InputError(
                f"replacements must come one after the other (got rows {before.row} and {after.row}); sort them by their time"
            )
    if law.approach is not None and any(phase.law.path.components != 3 for phase in phases):
        raise InputError("an approach from anywhere needs curves (got an implicit path); replace by a curve")
    return phases
