"""The machine's C compiler: which one answers, for which instructions it writes, and the libraries it has made, kept for later runs."""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import functools
import hashlib
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from gammastar.errors import CompilerError

KNOWN = ("gcc", "clang", "cc")
TARGETS = (("-march=native",), ("-mcpu=native",), ())  # how a compiler is asked for this machine's instructions
# Every operation is rounded by itself, as CasADi's machine does, and NaN stays NaN: nothing here changes a value.
FLAGS = ("-O2", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fPIC", "-shared", "-fvisibility=hidden")
WIDE = ("-mprefer-vector-width=512",)  # with AVX-512, of which compilers use half a register by themselves
# Instructions are ordered before registers are given out: a quarter faster.  What branches share is not looked for: there are none.
GCC = ("-fschedule-insns", "-fsched-pressure", "-fno-tree-pre")  # clang has no such flags
MOST_KEPT = 200  # files in the cache; the one used longest ago goes first
FINITE = "#define __FINITE_MATH_ONLY__ 1"  # among the macros of a compiler that lets NaN pass unseen
LANES = {"__AVX512F__": 8, "__AVX__": 4, "__SSE2__": 2, "__ARM_NEON": 2}  # doubles in a vector register; 1 without any


@dataclass(frozen=True)
class Compiler:
    """A C compiler that has answered."""

    command: tuple[str, ...]
    flags: tuple[str, ...]
    macros: str  # that it defines: its version and the instructions it writes

    @property
    def lanes(self) -> int:
        """Return how many doubles a vector register holds."""
        defined = {line.split()[1] for line in self.macros.splitlines() if line.startswith("#define ")}
        return next((count for macro, count in LANES.items() if macro in defined), 1)

    def key(self, source: str) -> str:
        """Return what names the library of a source: everything that its content depends on."""
        return hashlib.sha256("\n".join([*self.command, *self.flags, self.macros, source]).encode()).hexdigest()[:32]


def compiler() -> Compiler:
    """Return the compiler that `CC` names, or the first one of gcc, clang and cc that answers.

    Raises:
        CompilerError: None does.
    """
    with _told():
        return _found(os.environ.get("CC", "").strip(), os.environ.get("PATH", ""))


@contextlib.contextmanager
def _told() -> Iterator[None]:
    """Say in a sentence that a file could not be used, wherever the system says so."""
    try:
        yield
    except OSError as error:
        raise CompilerError(
            f"a compiler and a temporary folder must be there (got {error}); set CC to gcc or clang, and TMPDIR to a folder with room",
            None,
        ) from error


@functools.cache
def _found(wanted: str, path: str) -> Compiler:
    log = list[str]()
    for command in [_words(wanted)] if wanted else [[name] for name in KNOWN if shutil.which(name, path=path)]:
        for target in TARGETS:
            asked = [*command, *target, "-dM", "-E", "-x", "c", os.devnull]
            try:
                answer = _answer(asked)
            except OSError as error:
                log.append(f"{shlex.join(asked)}\n{error}")
                continue
            if FINITE in answer.stdout:
                raise CompilerError(
                    f"a C compiler must keep NaN (got {shlex.join(command)}, which takes every number for finite); leave -ffast-math out",
                    None,
                )
            if answer.returncode == 0 and "#define __STDC__" in answer.stdout:
                more = WIDE * ("__AVX512F__" in answer.stdout) + GCC * ("__clang__" not in answer.stdout)
                return Compiler(tuple(command), (*FLAGS, *target, *more), answer.stdout)
            log.append(f"{shlex.join(asked)}\n{answer.stdout[-2000:]}{answer.stderr[-2000:]}")
    got = f"CC={wanted!r}, which does not answer as one" if wanted else f"none of {', '.join(KNOWN)} on PATH"
    place = _stored("compiler.log", "\n".join(log or [f"PATH={path}"]).encode())
    raise CompilerError(f"a C compiler must be there (got {got}; see {place}); install gcc or clang, or set CC", place)


def _answer(asked: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Return what a command says; bytes that are no text are shown as such."""
    return subprocess.run(
        asked, capture_output=True, text=True, errors="backslashreplace", check=False, stdin=subprocess.DEVNULL
    )


def _words(command: str) -> list[str]:
    """Return the words of a command; one with an open quotation mark is a single word, which no program is called."""
    try:
        return shlex.split(command)
    except ValueError:
        return [command]


@functools.cache
def library(maker: Compiler, source: str) -> ctypes.CDLL:
    """Return the library of a source, compiled or taken from an earlier run; calls into it release the interpreter lock.

    Raises:
        CompilerError: The compiler refuses the source, or what it makes has no place.
    """
    with _told():
        return _library(maker, source)


def _library(maker: Compiler, source: str) -> ctypes.CDLL:
    key = maker.key(source)
    for kept in _kept(key):
        try:
            found = ctypes.CDLL(str(kept))
        except OSError:  # of another system, say; made anew below
            continue
        with contextlib.suppress(OSError):  # a cache that can only be read
            os.utime(kept)
        return found
    made = _compiled(maker, key, source)
    name = f"{key}-{_digest(made)}.so"
    try:
        found = ctypes.CDLL(str(_stored(name, made)))
        _tidy(cache_folder())
        return found
    except OSError:  # the folder was removed this moment, or nothing in it may be run
        return _loaded(_written(_temporary(), name, made))


def _loaded(place: Path) -> ctypes.CDLL:
    try:
        return ctypes.CDLL(str(place))
    except OSError as error:
        raise CompilerError(
            f"a compiled step must be loaded (got {error}); set TMPDIR to a folder whose programs may run, or CC to another gcc or clang",
            place,
        ) from error


def _compiled(maker: Compiler, key: str, source: str) -> bytes:
    """Return the bytes of a new library; nothing half-made is ever seen outside a folder of its own."""
    with tempfile.TemporaryDirectory(prefix="gammastar-") as place:
        text, made = Path(place, "step.c"), Path(place, "step.so")
        text.write_text(source, encoding="utf-8")
        asked = [*maker.command, *maker.flags, str(text), "-o", str(made), "-lm"]
        answer = _answer(asked)
        if answer.returncode == 0 and made.exists():
            return made.read_bytes()
    _stored(f"{key}.c", source.encode())
    log = _stored(f"{key}.log", f"{shlex.join(asked)}\n{answer.stdout}{answer.stderr}".encode())
    raise CompilerError(
        f"{maker.command[0]} must compile the step (got exit code {answer.returncode}; see {log}); "
        "set CC to another gcc or clang",
        log,
    )


def cache_folder() -> Path:
    """Return the user's folder for what can be made again, by the rules of the system; a temporary one for a user without a home."""
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    try:
        if given.is_absolute():  # the rules ask to pass over another one
            base = given
        elif sys.platform == "darwin":
            base = Path.home() / "Library" / "Caches"
        elif sys.platform == "win32":
            base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
        else:
            base = Path.home() / ".cache"
    except RuntimeError:
        base = _temporary()
    return base / "gammastar" / "native"


@functools.cache
def _temporary() -> Path:
    """Return a folder of this process, for where the user's cannot be written."""
    place = Path(tempfile.mkdtemp(prefix="gammastar-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    return place


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def _kept(key: str) -> Iterator[Path]:
    """Yield the libraries kept under a key whose content is what their name says: a broken one would end the process."""
    for path in sorted(cache_folder().glob(f"{key}-*.so")):
        try:
            if path.stem.endswith(_digest(path.read_bytes())):
                yield path
        except OSError:  # taken away meanwhile
            continue


def _tidy(folder: Path) -> None:
    """Remove what was used longest ago; other processes do so at the same time, and make again what they miss."""
    ages = list[tuple[float, Path]]()
    for path in folder.glob("*"):
        with contextlib.suppress(OSError):
            ages.append((path.stat().st_mtime, path))
    for _, path in sorted(ages)[:-MOST_KEPT]:
        with contextlib.suppress(OSError):
            path.unlink()


def _stored(name: str, content: bytes) -> Path:
    """Write a file into the user's cache, or else into a temporary folder, and return where."""
    with contextlib.suppress(OSError):  # read-only, full, or removed at this moment
        return _written(cache_folder(), name, content)
    return _written(_temporary(), name, content)


def _written(folder: Path, name: str, content: bytes) -> Path:
    """Write a file whole or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    handle, draft = tempfile.mkstemp(dir=folder)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.replace(draft, folder / name)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(draft)
        raise
    return folder / name
