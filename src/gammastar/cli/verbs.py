"""The verbs of the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gammastar import __version__, mission
from gammastar.cli import bars, campaigns, output
from gammastar.cli.arguments import AsJson, Changes, MissionName, chosen_mission
from gammastar.cli.process import note
from gammastar.errors import InputError, MissionError, PathError

app = typer.Typer(
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Fly underactuated vehicles along smooth curves exactly, from any attitude.",
    epilog="Exit codes: 0 done, 1 not flyable, ended early or a claim failed, 2 input that cannot be used, 130 interrupted.",
)


@app.callback(invoke_without_command=True)
def start(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False,
) -> None:
    """Print the version, or the help when no verb is given."""
    if version:
        output.text(f"gammastar {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        output.text(context.get_help())
        raise typer.Exit


@app.command()
def fly(
    name: Annotated[str | None, typer.Argument(metavar="MISSION", help="A built-in name or a TOML file.")] = None,
    out: Annotated[
        str | None,
        typer.Option(metavar="DIR", help="Write mission.toml, flight.parquet, summary.json and figures there."),
    ] = None,
    changes: Changes = None,
    as_json: AsJson = False,
    figures: Annotated[bool, typer.Option(help="Whether --out draws figures.")] = True,
    force: Annotated[bool, typer.Option("--force", help="Fly also what its certificate calls not flyable.")] = False,
    source: Annotated[
        str | None,
        typer.Option("--from", metavar="DIR", help="Fly a flight of this campaign again, in place of a MISSION."),
    ] = None,
    number: Annotated[int | None, typer.Option("--flight", metavar="K", help="Which flight of --from.")] = None,
) -> int:
    """Certify the paths of a mission, fly it and print its numbers."""
    from gammastar.report.certificate import brief
    from gammastar.report.folder import file_names, flight_summary, require_libraries, write_folder
    from gammastar.report.place import chosen_folder

    again = source is not None or number is not None
    if again and (source is None or number is None or name is not None or changes):
        raise InputError(
            "a flight of a campaign must be named by --from and --flight alone (got one of them, or MISSION or --set); correct it"
        )
    if name is None and not again:
        raise InputError("fly must have a MISSION, or --from DIR and --flight K (got neither); see gammastar missions")
    chosen = None if name is None else chosen_mission(name, changes)
    folder = None
    if out is not None:
        folder = chosen_folder(
            out, file_names(figures, autopilot=True), None if name is None or name in mission.names() else Path(name)
        )
        require_libraries(figures)
    if chosen is None:
        return _again(str(source), number or 0, folder, as_json, figures)
    with bars.progress("certifying"):
        certificate = brief(chosen.certificates())
    if not certificate["flyable"]:
        reason = certificate["reasons"][0]
        if not force:
            section = "" if reason.startswith("[") else "[path] "
            raise MissionError(f"{section}{reason}; or fly it all the same with --force")
        note(f"flown all the same: {reason}")
    with bars.progress("flying") as progress:
        record = chosen.fly(progress)
    summary = flight_summary(chosen, record, __version__, certificate)
    files = write_folder(folder, chosen, record, summary, figures) if folder is not None else []
    output.flight(summary, files, as_json)
    return 0 if record.completed else 1


def _again(source: str, number: int, folder: Path | None, as_json: bool, figures: bool) -> int:
    """Fly a flight of a campaign again and print its numbers."""
    from gammastar.campaign.run import Campaign
    from gammastar.report.certificate import brief
    from gammastar.report.folder import flight_summary, write_folder

    with bars.progress("flying"):
        found = Campaign.read(source).fly(number)
        certificate = brief(found.mission.certificates())
    summary = flight_summary(found.mission, found.record, __version__, certificate)
    summary = type(summary)({**summary, "campaign": source, "flight": number, "same_as_row": found.same})
    files = write_folder(folder, found.mission, found.record, summary, figures) if folder is not None else []
    output.flight(summary, files, as_json)
    if not found.same:
        note("not to the last bit the flight of the campaign: its computer, compiler or libraries were others")
    return 0 if found.record.completed else 1


app.command()(campaigns.campaign)


@app.command()
def check(
    name: MissionName,
    out: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|DIR", help="Draw the path, coloured by its tightest limit: .png, .svg or .pdf, or a folder."
        ),
    ] = None,
    changes: Changes = None,
    as_json: AsJson = False,
) -> int:
    """Certify that a mission's paths can be followed, how fast, and what that demands; nothing is flown."""
    from gammastar.report import certificate as report

    target = None if out is None else report.chosen_target(out)
    try:
        chosen = chosen_mission(name, changes)
        with bars.progress("certifying"):
            certificates = chosen.certificates()
    except PathError as error:
        output.no_certificate(str(error), as_json)
        return 1
    data = {"mission": chosen.title, "frame": chosen.frame, **report.whole(certificates)}
    files = [] if target is None else report.write(target, report.decisive(certificates), chosen.title, data)
    output.certificate(data, report.tables(certificates), files, as_json)
    return 0 if data["flyable"] else 1


