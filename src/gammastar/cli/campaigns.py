"""The verbs of campaigns: many flights, what they teach, and the tuning that they find best."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gammastar import mission
from gammastar.campaign.cost import DEFAULT_WEIGHTS, FAILURE, Cost
from gammastar.campaign.tune import EVALUATIONS, FLIGHTS, Tuner
from gammastar.cli import bars, output, process
from gammastar.cli.arguments import AsJson, Changes, MissionName, chosen_mission
from gammastar.cli.process import Interrupted, is_interrupt


def campaign(
    name: MissionName,
    flights: Annotated[
        int, typer.Option(metavar="N", help="How many; those that are there count.", show_default=False)
    ],
    out: Annotated[
        str, typer.Option(metavar="DIR", help="A new folder, or that of this campaign, to go on.", show_default=False)
    ],
    seed: Annotated[
        int | None, typer.Option(help="Of what is drawn and of all noise; the mission's own if left out.")
    ] = None,
    part: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Flights written together, which an interruption costs at most; 1000 if left out."
        ),
    ] = None,
    workers: Annotated[int | None, typer.Option(help="Threads; one for every processor if left out.")] = None,
    cluster: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Of a Dask scheduler, whose workers fly in place of this process."),
    ] = None,
    machine: Annotated[
        str, typer.Option(metavar="auto|native|casadi", help="What flies: compiled, or without.")
    ] = "auto",
    changes: Changes = None,
    as_json: AsJson = False,
) -> None:
    """Fly a mission and all that its campaign varies, and write a row a flight; what was interrupted goes on."""
    from gammastar.campaign.database import library
    from gammastar.campaign.run import campaign as run
    from gammastar.report.place import chosen_folder

    library()  # counts the flights in the end
    folder = chosen_folder(out, [])
    chosen = chosen_mission(name, changes)
    try:
        with bars.flights() as progress:
            flown = run(
                chosen,
                flights,
                folder,
                seed=seed,
                part=part,
                workers=workers,
                cluster=cluster,
                machine=machine,
                progress=progress,
            )
    except BaseException as error:
        if not is_interrupt(error):
            raise
        raise Interrupted(
            f"interrupted; start the same command again to go on: flights that are in {folder} are kept"
        ) from error
    output.campaign({"mission": chosen.title, **flown.facts(), "out": str(folder)}, as_json)


def study(
    campaign: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a campaign; it may still be flying.")],
    by: Annotated[
        list[str] | None,
        typer.Option(
            metavar="QUANTITY",
            help="Tell success by this, such as truth.mass_scale or start.position; repeatable. All that varies, if left out.",
        ),
    ] = None,
    bins: Annotated[int, typer.Option(help="Into how many parts a quantity is divided, at most.")] = 10,
    out: Annotated[
        str | None, typer.Option(metavar="DIR", help="Write a page, its numbers and its figures there.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Tell what a campaign teaches: how often flights succeed, by what varies, what they take and why others fail."""
    from gammastar.campaign.findings import findings
    from gammastar.campaign.store import Store
    from gammastar.campaign.study import Study
    from gammastar.report import study as report
    from gammastar.report.place import chosen_folder
    from gammastar.report.study_tables import as_text

    folder = None if out is None else chosen_folder(out, [report.DATA, report.INDEX])
    asked = Study(Store.read(campaign))
    with bars.progress("reading"):
        found = findings(asked, by or (), bins)
    files = []
    if folder is not None:
        from gammastar.campaign.pictures import pictures

        with bars.progress("drawing"):
            files = report.write(folder, found, pictures(asked, list(found["by"]), bins))
    output.study(found, as_text(found, whole=bool(by)), files, as_json)


def tune(
    name: MissionName,
    flights: Annotated[int, typer.Option(metavar="N", help="Flights of each tuning; as many others judge.")] = FLIGHTS,
    evaluations: Annotated[int, typer.Option(metavar="M", help="Tunings that are flown.")] = EVALUATIONS,
    cost: Annotated[
        list[str] | None,
        typer.Option(metavar="TERM=WEIGHT", help="A term of the cost, such as settling_time_s=1; repeatable."),
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TERM[=MOST]", help="The largest mean of a term; TERM alone: that of the mission; repeatable."
        ),
    ] = None,
    failure: Annotated[float, typer.Option(help="What a failed flight counts, in the mission's own means.")] = FAILURE,
    only: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="What is tuned, such as transverse or observer.force; repeatable."),
    ] = None,
    out: Annotated[str | None, typer.Option(metavar="FILE", help="Write the tuned mission there, as TOML.")] = None,
    seed: Annotated[int | None, typer.Option(help="Of flights and search; that of the mission if not given.")] = None,
    workers: Annotated[int | None, typer.Option(help="Threads; one for every processor if not given.")] = None,
    machine: Annotated[str, typer.Option(metavar="auto|native|casadi", help="What flies.")] = "auto",
    changes: Changes = None,
    as_json: AsJson = False,
) -> int:
    """Search the poles, observers and approach speed that cost least over a mission's campaign."""
    from gammastar.cli import tuning
    from gammastar.report.place import chosen_file, written

    weights = tuning.weights(cost) or DEFAULT_WEIGHTS
    limits = tuning.limits(limit)
    source = None if name in mission.names() else Path(name)
    file = None if out is None else chosen_file(out, ".toml", source)
    chosen = chosen_mission(name, changes)
    judged = Cost(weights, limits, failure)
    tuner = Tuner(chosen, flights, evaluations, judged, only or (), seed, machine, workers)
    with bars.progress("tuning") as progress:
        tuner.run(progress)
        if tuner.is_interrupted:
            process.answered()
        found = tuner.tuned(progress)
    try:
        if file is not None:
            written(file, found.toml())
    except OSError:
        tuning.tuned(found.as_dict(), None, as_json)  # a long search is not lost with its file
        raise
    tuning.tuned(found.as_dict(), file, as_json)
    return process.INTERRUPTED if tuner.is_interrupted else 0
