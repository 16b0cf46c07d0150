"""What comes up while a path is certified: rows, sentences, and places in the frame of the certificate."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from gammastar.certificate.certificate import Check, Verdict
from gammastar.certificate.scan import Interval
from gammastar.frames import convert_vector
from gammastar.path.sampling import Place, Samples


@dataclass
class Findings:
    """Rows and sentences as they come up."""

    frame: str  # of the points that are named
    checks: list[Check] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    stretches: list[tuple[Place, Place]] = field(default_factory=list)
    saturated: list[tuple[Place, Place]] = field(default_factory=list)
    allowed: tuple[Interval, ...] = ()

    def skip(self, *names: str) -> None:
        """Add rows that have no meaning while an earlier check fails."""
        self.checks += [Check(name, None, "", Verdict.SKIPPED) for name in names]

    def places(self, samples: Samples, parameters: ArrayLike) -> list[Place]:
        """Return the places at parameters (k,), their points in the frame of the certificate."""
        found = samples.places(np.asarray(parameters, dtype=float))
        points = (convert_vector(place.point, self.frame) + 0.0 for place in found)
        return [
            replace(place, point=(x, y, z))
            for place, (x, y, z) in zip(found, map(np.ndarray.tolist, points), strict=True)
        ]
