"""The machinery: what a check may do, and what becomes of it."""

import json
import math
from collections.abc import Callable

import pytest

from gammastar.claims import Claim, DisagreementError, Finding, Method, Verdict, check
from gammastar.claims.claim import misprint, require
from gammastar.errors import GammastarError, MissingExtraError


def claim(run: Callable[[], Finding]) -> Claim:
    return Claim("(0)", "nowhere", "0 = 1", run)


def raising(error: Exception) -> Callable[[], Finding]:
    def run() -> Finding:
        raise error

    return run


def sound() -> Finding:
    return Finding(Verdict.HOLDS, Method.SYMBOLIC, "it does")


@pytest.mark.parametrize(
    "error",
    [DisagreementError("off by 3"), ZeroDivisionError("by zero"), AssertionError("an assertion"), KeyError("a key")],
)
def test_whatever_a_check_raises_is_a_failure_that_keeps_its_message(error: Exception) -> None:
    (result,) = check([claim(raising(error))])
    assert result.verdict is Verdict.FAILED
    assert not result.passed
    assert result.evidence == f"{type(error).__name__}: {error}"


def test_a_failure_does_not_stop_the_list() -> None:
    results = check([claim(sound), claim(raising(ValueError("no"))), claim(sound)])
    assert [result.passed for result in results] == [True, False, True]


def test_a_missing_library_is_no_verdict() -> None:
    with pytest.raises(MissingExtraError):
        check([claim(raising(MissingExtraError("sympy", "claims", "checking the paper's claims")))])


def test_progress_sees_each_result_at_once() -> None:
    seen: list[str] = []

    def second() -> Finding:
        assert len(seen) == 1
        return sound()

    results = check([claim(sound), claim(second)], lambda result: seen.append(result.evidence))
    assert all(result.passed for result in results)
    assert seen == ["it does", "it does"]


@pytest.mark.parametrize(
    "finding",
    [
        Finding(Verdict.FALSE, Method.SYMBOLIC, "no replacement"),
        Finding(Verdict.MISPRINT, Method.SYMBOLIC, "no correction", printed_residual=1.0),
        Finding(Verdict.MISPRINT, Method.SYMBOLIC, "the printed form was not tested", "read this"),
        Finding(Verdict.HOLDS, Method.SYMBOLIC, "but", "read this"),
        Finding(Verdict.HOLDS, Method.NUMERIC, "not a number", residual=math.nan),
        Finding(Verdict.MISPRINT, Method.NUMERIC, "infinite", "read this", printed_residual=math.inf),
    ],
)
def test_an_incomplete_finding_is_a_failure(finding: Finding) -> None:
    (result,) = check([claim(lambda: finding)])
    assert result.verdict is Verdict.FAILED


def settle(printed: float, corrected: float, tolerance: float = 0.0) -> Finding:
    return misprint(
        abs,
        printed,
        corrected,
        method=Method.NUMERIC,
        evidence="off by {printed}, then {corrected}",
        correction="read this",
        tolerance=tolerance,
    )


def test_a_misprint_is_settled_by_one_test_for_both_forms() -> None:
    finding = settle(printed=-3.0, corrected=0.0)
    assert (finding.printed_residual, finding.residual) == (3.0, 0.0)
    assert finding.evidence == "off by 3, then 0"


@pytest.mark.parametrize(
    ("printed", "corrected", "tolerance"),
    [(0.0, 0.0, 0.0), (3.0, 1e-30, 0.0), (1e-9, 0.0, 1e-10), (math.nan, 0.0, 1e-9), (3.0, math.nan, 1e-9)],
)
def test_a_misprint_needs_a_wrong_printed_and_a_right_corrected_form(
    printed: float, corrected: float, tolerance: float
) -> None:
    with pytest.raises(DisagreementError):
        settle(printed, corrected, tolerance)


def test_require_raises_what_users_can_catch() -> None:
    with pytest.raises(GammastarError, match="two and two"):
        require(2 + 2 == 5, "two and two make four")


def test_a_result_is_plain_data() -> None:
    (result,) = check([claim(lambda: settle(3.0, 0.0))])
    assert json.loads(json.dumps(result.as_dict(), allow_nan=False)) == {
        "key": "(0)",
        "where": "nowhere",
        "statement": "0 = 1",
        "verdict": "misprint",
        "method": "numeric",
        "evidence": "off by 3, then 0",
        "correction": "read this",
        "residual": 0.0,
        "printed_residual": 3.0,
    }
