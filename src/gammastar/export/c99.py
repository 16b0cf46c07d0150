"""The C99 of a program: its header, its source, and its tables if it has any."""

from __future__ import annotations

import importlib.resources
import math
import re

from gammastar.engine.c_source import c_file
from gammastar.export.airframe import airframe
from gammastar.export.graphs import TOLD
from gammastar.export.program import COUNTS, NEWTON_STEPS, Program
from gammastar.export.tables import declared, literal, readers
from gammastar.path import ParametricPath

PLACEHOLDER = re.compile(r"^@(\w+)@(\n)|@(\w+)@", re.MULTILINE)

SEARCHED = """
/* The parameter of the point nearest to the vehicle: the nearest of some points of the path, and Newton steps from there on. */
static real start_parameter(const real *measured) {{
    uint32_t best = 0;
    real least = LARGEST;
    for (uint32_t k = 0; k < {count}; k++) {{
        real distance = 0;
        for (uint32_t i = 0; i < 3; i++) {{
            const real error = measured[i] - {name}_samples[k][i];
            distance += error * error;
        }}
        if (distance < least) {{
            least = distance;
            best = k;
        }}
    }}
    const real middle = {first} + {step} * (real)best;
    real parameter = middle;
    for (uint32_t k = 0; k < {newton}; k++) {{
{nearer}
{clamped}
    }}
    return {turned};
}}
"""
CLAMPED = """        if ({low}parameter < middle - {step}) parameter = middle - {step};
        if ({high}parameter > middle + {step}) parameter = middle + {step};"""
TOLD_BY_COORDINATE = """
/* The parameter of the point nearest to the vehicle: the coordinate of the path is a function of position. */
static real start_parameter(const real *measured) {{
    const real near = {near};
    real parameter;
    nearer(measured, &near, NULL, &parameter);
    return {turned};
}}
"""
WRAPPED = """    /* Whole periods are counted apart, so that the parameter keeps its digits however long the flight is. */
    if (next[0] >= {high} || next[0] < {low}) {{
        const real turns = {floor}((next[0] - {low}) / {period});
        const int32_t whole = turns > {most} ? {limit} : turns < -{most} ? -{limit} : (int32_t)turns;
        next[0] -= turns * {period};
        if (whole > 0 ? state->laps <= INT32_MAX - whole : state->laps >= INT32_MIN - whole) state->laps += whole;
    }}"""
MOST_TURNS = 10**6  # counted in one control interval, after a measurement from far away
AXES = {
    "ned": "World axes: third one down, such as north, east, down; body axes: forward, right, down.",
    "enu": "World axes: third one up, such as east, north, up; body axes: forward, left, up.",
}


def filled(text: str, values: dict[str, str]) -> str:
    """Return a template with its @placeholders@ filled; what is left of a line that held nothing but an empty one goes too."""

    def value(found: re.Match[str]) -> str:
        text = values[found[1] or found[3]]
        return f"{text}{found[2] or ''}" if text else ""

    return PLACEHOLDER.sub(value, text)


def template(name: str) -> str:
    """Return the text of a file of `c/`."""
    return (importlib.resources.files("gammastar.export") / "c" / name).read_text(encoding="utf-8")


def sources(program: Program) -> dict[str, str]:
    """Return the C files of a program by their names."""
    values, name = placeholders(program), program.name
    files = {f"{name}.h": filled(template("program.h"), values), f"{name}.c": filled(template("program.c"), values)}
    if arrays := declared(program):
        head = f"/* Tables of {name}: constant numbers. */\n"
        body = "\n".join(f"{declaration} = {{\n{inside}\n}};\n" for declaration, inside in arrays.items())
        files[f"{name}_tables.c"] = f'{head}#include "{name}_tables.h"\n\n{body}'
        listed = "\n".join(f"extern {declaration};" for declaration in arrays)
        guard = f"{name.upper()}_TABLES_H"
        files[f"{name}_tables.h"] = (
            f'{head}#ifndef {guard}\n#define {guard}\n\n#include "{name}.h"\n\n{listed}\n\n#endif\n'
        )
    return files


