"""The page of a study: figures beside the numbers that they show, one file of plain HTML that also prints well."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any
from urllib.parse import quote

from gammastar.campaign.columns import label
from gammastar.report.page import STYLE
from gammastar.report.study_tables import Table, opening, tables

CAPTIONS = {
    "basin-attitude": "From which attitudes flights settle, and how long it takes them",
    "basin-position": "From where flights settle, and how long it takes them",
    "thrust-to-weight": "Success and settling time against thrust to weight",
}
CURVES = {"thrust-to-weight": "by thrust_to_weight"}  # title of the table beside a figure, where its name does not say


def page(found: Mapping[str, Any], stems: Sequence[str], data: str) -> str:
    """Return the page as HTML; images are expected beside it as <stem>.png and <stem>.svg, and its numbers in a file."""
    title, *lines = opening(found) if found["mission"] else ["A campaign", *opening(found)]
    by_title = {table.title: table for table in tables(found, whole=True)}
    beside = {stem: by_title.pop(_title_beside(stem), None) for stem in stems}
    parts = [f"<h1>{escape(title)}</h1>", *(f"<p>{escape(line)}.</p>" for line in lines)]
    parts.append(
        f'<p class="note">gammastar {escape(found["version"])}, machine {escape(found["machine"])}; intervals are Wilson\'s; '
        f'<a href="{data}">{data}</a></p>'
    )
    parts += [_figure(stem, beside[stem], found["frame"]) for stem in stems if beside[stem] is None]
    parts += [_section(table) for table in by_title.values()]
    parts += [_figure(stem, beside[stem], found["frame"]) for stem in stems if beside[stem] is not None]
    body = "\n".join(parts)
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def _title_beside(stem: str) -> str:
    return CURVES.get(stem) or f"by {stem.removeprefix('tolerance-')}"


def _figure(stem: str, table: Table | None, frame: str) -> str:
    name = escape(_caption(stem, frame))
    rows = "" if table is None else _table(table)
    return (
        f'<h2 id="{escape(stem)}">{name}</h2>\n<figure><a href="{quote(stem)}.svg"><img src="{quote(stem)}.png" alt="{name}" '
        f'loading="lazy"></a></figure>\n{rows}'
    )


def _section(table: Table) -> str:
    title = escape(table.title[0].upper() + table.title[1:])
    return f"<h2>{title}</h2>\n{_table(table)}"


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(name)}</th>" for name in table.head)
    rows = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows)
    notes = "".join(f'<p class="note">{escape(note)}</p>' for note in table.notes)
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>{notes}'


def _caption(stem: str, frame: str) -> str:
    """Return what a figure shows."""
    return CAPTIONS.get(stem) or f"Success and settling time over {label(stem.removeprefix('tolerance-'), frame)}"
