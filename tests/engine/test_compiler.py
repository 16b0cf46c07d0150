"""The compiler and what it has made: compiled once, kept, made again when broken, and one clear sentence when there is none."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

import gammastar
from engine import steps
from gammastar import engine
from gammastar.engine import compiler as module
from gammastar.errors import CompilerError

TWICE_AND_ONE = np.array([[3.0, 5.0, 7.0]])
PROGRAM = textwrap.dedent(
    """
    import casadi as ca
    import numpy as np
    from gammastar import engine
    state, number, nothing = ca.SX.sym("state"), ca.SX.sym("number"), ca.SX(0, 1)
    step = engine.Step(ca.Function("tiny", [state, nothing, number, nothing], [2.0 * state + 1, nothing]))
    print(engine.run(step, np.array([[1.0, 2.0, 3.0]]), 1, machine="native").tolist())
    """
)
posix = pytest.mark.skipif(os.name != "posix", reason="a shell script stands for the compiler")


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch) -> Path:
    """Return an empty cache folder, in use for this test; nothing is remembered from earlier ones."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    forget()
    yield tmp_path / "cache" / "gammastar" / "native"
    forget()


def forget() -> None:
    """Forget what this process has found and loaded, as a new process would."""
    module._found.cache_clear()
    module.library.cache_clear()


def flown() -> np.ndarray:
    return engine.run(steps.tiny(2.0), np.array([[1.0, 2.0, 3.0]]), 1, machine="native")


def compiler_that(tmp_path: Path, does: str) -> str:
    """Return the path of a compiler that answers as the real one does, but does something else when it is to compile."""
    script = tmp_path / "cc"
    real = " ".join(module.compiler().command)
    script.write_text(f'#!/bin/sh\ncase "$*" in *-shared*"-o"*) {does};; esac\nexec {real} "$@"\n')
    script.chmod(0o755)
    forget()
    return str(script)


def started(environment: dict[str, str], program: str = PROGRAM) -> subprocess.Popen:
    """Start another process that runs the same step."""
    source = str(Path(gammastar.__file__).parents[1])
    command = [sys.executable, "-c", program]
    environment = os.environ | environment | {"PYTHONPATH": source}
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)


@steps.needs_compiler
def test_a_step_is_compiled_once(cache: Path, monkeypatch) -> None:
    assert np.array_equal(flown(), TWICE_AND_ONE)
    assert [each.suffix for each in cache.iterdir()] == [".so"]
    forget()
    monkeypatch.setattr(module, "_compiled", None)
    assert np.array_equal(flown(), TWICE_AND_ONE)


@steps.needs_compiler
@pytest.mark.parametrize("damage", ["cut", "empty", "changed", "removed"])
def test_a_broken_entry_is_made_again(damage: str, cache: Path) -> None:
    flown()
    (kept,) = cache.iterdir()
    content = kept.read_bytes()
    kept.unlink()  # a new file: the old one is still loaded here
    broken = {"cut": content[:5000], "empty": b"", "changed": content.replace(b"\x7fELF", b"FLE\x7f")}
    if damage != "removed":
        kept.write_bytes(broken[damage])
    forget()
    assert np.array_equal(flown(), TWICE_AND_ONE)
    assert [each.read_bytes() == content for each in cache.iterdir()] == [True]