def placeholders(program: Program) -> dict[str, str]:
    """Return what stands for the placeholders of all templates."""
    pilot, real, name = program.autopilot, program.real, program.name
    commands = program.command_names
    wrench = "thrust [N]" if pilot.law.interface == "rates" else "second derivative of the thrust [N/s^2]"
    inputs = "zero, body rates [rad/s]" if pilot.law.interface == "rates" else f"{wrench}, torque [N m]"
    reads = program.graphs.reads_reference
    looked_up = [f"    time = (real)state->interval * {literal(pilot.interval, real)};"]
    if program.schedule is not None:
        looked_up = ["    time = look_up_reference(state->interval, reference);"]
    elif reads:
        looked_up.append("    look_up_reference(state->memory[0], reference);")
    if program.path.lookups:
        looked_up.append("    look_up_path(state->memory[0], path_data);")
    arrays = [f"    real reference[{20}];"] * reads + [f"    real path_data[{program.graphs.data_size}];"] * bool(
        program.path.lookups
    )
    return {
        "NAME": name,
        "GUARD": name.upper(),
        "title": _comment(program.title),
        "version": program.version,
        "c_real": program.c_real,
        "real": real,
        "interval": f"(({name}_real){pilot.interval!r})",
        "seconds": f"{pilot.interval:.9g}",
        "rate": f"{1 / pilot.interval:.9g}",
        "axes": AXES[program.frame],
        "airframe": airframe(program),
        "memory": str(pilot.size),
        "memory_names": ", ".join(f"{key} {size}" if size > 1 else key for key, size in pilot.sizes.items() if size),
        "commands": str(len(commands)),
        "command_names": "speeds of the rotors [rad/s]" if "rotor" in commands[0] else ", ".join(commands),
        "input_names": inputs,
        "parameter": _range(program),
        "years": _duration(COUNTS * pilot.interval),
        "told": ", ".join(f"{key} {size}" if size > 1 else key for key, size in TOLD.items()),
        "told_size": str(sum(TOLD.values())),
        "largest": "FLT_MAX" if real == "float32" else "DBL_MAX",
        "include_tables": f'\n#include "{name}_tables.h"\n' if declared(program) else "",
        "functions": c_file(program.tapes, program.c_real, storage="static "),
        "lookups": readers(program),
        "start_parameter": _start_parameter(program),
        "declare_path_data": "\n".join(each for each in arrays if "path_data" in each),
        "path_data_at_parameter": "    look_up_path(parameter, path_data);" if program.path.lookups else "",
        "declare_data": "\n".join(arrays),
        "data": "\n".join(looked_up),
        "path_data": "path_data" if program.path.lookups else "NULL",
        "reference_data": "reference" if reads else "NULL",
        "wrap": _wrap(program),
    }


def _wrap(program: Program) -> str:
    if program.wraps is None:
        return ""
    low, period = program.path.domain[0], program.wraps
    texts = {
        "low": literal(low, program.real),
        "period": literal(period, program.real),
        "high": literal(low + period, program.real),
        "floor": "floorf" if program.real == "float32" else "floor",
        "most": literal(MOST_TURNS, program.real),
        "limit": str(MOST_TURNS),
    }
    return WRAPPED.format(**texts)


def _start_parameter(program: Program) -> str:
    """Return the C function that tells where on its path a flight starts."""
    real, path, near = program.real, program.path, program.parameter
    turned = "parameter"
    if path.period is not None:
        floor, period = "floorf" if real == "float32" else "floor", literal(path.period, real)
        if program.wraps is None:
            half, origin = literal(0.5, real), literal(near, real)
            turned = f"parameter - {period} * {floor}((parameter - {origin}) / {period} + {half})"
        else:
            turned = f"parameter - {period} * {floor}((parameter - {literal(path.domain[0], real)}) / {period})"
    samples = program.samples
    if samples is None:
        return TOLD_BY_COORDINATE.format(near=literal(near, real), turned=turned)
    assert isinstance(path, ParametricPath)
    data = "path_data" if path.lookups else "NULL"
    nearer = [f"        nearer(measured, &parameter, {data}, &moved);", "        parameter = moved;"]
    if path.lookups:
        nearer.insert(0, "        look_up_path(parameter, path_data);")
    arrays = [f"        real path_data[{program.graphs.data_size}];"] * bool(path.lookups)
    last = len(samples.points) - 1
    low, high = ("", "") if path.period is not None else ("best > 0 && ", f"best < {last} && ")
    return SEARCHED.format(
        count=len(samples.points),
        name=program.name,
        first=literal(samples.first, real),
        step=literal(samples.step, real),
        newton=NEWTON_STEPS,
        nearer="\n".join([*arrays, "        real moved;", *nearer]),
        clamped=CLAMPED.format(step=literal(samples.step, real), low=low, high=high),
        turned=turned,
    )


def _comment(text: str) -> str:
    """Return a text that can stand in a comment of C."""
    return text.replace("*/", "* /").replace("/*", "/ *").replace("\\", "/") or "a mission without a title"


def _range(program: Program) -> str:
    if program.wraps is None:
        return "counted from the start of the path"
    low, high = program.path.domain
    return f"from {low:.9g} up to {high:.9g}, but for what one call moves it"


def _duration(seconds: float) -> str:
    return f"{math.floor(seconds / 86400)} days"
