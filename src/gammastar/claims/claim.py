"""What a claim is, what checking it yields, and how a list of claims is checked.

A claim is one numbered equation, lemma, objective or remark of the paper together with a check that can fail.  The check
either returns a finding or raises; whatever it raises becomes the verdict `failed`, with its message.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, TypeVar

from gammastar.errors import GammastarError, MissingExtraError

Form = TypeVar("Form")


class Verdict(StrEnum):
    """What became of a claim."""

    HOLDS = "holds"
    DEFINITION = "definition"  # nothing to prove, but what the paper builds on it was checked
    MISPRINT = "misprint"  # the printed form fails, the corrected one passes the same test
    FALSE = "false"  # the statement itself is wrong; a counterexample and a replacement were checked
    FAILED = "failed"  # the check disagreed or broke; the command that runs the claims fails


class Method(StrEnum):
    """How a claim was checked, strongest first."""

    SYMBOLIC = "symbolic"  # an identity between expressions, for all values
    EXACT = "exact rational"  # rational arithmetic at chosen or random states, no rounding
    NUMERIC = "numeric"  # floating point at random states or along flights
    NONE = "none"  # the check did not get that far


class DisagreementError(GammastarError, AssertionError):
    """A check found something else than it was sent to confirm."""


@dataclass(frozen=True)
class Finding:
    """What a check found, before it knows which claim it belongs to."""

    verdict: Verdict
    method: Method
    evidence: str  # one sentence with its number
    correction: str = ""  # what to read instead, for a misprint or a false statement
    residual: float = 0.0  # error left in the form that is right; zero when exact
    printed_residual: float | None = None  # error of the printed form in the same test, for a misprint


@dataclass(frozen=True)
class Claim:
    """One statement of the paper and the check that can refute it."""

    key: str  # "(18)", "Lemma 4", "G1", or a word for a remark
    where: str  # section of the paper
    statement: str  # as printed, in one line
    check: Callable[[], Finding]


@dataclass(frozen=True)
class Result:
    """A claim with its verdict; plain data."""

    key: str
    where: str
    statement: str
    verdict: Verdict
    method: Method
    evidence: str
    correction: str = ""
    residual: float = 0.0
    printed_residual: float | None = None

    @property
    def passed(self) -> bool:
        """Return whether the check did what it set out to do; a settled misprint has passed."""
        return self.verdict is not Verdict.FAILED

    def as_dict(self) -> dict[str, Any]:
        """Return the result as plain types that JSON can hold."""
        return {name: str(value) if isinstance(value, StrEnum) else value for name, value in asdict(self).items()}


def check(claims: Iterable[Claim], progress: Callable[[Result], None] | None = None) -> list[Result]:
    """Check every claim in turn and return one result each, in the same order.

    A check that raises, whatever it raises, gives `Verdict.FAILED` and keeps its message.

    Args:
        claims: What to check, usually `all_claims()`.
        progress: Called with each result as soon as it is known.

    Raises:
        MissingExtraError: SymPy is not installed; then nothing was checked, which is no verdict on the paper.
    """
    results = []
    for claim in claims:
        result = _check_one(claim)
        if progress is not None:
            progress(result)
        results.append(result)
    return results


def _check_one(claim: Claim) -> Result:
    """Return the result of one claim; only a missing library passes through."""
    try:
        finding = claim.check()
        _require_complete(finding)
    except MissingExtraError:
        raise
    except Exception as error:
        finding = Finding(Verdict.FAILED, Method.NONE, f"{type(error).__name__}: {error}")
    return Result(claim.key, claim.where, claim.statement, **vars(finding))


def _require_complete(finding: Finding) -> None:
    """Raise unless a departure from print says what to read instead and every number is finite."""
    departs = finding.verdict in {Verdict.MISPRINT, Verdict.FALSE}
    require(
        bool(finding.correction) == departs,
        "a correction belongs to a misprint or a false statement, and to those only",
    )
    require(
        (finding.printed_residual is not None) == (finding.verdict is Verdict.MISPRINT),
        "a misprint, and nothing else, carries the error of its printed form",
    )
    numbers = [finding.residual, finding.printed_residual or 0.0]
    require(all(math.isfinite(value) for value in numbers), f"a residual is not finite: {numbers}")


def require(truth: Any, message: str) -> None:
    """Raise `DisagreementError` with the message unless the truth is true; unlike `assert` it is never compiled away."""
    if not bool(truth):
        raise DisagreementError(message)


def misprint(
    error_of: Callable[[Form], Any],
    printed: Form,
    corrected: Form,
    *,
    method: Method,
    evidence: str,
    correction: str,
    tolerance: float = 0.0,
) -> Finding:
    """Judge the printed and the corrected form by one and the same test and return the finding.

    Args:
        error_of: The test: the size of the disagreement of a form with an independent derivation; zero when it is right.
        printed: The form as printed; its error must exceed 1000 tolerances, and not be zero.
        corrected: The form of the correction; its error must stay within the tolerance.
        method: How the test computes.
        evidence: One sentence; `{printed}` and `{corrected}` in it stand for the two errors.
        correction: What to read instead.
        tolerance: Rounding allowed in the test, zero for exact arithmetic.

    Raises:
        DisagreementError: The printed form passes, or the corrected one does not.
    """
    wrong, right = float(error_of(printed)), float(error_of(corrected))
    require(wrong > 1000 * tolerance, f"the printed form passes its test with error {wrong:.3g}; it is no misprint")
    require(right <= tolerance, f"the corrected form has error {right:.3g}, above {tolerance:.3g}")
    sentence = evidence.format(printed=f"{wrong:.4g}", corrected=f"{right:.2g}")
    return Finding(Verdict.MISPRINT, method, sentence, correction, right, wrong)
