"""Tables as C: static numbers, and functions that look a row up by a bounded search."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gammastar.export.program import Program
from gammastar.lookup import Table

WIDEST = {"float32": 1e38, "float64": 1e300}  # what stands for endless
A_LINE = 8  # numbers

SOUGHT = """
/* The last of `count` growing numbers that is not beyond a value; the first one where all are. */
static uint32_t last_before(const real *begins, uint32_t count, real value) {
    uint32_t low = 0, high = count;
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        if (begins[middle] <= value) low = middle;
        else high = middle;
    }
    return low;
}
"""
COUNTED = """
/* The reference over time: its row in a control interval, and the time since that row's begin. */
static real look_up_reference(uint32_t now, real *row) {{
    uint32_t low = 0, high = {count};
    while (high - low > 1) {{
        const uint32_t middle = low + (high - low) / 2;
        if ({name}_reference_first[middle] <= now) low = middle;
        else high = middle;
    }}
    for (uint32_t k = 0; k < {width}; k++) row[k] = {name}_reference[low][k];
    const uint32_t begin = {name}_reference_begin[low];
    const real since = now >= begin ? (real)(now - begin) : -(real)(begin - now);
    return since * {interval} - {name}_reference_rest[low];
}}
"""


def literal(value: float, real: str) -> str:
    """Return a number as C."""
    value = float(np.clip(value, -WIDEST[real], WIDEST[real]))
    if real == "float32" and abs(value) < float(np.finfo(np.float32).tiny):
        value = 0.0
    text = repr(value + 0.0)
    return f"{text}f" if real == "float32" else text


def numbers(values: Iterable[float], real: str) -> str:
    """Return numbers as the inside of an initializer, some a line."""
    texts = [literal(value, real) for value in values]
    lines = [", ".join(texts[k : k + A_LINE]) for k in range(0, len(texts), A_LINE)]
    return ",\n    ".join(lines)


def whole_numbers(values: Iterable[int]) -> str:
    """Return unsigned numbers as the inside of an initializer."""
    return ", ".join(f"{value}u" for value in values)


def tables_of(program: Program) -> dict[str, Table]:
    """Return the tables that are looked up at the parameter of the path, by their names, those of the path in their order first."""
    found = {f"path_{k}": lookup.table for k, lookup in enumerate(program.path.lookups)}
    reference = program.autopilot.guidance.reference
    return found | (
        {"reference": reference.lookup.table} if reference.over_progress and program.graphs.reads_reference else {}
    )


def declared(program: Program) -> dict[str, str]:
    """Return the definitions of all constant arrays by their declarations; none where the mission has no tables."""
    name, real, type_ = program.name, program.real, f"const {program.name}_real"
    found = dict[str, str]()
    for key, table in tables_of(program).items():
        count, width = table.rows.shape
        found[f"{type_} {name}_{key}_begins[{count}]"] = f"    {numbers(table.begins, real)}"
        rows = ",\n".join(f"    {{{numbers(row, real)}}}" for row in table.rows)
        found[f"{type_} {name}_{key}[{count}][{width}]"] = rows
    if (schedule := program.schedule) is not None:
        count, width = schedule.rows.shape
        for key, values in (("first", schedule.first), ("begin", schedule.begin)):
            found[f"const uint32_t {name}_reference_{key}[{count}]"] = f"    {whole_numbers(values)}"
        found[f"{type_} {name}_reference_rest[{count}]"] = f"    {numbers(schedule.rest, real)}"
        rows = ",\n".join(f"    {{{numbers(row, real)}}}" for row in schedule.rows)
        found[f"{type_} {name}_reference[{count}][{width}]"] = rows
    if (samples := program.samples) is not None:
        rows = ",\n".join(f"    {{{numbers(row, real)}}}" for row in samples.points)
        found[f"{type_} {name}_samples[{len(samples.points)}][3]"] = rows
    return found


def readers(program: Program) -> str:
    """Return the functions that read the tables; the one of the path gathers the rows of all of its tables, one below the other."""
    tables, texts = tables_of(program), list[str]()
    if tables:
        texts.append(SOUGHT)
    texts += [_reader(program, key, table) for key, table in tables.items()]
    if program.path.lookups:
        texts.append(_path_reader(program))
    if (schedule := program.schedule) is not None:
        count, width = schedule.rows.shape
        interval = literal(program.autopilot.interval, program.real)
        texts.append(COUNTED.format(name=program.name, count=count, width=width, interval=interval))
    return "".join(texts)


def _reader(program: Program, key: str, table: Table) -> str:
    """Return the function that copies the row of one table at a value of its variable."""
    (count, width), array, real = table.rows.shape, f"{program.name}_{key}", program.real
    lines = [f"\nstatic void look_up_{key}(real value, real *row) {{"]
    if table.period is not None:
        begin, period = literal(table.begins[0], real), literal(table.period, real)
        lines.append(f"    const real turns = {_floor(real)}((value - {begin}) / {period});")
        lines.append(f"    value -= turns * {period};")
    lines.append(f"    const uint32_t held = last_before({array}_begins, {count}, value);")
    lines.append(f"    for (uint32_t k = 0; k < {width}; k++) row[k] = {array}[held][k];")
    if table.period is not None:
        shifted = [(k, literal(shift, real)) for k, shift in enumerate(table.shifts) if shift]
        lines += [f"    row[{k}] += turns * {shift};" for k, shift in shifted]
    return "\n".join([*lines, "}", ""])


def _path_reader(program: Program) -> str:
    lines, width = ["\nstatic void look_up_path(real parameter, real *data) {"], 0
    for k, lookup in enumerate(program.path.lookups):
        if f"variable_{k}" in program.variables:
            lines.append(f"    real at_{k};")
            lines.append(f"    variable_{k}(&parameter, data, &at_{k});")
        value = f"at_{k}" if f"variable_{k}" in program.variables else "parameter"
        lines.append(f"    look_up_path_{k}({value}, data{f' + {width}' if width else ''});")
        width += lookup.table.width
    return "\n".join([*lines, "}", ""])


def _floor(real: str) -> str:
    return "floorf" if real == "float32" else "floor"
