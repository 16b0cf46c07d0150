"""The [[replacements]] tables: paths that take the place of [path] in flight, one after another."""

from __future__ import annotations

from gammastar.flight import Replacement
from gammastar.mission.complaint import within
from gammastar.mission.paths import AnyPath
from gammastar.mission.references import AnyReference
from gammastar.mission.values import Positive, Section


class ReplacementSection(Section):
    """Another path from some time on."""

    time: Positive  # [s]
    path: AnyPath
    reference: AnyReference | None = None  # along the new path; that of the mission, anew, when left out

    def replacement(self, frame: str, place: str) -> Replacement:
        """Return the replacement, in `ned`; complaints name its place in the file, such as 'replacements.0'."""
        with within(f"[{place}.path]"):
            path = self.path.path(frame)
        with within(f"[{place}.reference]"):
            reference = None if self.reference is None else self.reference.factory()(**self.reference.arguments())
        with within(f"[{place}]"):
            return Replacement(self.time, path, reference)
