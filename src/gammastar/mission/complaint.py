"""Complaints about a mission: what a validator found wrong becomes one sentence that says where, what came and what to do."""

from __future__ import annotations

import datetime
import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from pydantic import ValidationError

from gammastar.errors import GammastarError, InputError, MissionError, suggestion

LONGEST_SHOWN = 60  # characters of a refused value


class SectionError(InputError):
    """A section as a whole cannot be used; the sentence goes on after the section's name."""


class UnknownKeyError(InputError):
    """A key is not among those of its section."""

    def __init__(self, name: object, known: Iterable[str]) -> None:
        self.name, self.known = str(name), sorted(known)
        super().__init__(self.name)

    def sentence(self, section: str) -> str:
        """Return the complaint, with the nearest known key or with all of them."""
        where = f" in {section}" if section else ""
        hint = suggestion(self.name, self.known) or f"; known are {', '.join(self.known)}"
        return f"unknown key {shown(self.name)}{where}{hint}"


def complaint(error: ValidationError) -> MissionError:
    """Return the first of pydantic's findings as one sentence, and how many more there are."""
    findings = error.errors(include_url=False, include_input=False)
    message, where = _sentence(findings[0])
    more = len(findings) - 1
    return MissionError(f"{message} (and {more} more to correct)" if more else message, where)


@contextmanager
def within(place: str) -> Iterator[None]:
    """Put a place, such as '[vehicle]', before the message of any error of ours raised inside; its class and data stay."""
    try:
        yield
    except GammastarError as error:
        if not (place.startswith("[") and str(error).startswith("[")):  # one section is enough, the one it came from
            error.args = (f"{place} {error}", *error.args[1:])
        raise


def shown(value: Any) -> str:
    """Return a refused value as TOML writes it, cut when it is long; what TOML has no form for is named by its type."""
    text = _written(value)
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}..."


def _written(value: Any) -> str:
    if isinstance(value, str):
        head = value[: LONGEST_SHOWN + 1]
        return json.dumps(head, ensure_ascii=not head.isprintable())
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value) if abs(value) < 10**LONGEST_SHOWN else "a whole number of more than 60 digits"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_written(item) for item in value[:LONGEST_SHOWN])}]"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key} = {_written(item)}' for key, item in list(value.items())[:LONGEST_SHOWN])}}}"
    if isinstance(value, (float, datetime.date, datetime.time)):
        return str(value)
    return f"a {type(value).__name__}"


def _sentence(finding: Any) -> tuple[str, str]:
    """Return the sentence of one finding and the dotted key it is about."""
    keys = [str(key) for key in finding["loc"]]
    cause = (finding.get("ctx") or {}).get("error")
    if isinstance(cause, UnknownKeyError):
        return cause.sentence(_section(keys)), ".".join([*keys, cause.name])
    if isinstance(cause, SectionError):
        return f"{_section(keys) or 'a mission'} {cause}", ".".join(keys)
    section = _section(keys[:-1])
    if finding["type"] == "missing" and not section:
        return f"a mission must have the section [{keys[-1]}] (got none); add it", keys[-1]
    text = f'must have the key "{keys[-1]}" (got none); add it' if finding["type"] == "missing" else str(cause)
    return f"{section} {text}".strip(), ".".join(keys)


def _section(keys: list[str]) -> str:
    return f"[{'.'.join(keys)}]" if keys else ""