@app.command()
def export(
    name: MissionName,
    out: Annotated[
        str,
        typer.Option(metavar="DIR", help="The folder to write: new, empty, or an earlier export.", show_default=False),
    ],
    target: Annotated[str, typer.Option(metavar="c99|crazyflie", help="What it is made for.")] = "c99",
    real: Annotated[
        str | None,
        typer.Option(
            metavar="float32|float64", help="The type of its numbers; float32, unless the mission says another."
        ),
    ] = None,
    changes: Changes = None,
    as_json: AsJson = False,
) -> None:
    """Write a folder of source code that flies a mission on the vehicle's own computer."""
    from gammastar.export import folder as place
    from gammastar.export.program import c_name
    from gammastar.export.targets import differences, files_of

    folder = place.chosen_folder(out)
    chosen = chosen_mission(name, changes)
    made = chosen.program(c_name(Path(name).stem), real, __version__)
    files = files_of(made, target, chosen.file.flight.duration)
    facts = place.facts_of(made, target, files) | differences(target)
    place.write(folder, files, facts)
    output.export(facts, folder, as_json)


app.command()(campaigns.study)
app.command()(campaigns.tune)


@app.command()
def missions(as_json: AsJson = False) -> None:
    """List the built-in missions."""
    output.missions(mission.titles(), as_json)


@app.command()
def vehicles(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="One of them: its numbers with their sources.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the built-in vehicles, or print one with the source beside every number."""
    from gammastar.vehicle import presets

    if name is None:
        output.vehicles([presets.preset(each).as_dict() for each in presets.names()], as_json)
    elif as_json:
        output.json_object(presets.preset(name).as_dict())
    else:
        output.text(presets.preset(name).text, end="")


@app.command()
def show(name: MissionName, changes: Changes = None, as_json: AsJson = False) -> None:
    """Print a mission as TOML with every default written out; it can be flown again."""
    chosen = chosen_mission(name, changes)
    if as_json:
        output.json_object(chosen.values())
    else:
        output.text(chosen.toml(), end="")


@app.command()
def reproduce(
    out: Annotated[str, typer.Option(metavar="DIR", help="Where figures and the index page go.")] = "out/reproduce",
    as_json: AsJson = False,
) -> None:
    """Draw Figures 3 to 17 of the paper and an index page that sets our numbers beside them."""
    from gammastar.report import reproduce as report
    from gammastar.report.place import chosen_folder

    folder = chosen_folder(out, report.file_names())
    with bars.progress("drawing") as progress:
        numbers = report.reproduce(folder, progress)
    output.reproduction(numbers, folder / report.INDEX, as_json)


@app.command()
def claims(as_json: AsJson = False) -> int:
    """Check every equation, lemma and objective of the paper and print the verdicts."""
    from gammastar.claims import Verdict, all_claims, check

    listed = all_claims()
    with bars.counter("checking", len(listed)) as count:
        results = check(listed, count)
    output.claims([result.as_dict() for result in results], as_json)
    return 1 if any(result.verdict is Verdict.FAILED for result in results) else 0
