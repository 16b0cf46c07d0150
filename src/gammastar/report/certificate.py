"""A certificate as a table for people, as plain data for programs, and as a picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gammastar.certificate import Certificate, Check, Place, Verdict
from gammastar.errors import InputError
from gammastar.report.folder import to_json
from gammastar.report.place import chosen_folder, filled

PICTURE, DATA = "certificate", "certificate.json"
PICTURES = ("png", "svg", "pdf")  # endings of --out that ask for one file
HEADS = ("check", "", "value", "limit", "parameter", "along [m]", "point [m]")
COMPARED = {"regular": ">=", "self-distance": ">", "specific thrust": ">="}  # what is not in here must be no larger
SHOWN = {Verdict.OK: "ok", Verdict.FAILS: "FAILS", Verdict.STATED: "", Verdict.SKIPPED: "not examined"}


def whole(certificates: Mapping[str, Certificate]) -> dict[str, Any]:
    """Return a mission's certificates, by section, as plain data: that of [path], and whether and why not they are all flyable."""
    first, *others = certificates.values()
    data = first.as_dict() | {"flyable": first.flyable and all(each.flyable for each in others)}
    data["reasons"] = [_sentence(section, reason) for section, each in certificates.items() for reason in each.reasons]
    return data | {"replacements": [each.as_dict() for each in others]} if others else data


def brief(certificates: Mapping[str, Certificate]) -> dict[str, Any]:
    """Return what a flight says of its certificates."""
    data = whole(certificates)
    return {key: data[key] for key in ("flyable", "reasons", "speed_per_s", "largest_speed_per_s")}


def tables(certificates: Mapping[str, Certificate]) -> str:
    """Return the tables of a mission's certificates under each other, those of replacements under their sections."""
    return "\n\n".join(_sentence(section, table(each)) for section, each in certificates.items())


def decisive(certificates: Mapping[str, Certificate]) -> Certificate:
    """Return the first certificate that is not flyable, or else that of [path]."""
    first, *_ = certificates.values()
    return next((each for each in certificates.values() if not each.flyable), first)


def _sentence(section: str, words: str) -> str:
    return words if section == "path" else f"[{section}] {words}"


def table(certificate: Certificate) -> str:
    """Return the rows of a certificate under each other, then whether the path is flyable and why not; points in the frame it names."""
    rows = [(*HEADS[:-1], f"{HEADS[-1]}, {certificate.frame}")]
    for check in certificate.checks:
        places = [place for place in (check.place, check.second_place) if place is not None]
        first, *others = [_where(place) for place in places] or [("", "", "")]
        rows.append((check.name, SHOWN[check.verdict], _value(check), _limit(check), *first))
        rows += [("", "", "", "", *other) for other in others]
    widths = [max(len(row[k]) for row in rows) for k in range(len(HEADS))]
    lines = ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    asked = _speed(certificate, certificate.speed)
    head = f"{certificate.path}, {_number(certificate.length)} m, at {asked}"
    last = [f"flyable at {asked}"] if certificate.flyable else [f"not flyable at {asked}:", *certificate.reasons]
    return "\n".join([head, "", *lines, "", *last])


def chosen_target(out: str) -> Path:
    """Return the picture file or the folder that a user names, or raise `InputError` now if it could not be written later."""
    target = Path(out)
    if not _is_picture(target):
        return chosen_folder(out, [DATA, *(f"{PICTURE}.{kind}" for kind in PICTURES[:2])])
    return chosen_folder(str(target.parent), [target.name]) / target.name


def write(target: Path, certificate: Certificate, title: str, data: dict[str, Any]) -> list[Path]:
    """Write the picture as one file, or the picture and the data into a folder; return the files.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    from gammastar.figures.certificate import draw_certificate
    from gammastar.figures.save import FORMATS, save

    figure = draw_certificate(certificate, title)
    if _is_picture(target):
        return save(figure, target.with_suffix(""), (_kind(target),))
    with filled(target) as made:
        save(figure, made / PICTURE, FORMATS)
        (made / DATA).write_text(to_json(data), encoding="utf-8", newline="\n")
    return [target / DATA, *(target / f"{PICTURE}.{kind}" for kind in FORMATS)]


def _kind(target: Path) -> str:
    return target.suffix.lstrip(".")


def _is_picture(target: Path) -> bool:
    """Return whether a target is one file; an ending that looks like another kind of picture is refused."""
    if _kind(target).lower() in {"jpg", "jpeg", "gif", "webp", "bmp", "tif", "tiff", "eps", "ps"}:
        raise InputError(f"out must end in .png, .svg or .pdf, or be a folder (got {target}); choose one of these")
    return _kind(target) in PICTURES


def _where(place: Place) -> tuple[str, str, str]:
    return (
        _number(place.parameter),
        _number(place.arc_length),
        ", ".join(_number(round(each, 9) + 0.0) for each in place.point),
    )


def _value(check: Check) -> str:
    """Return the value with its unit and a word about it."""
    if check.verdict is Verdict.SKIPPED:
        return ""
    if check.value is None:
        return check.note or "none"
    text = f"{_number(check.value)} {check.unit}".strip() if math.isfinite(check.value) else "no bound"
    return f"{text} ({check.note})" if check.note else text


def _limit(check: Check) -> str:
    return "" if check.limit is None else f"{COMPARED.get(check.name, '<=')} {_number(check.limit)}"


def _speed(certificate: Certificate, speed: float) -> str:
    """Return a speed in the unit of progress, and in m/s if that is another."""
    low, high = (_number(each) for each in certificate.in_metres(speed))
    own = f"{_number(speed)} {certificate.progress.unit}"
    if certificate.progress.unit == "m/s":
        return own
    return f"{own} ({low if low == high else f'{low} to {high}'} m/s)"


def _number(value: float) -> str:
    return f"{value:.4g}"
