"""What a campaign's rows follow from: the manifest that stands beside them."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from dataclasses import dataclass

from gammastar.checks import whole
from gammastar.errors import CampaignError, InputError

FORMAT = 1  # of the folder
MOST_FLIGHTS = 10**9  # of a campaign: weeks on a large computer, and a million parts


@dataclass(frozen=True)
class Manifest:
    """What a campaign's rows follow from, and nothing else.

    Raises:
        InputError: Flights or parts are out of range, or something is of another kind.
    """

    mission: str  # TOML with every default written out
    seed: int
    flights: int
    part: int  # flights in a part; the last one may have fewer
    machine: str  # that flies them: 'native' or 'casadi'
    version: str  # of gammastar
    format: int = FORMAT

    def __post_init__(self) -> None:
        object.__setattr__(self, "flights", whole(self.flights, "flights", 1, MOST_FLIGHTS))
        object.__setattr__(self, "part", whole(self.part, "flights in a part", 1, MOST_FLIGHTS))
        object.__setattr__(self, "seed", whole(self.seed, "seed"))
        for name in ("mission", "machine", "version"):
            if not isinstance(getattr(self, name), str):
                raise InputError(f"{name} must be a text (got {getattr(self, name)!r}); put it in quotes")

    @classmethod
    def read(cls, text: str) -> Manifest:
        """Return the manifest of a file.

        Raises:
            CampaignError: It is of another format.
            ValueError: It is none.
        """
        try:
            values = json.loads(text)
        except RecursionError:
            raise ValueError("brackets without end") from None
        if not isinstance(values, dict) or "format" not in values:
            raise ValueError("no format in it")
        if values["format"] != FORMAT:
            raise CampaignError(
                f"a campaign must be of format {FORMAT} (got {values['format']!r}); read it with gammastar {values.get('version')}"
            )
        if unknown := set(values) ^ {field.name for field in dataclasses.fields(cls)}:
            raise ValueError(f"{min(unknown)} unknown or missing")
        return cls(**values)

    def text(self) -> str:
        """Return what `read` reads."""
        return json.dumps(dataclasses.asdict(self), indent=2, sort_keys=True) + "\n"

    @property
    def parts(self) -> int:
        """Return how many parts there are."""
        return -(-self.flights // self.part)

    def numbers(self, part: int) -> range:
        """Return the numbers of the flights in a part."""
        return range(part * self.part, min((part + 1) * self.part, self.flights))

    def mark(self, part: int) -> bytes:
        """Return what tells a part from those of other campaigns and from other parts; more flights change nothing in it."""
        pinned = {name: value for name, value in dataclasses.asdict(self).items() if name != "flights"}
        return hashlib.sha256(json.dumps([pinned, part], sort_keys=True).encode()).hexdigest().encode()

    def difference(self, wanted: Manifest) -> str | None:
        """Return in what this campaign differs from another one, other than how many flights it has; None where it does not."""
        said = {
            "mission": "of another mission",
            "seed": f"of the seed {self.seed}",
            "machine": f"flown by the machine {self.machine!r}",
            "part": f"with {self.part} flights in a part",
            "version": f"of gammastar {self.version}",
        }
        return next((text for name, text in said.items() if getattr(self, name) != getattr(wanted, name)), None)
