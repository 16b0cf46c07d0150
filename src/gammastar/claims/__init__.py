"""Every numbered equation, lemma and objective of the paper, and some of its remarks, each with a check that can fail."""

from __future__ import annotations

import math
import re

from gammastar.claims import (
    attitude,
    control,
    coordinates,
    decoupling,
    internal,
    model,
    objectives,
    outputs,
    remarks,
    transformation,
)
from gammastar.claims.claim import Claim, DisagreementError, Finding, Method, Result, Verdict, check

__all__ = ["Claim", "DisagreementError", "Finding", "Method", "Result", "Verdict", "all_claims", "check"]

_ROOMS = (model, attitude, coordinates, outputs, decoupling, transformation, control, internal, objectives, remarks)


def all_claims() -> tuple[Claim, ...]:
    """Return every claim, in the order of the paper but for G1-G4 and the remarks, which come after what they rest on."""
    claims = [claim for room in _ROOMS for claim in room.CLAIMS]
    places, following = [], math.inf
    for claim in reversed(claims):  # what has no number stands before the next equation
        if number := re.fullmatch(r"\((\d+)\)", claim.key):
            following = int(number[1])
        places.append(following)
    return tuple(claim for _, claim in sorted(zip(reversed(places), claims, strict=True), key=lambda pair: pair[0]))
