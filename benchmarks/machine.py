"""Print the machine and the versions that every figure of this folder depends on."""

from __future__ import annotations

import importlib.metadata
import os
import platform


def processor() -> str:
    """Return the processor's name, as far as the system tells it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()


def describe() -> str:
    """Return one line: processor, cores, system, Python and the numerical libraries."""
    versions = " ".join(f"{name} {importlib.metadata.version(name)}" for name in ("gammastar", "casadi", "numpy"))
    return f"{processor()}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}, {versions}"


if __name__ == "__main__":
    print(describe())
