"""Run a campaign: fly the parts that are missing, here or on a cluster, and write each as it comes."""

from __future__ import annotations

import dataclasses
import functools
import os
import time
import warnings
from pathlib import Path
from typing import Any, NamedTuple

from gammastar.campaign.again import Again, flown_again
from gammastar.campaign.flown import STEPS, Progress
from gammastar.campaign.manifest import MOST_FLIGHTS, Manifest
from gammastar.campaign.places import Flyer, cluster_of, here
from gammastar.campaign.setting import Setting
from gammastar.campaign.store import MANIFEST, Store
from gammastar.campaign.study import Study
from gammastar.checks import instance, whole
from gammastar.errors import CompilerError, MachineWarning, MissingExtraError
from gammastar.mission import Mission
from gammastar.mission.load import parse
from gammastar.version import VERSION

PART = 1000  # flights: some seconds of work, which is all that an interruption costs


class Tally(NamedTuple):
    """What one run has done."""

    rows: int = 0  # written
    steps: int = 0  # control intervals that were flown
    wall_time: float = 0.0  # [s]


@dataclasses.dataclass(frozen=True, eq=False)
class Campaign:
    """The flights of a campaign in their folder, however many; made by `campaign`, or read again later."""

    store: Store
    tally: Tally = dataclasses.field(default_factory=Tally)  # of the run that made this

    @classmethod
    def read(cls, folder: str | os.PathLike[str]) -> Campaign:
        """Return the campaign in a folder.

        Raises:
            CampaignError: There is none.
        """
        return cls(Store.read(Path(folder)))

    def __len__(self) -> int:
        """Return how many flights there are so far."""
        return int(self.dataset().count_rows())

    @functools.cached_property
    def mission(self) -> Mission:
        """Return the mission that is flown."""
        return parse(self.store.manifest.mission)

    def dataset(self) -> Any:
        """Return all rows as a `pyarrow.dataset.Dataset`, which is read in pieces."""
        return self.store.dataset()

    def facts(self) -> dict[str, Any]:
        """Return how many flights there are, how they went, and what the run that made this has done, units in the keys."""
        study, manifest, tally = self.study(), self.store.manifest, self.tally
        time_taken = max(tally.wall_time, 1e-9)
        return {
            **study.rate().values(),
            "causes": [
                {"cause": each.status, "flights": each.rate.successes, "first": each.first} for each in study.causes()
            ],
            "rows_written": tally.rows,
            "parts": manifest.parts,
            "wall_time_s": tally.wall_time,
            "flights_per_s": tally.rows / time_taken,
            "steps_per_s": tally.steps / time_taken,
            "machine": manifest.machine,
            "seed": manifest.seed,
            "version": manifest.version,
        }

    def study(self) -> Study:
        """Return what answers questions about the rows."""
        return Study(self.store)

    def to_pandas(self) -> Any:
        """Return all rows as a `pandas.DataFrame`, in memory."""
        try:
            import pandas  # noqa: F401 - pyarrow makes it
        except ImportError as error:
            raise MissingExtraError("pandas", "campaign", "a data frame") from error
        return self.dataset().to_table().to_pandas()

    def to_polars(self) -> Any:
        """Return all rows as a `polars.DataFrame`, in memory."""
        try:
            import polars
        except ImportError as error:
            raise MissingExtraError("polars", "campaign", "a data frame") from error
        return polars.from_arrow(self.dataset().to_table())

    def fly(self, number: int) -> Again:
        """Fly one of the flights again, alone and whole: the same bits on the machine and computer that flew it.

        Raises:
            InputError: There is no such flight, or it was refused.
        """
        return flown_again(self.store, self.mission, number)


def campaign(
    mission: Mission,
    flights: int,
    out: str | os.PathLike[str],
    *,
    seed: int | None = None,
    part: int | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    machine: str = "auto",
    progress: Progress | None = None,
) -> Campaign:
    """Fly a mission with [campaign] many times and write a row a flight; a run that was interrupted goes on where it was.

    Flight k depends on the mission, the seed and k alone, on one machine to the last bit: not on the flights beside it, the workers, the
    cluster, or interruptions.

    Args:
        mission: With the section [campaign].
        flights: How many; more than are there already are flown beside them.
        out: Folder, new or of this campaign: manifest.json, and the rows as Parquet files in parts/.
        seed: Of what is drawn and of all noise; that of [flight] when left out.
        part: Flights that are flown and written together; 1000, or what the folder has, when left out.
        workers: Threads; one for every processor when left out.  On a cluster those of a part, all of its worker's when left out.
        cluster: Address of a running scheduler of Dask, such as 'tcp://host:8786', whose workers fly in place of this process.
        machine: 'native', 'casadi', or 'auto', which is the one that the folder has, or native where a compiler answers.
        progress: Called with (flights done, flights in all).

    Raises:
        InputError: The mission has no campaign, or one that cannot be flown, or a number is out of range.
        CampaignError: The folder holds something else or cannot be written, or the cluster cannot be used.
    """
    instance(mission, Mission, "mission", "load one with gs.load_mission")
    count = whole(flights, "flights", 1, MOST_FLIGHTS)
    size = None if part is None else whole(part, "flights in a part", 1, MOST_FLIGHTS)
    threads = None if workers is None else whole(workers, "workers", 1)
    folder = Path(out)
    held = Store.read(folder).manifest if (folder / MANIFEST).exists() else None
    source = mission.source()
    setting = Setting(parse(source), mission.file.flight.seed if seed is None else whole(seed, "seed"))
    with here(threads) if cluster is None else cluster_of(cluster, threads) as fly:
        flying = resolved(setting, machine if held is None or machine != "auto" else held.machine)
        size = size or (PART if held is None else held.part)
        manifest = Manifest(source, setting.seed, count, size, flying, VERSION)
        with Store.writing(folder, manifest) as store:
            return Campaign(store, _filled(store, setting, fly, progress))


def resolved(setting: Setting, machine: str) -> str:
    """Return the machine that flies a campaign, after one interval on it from the mission's own start: what no flight can do is refused.

    Raises:
        InputError: Something concerns all flights.
        CompilerError: The native machine was asked for by name, and there is none.
    """
    mission, count = setting.base, 2  # two, so that what is compiled is what many flights take
    given: dict[str, Any] = setting.nominal(count) | {"duration": mission.interval}
    try:
        mission.fly_many([mission.start()] * count, machine="native" if machine == "auto" else machine, **given)
        return "native" if machine == "auto" else machine
    except CompilerError as error:
        if machine != "auto":
            raise
        warnings.warn(f"CasADi's machine flies, some hundred times slower: {error}", MachineWarning, stacklevel=3)
        return "casadi"


def _filled(store: Store, setting: Setting, fly: Flyer, progress: Progress | None) -> Tally:
    """Fly and write what is missing; return what has been done."""
    begun, total = time.perf_counter(), store.manifest.flights
    missing = store.missing()
    there = total - sum(len(store.manifest.numbers(part)) for part in missing)
    tally = Tally()

    def tell(flown: int, _: int) -> None:
        if progress is not None:
            progress(there + tally.rows + flown, total)

    tell(0, 0)
    for part, table in fly(setting, store.manifest, missing, tell):
        store.write(part, table)
        steps = int(table.schema.metadata[STEPS])
        tally = Tally(tally.rows + len(table), tally.steps + steps, time.perf_counter() - begun)
        tell(0, 0)
    return tally
