"""The paper, claim by claim: everything passes, everything numbered is there, and every misprint is one."""

import dataclasses
import importlib
import json
import subprocess
import sys
import time
from typing import Any

import pytest

from gammastar import claims
from gammastar.claims import Claim, DisagreementError, Result, Verdict, all_claims, check
from gammastar.claims import claim as machinery

LONGEST = 20.0  # [s] of processor time for the whole list
NUMBERED = [f"({number})" for number in range(1, 30)]
NAMED = [
    *("Proposition 1", "Assumption 1", "Remark 5"),
    *(f"Lemma {number}" for number in (2, 3, 4, 8, 9)),
    *(f"Corollary {number}" for number in (6, 7)),
    *("G1", "G2", "G3", "G4"),
]
MISPRINTS = {  # design, section 4, and what else turned up
    *("(1)", "(4)", "(11)", "(18)", "(21)", "(22)", "(24)", "(26)", "R(0) upright", "R(0) inverted"),
    *("(5)", "Gamma", "smoothness", "reference"),
}
FALSE = {"Lemma 8", "Lemma 9", "free rates", "singularity", "effort", "vehicle"}
DEFINITIONS = {"stacking", "(8)", "(9)", "(10)", "(12)", "(13)", "(14)", "(15)", "(17)", "(19)"}
CLAIMS = {each.key: each for each in all_claims()}


@pytest.fixture(scope="module")
def measured() -> tuple[dict[str, Result], float]:
    began = time.process_time()
    results = {result.key: result for result in check(all_claims())}
    return results, time.process_time() - began


@pytest.fixture(scope="module")
def results(measured: tuple[dict[str, Result], float]) -> dict[str, Result]:
    return measured[0]


def test_every_claim_passes(results: dict[str, Result]) -> None:
    assert [result for result in results.values() if not result.passed] == []


def test_the_list_is_checked_in_seconds(measured: tuple[dict[str, Result], float]) -> None:
    assert measured[1] < LONGEST


def test_keys_are_unique() -> None:
    assert len(CLAIMS) == len(all_claims())


def test_equations_come_in_the_order_of_the_paper() -> None:
    assert [each.key for each in all_claims() if each.key in NUMBERED] == NUMBERED


@pytest.mark.parametrize("key", NUMBERED + NAMED)
def test_everything_numbered_or_named_is_covered(key: str) -> None:
    assert key in CLAIMS


def test_verdicts(results: dict[str, Result]) -> None:
    expected = dict.fromkeys(CLAIMS, Verdict.HOLDS)
    expected |= dict.fromkeys(MISPRINTS, Verdict.MISPRINT) | dict.fromkeys(FALSE, Verdict.FALSE)
    expected |= dict.fromkeys(DEFINITIONS, Verdict.DEFINITION)
    assert {key: result.verdict for key, result in results.items()} == expected


def test_every_departure_from_print_says_what_to_read_instead(results: dict[str, Result]) -> None:
    for key in MISPRINTS | FALSE:
        assert len(results[key].correction) > 10
        assert results[key].evidence


def test_a_printed_form_is_wrong_by_far_more_than_the_corrected_one(results: dict[str, Result]) -> None:
    for key in MISPRINTS:
        printed = results[key].printed_residual
        assert printed is not None
        assert printed > 5e-5  # the attitudes printed to four digits; the others exceed 0.5
        assert results[key].residual <= 1e-14


def module_of(claim: Claim) -> Any:
    """Return the module in which a claim's check stands, also for a partial."""
    return importlib.import_module(getattr(claim.check, "func", claim.check).__module__)


@pytest.mark.parametrize("key", sorted(MISPRINTS))
def test_no_misprint_is_found_had_the_paper_printed_the_corrected_form(
    key: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def as_if_printed(error_of: Any, printed: Any, corrected: Any, **rest: Any) -> Any:
        return machinery.misprint(error_of, corrected, corrected, **rest)

    monkeypatch.setattr(module_of(CLAIMS[key]), "misprint", as_if_printed)
    with pytest.raises(DisagreementError, match="it is no misprint"):
        CLAIMS[key].check()


@pytest.mark.parametrize("key", sorted(MISPRINTS))
def test_a_correction_that_repeats_the_misprint_is_refused(key: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def uncorrected(error_of: Any, printed: Any, corrected: Any, **rest: Any) -> Any:
        return machinery.misprint(error_of, printed, printed, **rest)

    monkeypatch.setattr(module_of(CLAIMS[key]), "misprint", uncorrected)
    with pytest.raises(DisagreementError, match="the corrected form has error"):
        CLAIMS[key].check()


def test_results_are_json(results: dict[str, Result]) -> None:
    text = json.dumps([result.as_dict() for result in results.values()], allow_nan=False)
    assert len(json.loads(text)) == len(CLAIMS)


def test_evidence_is_one_filled_in_line(results: dict[str, Result]) -> None:
    for result in results.values():
        for text in (result.statement, result.evidence, result.correction):
            assert "\n" not in text
            assert "{printed" not in text
            assert "  " not in text


def test_claims_are_frozen() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        CLAIMS["(1)"].key = "(2)"  # type: ignore[misc]


def test_importing_the_claims_does_not_load_sympy() -> None:
    code = "import sys, gammastar.claims; assert 'sympy' not in sys.modules"
    subprocess.run(
        [sys.executable, "-c", code], check=True, cwd=str(importlib.import_module("gammastar").__path__[0]) + "/.."
    )


def test_without_sympy_the_missing_extra_is_named() -> None:
    code = (
        "import sys; sys.modules['sympy'] = None\n"
        "from gammastar.claims import all_claims, check\n"
        "from gammastar.errors import MissingExtraError\n"
        "try:\n    check(all_claims())\nexcept MissingExtraError as error:\n    print(error)\n"
    )
    where = str(importlib.import_module("gammastar").__path__[0]) + "/.."
    answer = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd=where)
    assert "gammastar[claims]" in answer.stdout


def test_public_names_are_sorted() -> None:
    assert claims.__all__ == sorted(claims.__all__)
