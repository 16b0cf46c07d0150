"""The folder of a flight: its mission to fly again, its rows, its summary and its figures.

They appear together or not at all.
"""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

from gammastar.errors import MissingExtraError
from gammastar.flight import FlightRecord, Summary
from gammastar.mission import Mission
from gammastar.mission.turn import record_columns
from gammastar.report.place import filled

ROWS, SUMMARY, MISSION = "flight.parquet", "summary.json", "mission.toml"


def flight_summary(mission: Mission, record: FlightRecord, version: str, certificate: Mapping[str, Any]) -> Summary:
    """Return the record's summary with the mission's title and frame, its certificate in brief, and the versions that computed it.

    No number in it depends on the frame.
    """
    return Summary(
        {
            "mission": mission.title,
            "frame": mission.frame,
            **record.summary(),
            "start_attitude_distance": mission.start_attitude_distance,
            "certificate": certificate,
            "versions": {
                "gammastar": version,
                "casadi": metadata.version("casadi"),
                "numpy": metadata.version("numpy"),
                "python": platform.python_version(),
            },
        }
    )


def to_json(values: Mapping[str, Any]) -> str:
    """Return one JSON object as ASCII text, newline included; what is not finite becomes null."""
    return json.dumps(_finite(values), indent=2, allow_nan=False) + "\n"


def file_names(figures: bool = True, autopilot: bool = False) -> list[str]:
    """Return the names of the files that `write_folder` writes, of a flight with an autopilot or without."""
    from gammastar.figures.flight import AUTOPILOT_DRAWINGS, DRAWINGS
    from gammastar.figures.save import FORMATS

    drawings = [*DRAWINGS, *(AUTOPILOT_DRAWINGS if autopilot else [])]
    drawn = [f"{name}.{kind}" for name in drawings for kind in FORMATS] if figures else []
    return [MISSION, ROWS, SUMMARY, *drawn]


def require_libraries(figures: bool = True) -> None:
    """Raise `MissingExtraError` now if pyarrow, or matplotlib when figures are wanted, would be missing in `write_folder`."""
    _parquet()
    if figures:
        from gammastar.figures import style

        style.require_matplotlib()


def write_folder(
    folder: Path, mission: Mission, record: FlightRecord, summary: Mapping[str, Any], figures: bool = True
) -> list[Path]:
    """Write mission.toml, flight.parquet, summary.json and, if wanted, the figures of a flight; return the files.

    Rows and summary are in the mission's frame, which the file's metadata names; figures always show `ned`, third axis down.  Files of
    these names are replaced, others in the folder are left alone.

    Raises:
        MissingExtraError: pyarrow is not installed, or matplotlib when figures are wanted.
        OSError: The folder cannot be written.
    """
    with filled(folder) as made:
        (made / MISSION).write_text(mission.toml(), encoding="utf-8", newline="\n")
        (made / SUMMARY).write_text(to_json(summary), encoding="utf-8", newline="\n")
        _write_rows(made / ROWS, mission, record)
        if figures:
            from gammastar.figures import draw_flight, save

            for name, figure in draw_flight(record, mission.title).items():
                save(figure, made / name)
    return [folder / name for name in sorted(file_names(figures, record.autopilot is not None))]


def _write_rows(file: Path, mission: Mission, record: FlightRecord) -> None:
    """Write the record's columns in the mission's frame; metadata: title, frame, status and the mission itself."""
    pyarrow, parquet = _parquet()
    about = {
        "title": mission.title,
        "frame": mission.frame,
        "axes": "world and body third axes " + ("down" if mission.frame == "ned" else "up"),
        "status": record.status.name.lower(),
        "mission": mission.toml(),
    }
    table = pyarrow.table(record_columns(record, mission.frame)).replace_schema_metadata(about)
    parquet.write_table(table, file, compression="zstd")


def _parquet() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise MissingExtraError("pyarrow", "data", "writing flight.parquet") from error
    return pyarrow, pyarrow.parquet


def _finite(value: Any) -> Any:
    """Return nested values with None for every number that is not finite."""
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
