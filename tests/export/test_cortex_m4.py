"""The budget of an exported mission on a Cortex-M4F: what a control interval may take there."""

from __future__ import annotations

import functools
import importlib.util
import sys
from pathlib import Path
from typing import Any

import pytest

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "cortex_m4.py"


@functools.cache
def script() -> Any:
    """Return the benchmark as a module."""
    spec = importlib.util.spec_from_file_location("cortex_m4", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["cortex_m4"] = module
    spec.loader.exec_module(module)
    return module


def test_a_whole_mission_keeps_its_budget() -> None:
    """Waypoints, law, observer, rotors and modes in float32: 5,000 instructions a call, 1.5 kB of stack, 32 kB of flash."""
    if reason := script().missing():
        pytest.skip(reason)
    figures = script().measured(1.6)
    assert figures["calls"] == 800
    assert 0 < figures["waiting_calls"] < 800  # one call captures the target that waits, the dearest there may be
    assert 1000 < figures["mean_instructions"] <= figures["most_instructions"] <= 5000
    assert 100 < figures["stack_bytes"] <= 1536
    assert 10_000 < figures["flash_bytes"] <= 32 * 1024
    assert figures["double_functions"] == []
    assert figures["refused_calls"] == 0
    assert figures["largest_relative_error"] < 1e-3  # of float32, which observers enlarge a thousandfold


def test_missing_tools_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    assert "arm-none-eabi-gcc and qemu-system-arm must be there; run make arm-tools" in script().missing()
