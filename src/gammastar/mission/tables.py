"""The nested values of a mission: made plain, changed by dotted keys, and written as TOML."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import tomli_w

from gammastar.errors import MissionError
from gammastar.mission.complaint import shown

DEEPEST = 20  # tables and lists within each other
LONGEST_LINE = 120  # characters of a list of rows


def written(values: Mapping[str, Any]) -> str:
    """Return plain values as TOML, with lists on one line or a row on a line."""
    return re.sub(r"(?<== )\[$.*?^\]$", _shorter, tomli_w.dumps(values), flags=re.DOTALL | re.MULTILINE)


def put(values: dict[str, Any], key: str, value: Any) -> None:
    """Set one value of nested dictionaries by its dotted key, numbers from 0 in lists of tables; missing sections are made."""
    *sections, name = key.split(".")
    table: Any = values
    for depth, section in enumerate(sections):
        in_list = isinstance(table, list)
        table = table[int(section)] if in_list else table.setdefault(section, {})
        below = sections[depth + 1] if depth + 1 < len(sections) else None
        is_list_of_tables = isinstance(table, list) and below in {str(k) for k in range(len(table))}
        if not isinstance(table, dict) and not is_list_of_tables:
            whole = ".".join(sections[: depth + 1])
            raise MissionError(f"{key} must lie in a table (got {whole} = {shown(table)}); set {whole} as a whole", key)
    table[name] = value


def plain(value: Any, depth: int = DEEPEST) -> Any:
    """Return nested values as dictionaries, lists and scalars; arrays of NumPy become lists."""
    if depth < 0:
        raise MissionError(f"a mission must be nested at most {DEEPEST} deep (got more); no section needs that")
    if isinstance(value, Mapping):
        return {str(key): plain(item, depth - 1) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item, depth - 1) for item in value]
    return plain(value.tolist(), depth - 1) if hasattr(value, "tolist") else value


def present(value: Any) -> Any:
    """Return nested values, plain, without those that are None, for which TOML has no form."""
    if isinstance(value, dict):
        return {key: present(item) for key, item in value.items() if item is not None}
    return [present(item) for item in value] if isinstance(value, list) else value


def _shorter(array: re.Match[str]) -> str:
    """Return a TOML array on one line, or on one line a row when there are many; no text in it holds the end of a line."""
    text = re.sub(r"\[\n *", "[", array[0])
    text = re.sub(r",\n *(?=\])", "", text)
    text = re.sub(r",\n *", ", ", text)
    if len(text) <= LONGEST_LINE or not text.startswith("[["):
        return text
    return "[\n    " + text[1:-1].replace("], [", "],\n    [") + ",\n]"
