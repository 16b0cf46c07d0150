"""From a callable of the user to graphs: scalars come out, or one sentence; the user's own errors pass unchanged."""

from __future__ import annotations

import re
import traceback
from collections.abc import Callable, Iterable
from typing import Any

import casadi as ca

from gammastar.errors import PathError


def called(formula: Callable[..., Any], symbols: Iterable[Any], name: str) -> Any:
    """Return what a formula makes of symbols.

    Raises:
        PathError: The formula does something with a symbol that CasADi cannot, such as asking whether it is positive.
            Every other error in the formula is its author's, and passes.
    """
    try:
        return formula(*symbols)
    except Exception as error:
        if not _is_from_casadi(error):
            raise
        raise PathError(
            f"the formula of {name} must work on CasADi symbols (got {_first_sentence(error)}); "
            "use casadi functions and casadi.if_else, not math, numpy or if"
        ) from error


def scalars(values: Iterable[Any], name: str) -> list[Any]:
    """Graph: return values as SX (1, 1) each.

    Raises:
        PathError: One of them is no number, or more than one.
    """
    result = []
    for value in values:
        try:
            entry = ca.SX(value)
        except (NotImplementedError, TypeError) as error:
            raise PathError(
                f"the formula of {name} must return CasADi scalars (got {type(value).__name__}); "
                "return numbers and expressions of its symbols"
            ) from error
        if entry.shape != (1, 1):
            rows, columns = entry.shape
            raise PathError(
                f"the formula of {name} must return scalars (got one of {rows} by {columns}); return one number each"
            )
        result.append(entry)
    return result


def _is_from_casadi(error: Exception) -> bool:
    """Return whether an error was raised inside CasADi, not in the code that called it."""
    frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
    return bool(frames) and str(frames[-1].f_globals.get("__name__", "")).split(".")[0] == "casadi"


def _first_sentence(error: Exception) -> str:
    """Return what CasADi complains of, without the place in its source and without its list of prototypes."""
    text = re.sub(r'^\S+\.cpp:\d+: (Assertion ".*" failed:\n)?', "", str(error))
    return text.strip().split("\n")[0].rstrip(".") or type(error).__name__
