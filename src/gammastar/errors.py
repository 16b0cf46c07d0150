"""Every error that gammastar raises: one base, and the fitting builtin beside it.

A message says what was expected, what came, and what to do.  Data needed to act on an error stay on it as attributes.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any


class GammastarError(Exception):
    """Base of every error of gammastar; catching it catches all of them and nothing else."""

    def __reduce__(self) -> Any:
        """Let an error cross to another process with its message and its attributes."""
        return _restored, (type(self), self.args, self.__dict__)


class InputError(GammastarError, ValueError):
    """A value from outside cannot be used: wrong sign, wrong range, not finite, or inconsistent with another."""


class ShapeError(InputError):
    """An array came with the wrong shape."""


class RotationError(InputError):
    """A matrix is not a rotation; `distance` holds its Frobenius distance to SO(3)."""

    def __init__(self, message: str, distance: float) -> None:
        super().__init__(message)
        self.distance = distance


class PoleError(InputError):
    """Desired closed-loop poles are unstable, not closed under conjugation, or too few or too many."""


class PathError(InputError):
    """A curve cannot serve as a path: it stands still, has no length, or its functions cannot be differentiated."""


class UnknownNameError(InputError, LookupError):
    """A name is not among the known ones; `known` lists them."""

    def __init__(self, what: str, name: object, known: Iterable[str]) -> None:
        self.name = str(name)
        self.known = sorted(known)
        remedy = suggestion(self.name, self.known) or "; choose one of them"
        super().__init__(f"{what} must be one of {', '.join(self.known)} (got {self.name!r}){remedy}")


class UnknownColumnError(UnknownNameError, KeyError):
    """A table has no column of a name, as a mapping has no key; `known` lists those it has."""

    __str__ = Exception.__str__  # KeyError would show its sentence in quotes


class MissionError(InputError):
    """A mission file or one of its keys cannot be used; `where` names the key, or is empty."""

    def __init__(self, message: str, where: str = "") -> None:
        super().__init__(message)
        self.where = where


class SingularStartError(InputError, ArithmeticError):
    """The law has no finite input at the start; `margins` holds the vanishing quantities by name."""

    def __init__(self, message: str, margins: dict[str, float]) -> None:
        super().__init__(message)
        self.margins = margins


class PredictionError(GammastarError, ArithmeticError):
    """The closed form has no position at some time, as beyond a focal point; `time` [s] is the first such time."""

    def __init__(self, message: str, time: float) -> None:
        super().__init__(message)
        self.time = time


class FlightError(GammastarError, ArithmeticError):
    """A flight ended early and the caller asked to be told; `record` holds the flight until then."""

    def __init__(self, message: str, record: Any) -> None:
        super().__init__(message)
        self.record = record


class MissingExtraError(GammastarError, ImportError):
    """An optional library is not installed; the message names the extra that brings it."""

    def __init__(self, library: str, extra: str, purpose: str) -> None:
        super().__init__(f"{purpose} needs {library} (not installed); run: pip install 'gammastar[{extra}]'")
        self.library = library
        self.extra = extra


class CompilerError(GammastarError, RuntimeError):
    """No C compiler answers, or it refuses what was generated; `log` is the file that holds its words."""

    def __init__(self, message: str, log: Any) -> None:
        super().__init__(message)
        self.log = log


class CampaignError(InputError):
    """A campaign's folder cannot be used: it holds something else, or cannot be written."""


class MachineWarning(UserWarning):
    """A slower machine flies than the one that was wished for; what comes out is as good."""


def _restored(kind: type[GammastarError], arguments: tuple[Any, ...], attributes: dict[str, Any]) -> GammastarError:
    error = kind.__new__(kind, *arguments)
    error.__dict__.update(attributes)
    return error


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return '; did you mean "x"?' when a known name is close to `name`, otherwise an empty string."""
    close = difflib.get_close_matches(name, list(known), n=1)
    return f'; did you mean "{close[0]}"?' if close else ""
