"""What README and docs show is run: Python blocks, shell blocks, and the output printed below them; links and names exist."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import gammastar

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$", re.IGNORECASE)
ROUNDING = 1e-8  # below it a figure is rounding or integration error, whose size may differ between machines


def blocks(page: Path) -> list[tuple[str, str]]:
    """Return (language, text) of the fenced blocks of a page."""
    return [(match[1], match[2]) for match in BLOCK.finditer(page.read_text(encoding="utf-8"))]


def assert_same_output(shown: str, printed: str) -> None:
    """Compare word by word; numbers within 1 percent, figures below `ROUNDING` within a factor of 100."""
    shown_words, printed_words = shown.split(), printed.split()
    assert len(shown_words) == len(printed_words), f"shown:\n{shown}\nprinted:\n{printed}"
    for left, right in zip(shown_words, printed_words, strict=True):
        if NUMBER.match(left) and NUMBER.match(right):
            a, b = float(left), float(right)
            small = 0 < abs(a) < ROUNDING and 0 < abs(b) < ROUNDING
            assert 0.01 < a / b < 100 if small else a == pytest.approx(b, rel=1e-2), (left, right)
        else:
            assert left == right, f"shown:\n{shown}\nprinted:\n{printed}"


def test_the_comparison_can_fail() -> None:
    assert_same_output("error 1.0e-12 of 3", "error 4e-12 of 3.001")
    for other in ("error 1.0e-12 of 4", "fault 1.0e-12 of 3", "error 1.0e-12 of 3 more", "error 1e-5 of 3"):
        with pytest.raises(AssertionError):
            assert_same_output("error 1.0e-12 of 3", other)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_python_blocks_run_and_print_what_is_shown(page: Path) -> None:
    namespace: dict[str, object] = {}
    printed = None
    for language, text in blocks(page):
        if language == "python":
            output = io.StringIO()
            with contextlib.redirect_stdout(output):
                exec(compile(text, str(page), "exec"), namespace)
            printed = output.getvalue()
        elif language == "text" and printed is not None:
            assert_same_output(text, printed)
            printed = None


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_shell_blocks_run_and_print_what_is_shown(page: Path, tmp_path: Path) -> None:
    """Lines after '$ ' run; `make` verbs must exist; the lines between commands are the output, '...' leaves the rest out."""
    verbs = (ROOT / "Makefile").read_text(encoding="utf-8")
    for language, text in blocks(page):
        if language == "toml" and text.startswith("# ") and text.split("\n", 1)[0].endswith(".toml"):
            (tmp_path / text.split("\n", 1)[0].removeprefix("# ")).write_text(text, encoding="utf-8")
        if language != "console":
            continue
        for command, _, shown in (part.partition("\n") for part in re.split(r"^\$ ", text, flags=re.MULTILINE) if part):
            words = shlex.split(command)
            if words[0] == "make":
                assert all(re.search(rf"^{verb}:", verbs, re.MULTILINE) for verb in words[1:])
                continue
            if words[0] != "gammastar":
                continue
            result = subprocess.run(
                [sys.executable, "-m", "gammastar", *words[1:]],
                cwd=tmp_path,
                capture_output=True,
                text=True,
                check=False,
            )
            expected_failure = shown.startswith(("error:", "not flown"))
            assert (result.returncode == 0) != expected_failure, result.stderr
            output = result.stderr if expected_failure else result.stdout
            if shown.strip():
                shown, cut, _ = shown.partition("...\n")
                lines = output.splitlines()
                assert_same_output(shown, "\n".join(lines[: len(shown.splitlines())] if cut else lines))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#:]+?)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def test_the_equation_map_names_what_exists() -> None:
    """Every `gammastar.x.y` of the equation map resolves, every test file exists and every number (1)-(29) is there."""
    page = (ROOT / "docs" / "explanation" / "equations.md").read_text(encoding="utf-8")
    import importlib

    for name in set(re.findall(r"`(gammastar(?:\.\w+)+)`", page)):
        parts = name.split(".")
        for k in range(len(parts), 0, -1):
            try:
                target: object = importlib.import_module(".".join(parts[:k]))
            except ModuleNotFoundError:
                continue
            for part in parts[k:]:
                assert hasattr(target, part), name
                target = getattr(target, part)
            break
    for name in set(re.findall(r"`(tests/[\w/]+\.py)`", page)):
        assert (ROOT / name).exists(), name
    rows = set(re.findall(r"^\| \((\d+)\)", page, re.MULTILINE))
    assert rows == {str(k) for k in range(1, 30)}


def test_the_changelog_names_the_version() -> None:
    assert gammastar.__version__
    assert "## [Unreleased]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