@steps.needs_compiler
def test_a_cache_that_cannot_be_written_is_done_without(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert np.array_equal(flown(), TWICE_AND_ONE)
    assert (tmp_path / "file").read_text() == "no folder"


@steps.needs_compiler
def test_a_cache_that_can_only_be_read_is_read(cache: Path, monkeypatch) -> None:
    """What lies there is used; what is new lies in a temporary folder."""

    def refused(*place: object, **more: object) -> None:
        raise PermissionError("read-only file system")

    def in_another(dir: Path) -> tuple[int, str]:
        return refused() if dir == cache else real(dir=dir)

    flown()
    kept, real = list(cache.iterdir()), module.tempfile.mkstemp
    forget()
    monkeypatch.setattr(module.os, "utime", refused)
    monkeypatch.setattr(module.tempfile, "mkstemp", in_another)
    with monkeypatch.context() as while_kept:
        while_kept.setattr(module, "_compiled", None)
        assert np.array_equal(flown(), TWICE_AND_ONE)
    assert engine.run(steps.tiny(4.0), [[1.0]], 1, machine="native").tolist() == [[5.0]]
    assert list(cache.iterdir()) == kept


@steps.needs_compiler
def test_a_cache_that_is_removed_meanwhile_is_done_without(cache: Path, monkeypatch) -> None:
    real = module.os.replace

    def removed(draft: str, place: Path) -> None:
        if place.parent == cache:
            shutil.rmtree(cache)
        real(draft, place)

    monkeypatch.setattr(module.os, "replace", removed)
    assert np.array_equal(flown(), TWICE_AND_ONE)


@steps.needs_compiler
def test_a_cache_whose_programs_may_not_run_is_done_without(cache: Path, monkeypatch) -> None:
    """As in a home that is mounted so; where the temporary folder is mounted so too, one sentence tells."""
    real, everywhere = module.ctypes.CDLL, False

    def refused(place: str) -> object:
        if everywhere or Path(place).parent == cache:
            raise OSError("failed to map segment from shared object")
        return real(place)

    monkeypatch.setattr(module.ctypes, "CDLL", refused)
    assert np.array_equal(flown(), TWICE_AND_ONE)
    everywhere = True
    forget()
    with pytest.raises(CompilerError, match=r"must be loaded \(got failed to map .*\); set TMPDIR"):
        flown()


@steps.needs_compiler
def test_what_was_used_longest_ago_is_removed(cache: Path, monkeypatch) -> None:
    """Files used since then stay; the folder does not grow without bound."""
    flown()
    (used,) = cache.iterdir()
    old = [cache / f"{k}.so" for k in range(4)]
    for k, path in enumerate(old):
        path.write_text("old")
        os.utime(path, (1000 + k, 1000 + k))
    os.utime(used, (500, 500))
    forget()
    flown()
    monkeypatch.setattr(module, "MOST_KEPT", 4)
    engine.run(steps.tiny(3.0), np.ones((1, 1)), 1, machine="native")
    left = set(cache.iterdir())
    assert len(left) == 4
    assert left > {used, *old[2:]}


@steps.needs_compiler
def test_a_user_without_a_home_is_served(monkeypatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(module.Path, "home", homeless)
    assert np.array_equal(flown(), TWICE_AND_ONE)


@pytest.mark.parametrize(
    ("platform", "folder"),
    [("linux", ".cache"), ("darwin", "Library/Caches"), ("win32", "AppData/Local")],
)
def test_the_cache_lies_where_the_system_wants_it(platform: str, folder: str, tmp_path: Path, monkeypatch) -> None:
    """And a relative XDG_CACHE_HOME is passed over, as its rules ask."""
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    monkeypatch.setattr(module.Path, "home", lambda: tmp_path)
    monkeypatch.setattr(module.sys, "platform", platform)
    assert module.cache_folder() == tmp_path / folder / "gammastar" / "native"


@steps.needs_compiler
def test_another_compiler_or_machine_has_libraries_of_its_own() -> None:
    found = module.compiler()
    other = module.Compiler(found.command, found.flags, found.macros + "#define __AVX1024F__ 1\n")
    assert found.key("source") != other.key("source")
    assert found.key("source") != found.key("other source")


@pytest.mark.parametrize(("macro", "lanes"), [*module.LANES.items(), ("__riscv", 1)])
def test_lanes_are_as_many_as_a_register_holds(macro: str, lanes: int) -> None:
    assert module.Compiler(("cc",), (), f"#define __STDC__ 1\n#define {macro} 1\n").lanes == lanes


@steps.needs_compiler
def test_two_processes_may_compile_at_once(cache: Path) -> None:
    both = [started({}) for _ in range(2)]
    assert [each.communicate(timeout=60)[0] for each in both] == [b"[[3.0, 5.0, 7.0]]\n"] * 2
    assert [each.suffix for each in cache.iterdir()] == [".so"]


@posix
@steps.needs_compiler
def test_a_process_that_is_killed_while_it_compiles_leaves_nothing_behind_that_matters(
    cache: Path, tmp_path: Path, monkeypatch
) -> None:
    waiting = tmp_path / "waiting"
    command = compiler_that(tmp_path, f"touch {waiting}; exec sleep 20")
    killed = started({"CC": command, "TMPDIR": str(tmp_path)})
    for _ in range(600):
        if waiting.exists():
            break
        time.sleep(0.05)
    assert waiting.exists()
    killed.send_signal(signal.SIGKILL)
    killed.communicate(timeout=60)
    compiler_that(tmp_path, ":")
    monkeypatch.setenv("CC", command)
    forget()
    assert np.array_equal(flown(), TWICE_AND_ONE)
    assert [each.suffix for each in cache.iterdir()] == [".so"]


@pytest.mark.parametrize("command", ["no-such-compiler -O2", "echo", "'", sys.executable])
def test_nonsense_in_cc_is_one_sentence(command: str, monkeypatch) -> None:
    monkeypatch.setenv("CC", command)
    with pytest.raises(CompilerError, match=r"must be there \(got CC=.*; install gcc or clang, or set CC$") as caught:
        flown()
    assert "-dM" in Path(caught.value.log).read_text()
    assert str(caught.value.log) in str(caught.value)


@steps.needs_compiler
def test_a_compiler_that_takes_all_numbers_for_finite_is_refused(monkeypatch) -> None:
    monkeypatch.setenv("CC", " ".join([*module.compiler().command, "-ffast-math"]))
    with pytest.raises(CompilerError, match=r"must keep NaN .*; leave -ffast-math out"):
        flown()


@posix
@steps.needs_compiler
def test_what_is_no_text_is_kept_too(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("CC", compiler_that(tmp_path, "printf 'no \\377' >&2; exit 1"))
    with pytest.raises(CompilerError, match="exit code 1") as caught:
        flown()
    assert "no \\xff" in Path(caught.value.log).read_text()


@posix
@steps.needs_compiler
def test_a_compiler_that_vanishes_is_one_sentence(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("CC", compiler_that(tmp_path, ":"))
    module.compiler()
    (tmp_path / "cc").unlink()
    with pytest.raises(CompilerError, match=r"must be there \(got .*No such file.*\); set CC"):
        flown()


@steps.needs_compiler
def test_a_full_disk_is_one_sentence_and_leaves_no_drafts(cache: Path, monkeypatch) -> None:
    def full(draft: str, place: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module.os, "replace", full)
    with pytest.raises(CompilerError, match=r"No space left on device\); .* TMPDIR to a folder with room"):
        flown()
    assert list(cache.iterdir()) == []


def test_no_compiler_is_one_sentence(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(CompilerError, match="none of gcc, clang, cc on PATH"):
        flown()


@posix
@steps.needs_compiler
def test_what_a_compiler_says_against_a_step_is_kept(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("CC", compiler_that(tmp_path, "echo the disk is full >&2; exit 3"))
    with pytest.raises(CompilerError, match=r"must compile the step \(got exit code 3; see .*\.log\)") as caught:
        flown()
    assert "the disk is full" in Path(caught.value.log).read_text()
    assert "void core" in Path(caught.value.log).with_suffix(".c").read_text()


@posix
@steps.needs_compiler
def test_an_interrupt_is_heard_within_a_second(tmp_path: Path) -> None:
    """Of a run that would take a minute: the main thread waits, and tells the others."""
    ready = tmp_path / "ready"
    told = f", 10**8, progress=lambda done: done and open({str(ready)!r}, 'w').close(),"
    program = PROGRAM.replace("np.array([[1.0, 2.0, 3.0]])", "np.ones((1, 4096))").replace(", 1,", told)
    running = started({}, program)
    for _ in range(600):
        if ready.exists():
            break
        time.sleep(0.05)
    running.send_signal(signal.SIGINT)
    begin = time.perf_counter()
    running.communicate(timeout=60)
    assert time.perf_counter() - begin < 1
    assert running.returncode != 0


@posix
@steps.needs_compiler
def test_words_in_cc_are_its_options(monkeypatch) -> None:
    real = module.compiler().command
    monkeypatch.setenv("CC", " ".join([*real, "-DTHIRD=3"]))
    assert np.array_equal(flown(), TWICE_AND_ONE)
    assert module.compiler().command == (*real, "-DTHIRD=3")
