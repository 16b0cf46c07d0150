"""What a command owes the shell around it: streams that degrade instead of failing, and signals that end it cleanly."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import sys
import threading
import warnings
from collections.abc import Iterator
from typing import Any, TextIO

from gammastar.errors import MachineWarning

STOPS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGALRM") if hasattr(signal, name))
INTERRUPTED = 128 + signal.SIGINT  # as shells count what a signal ends
AGAIN = 1.0  # [s] after which an interrupt is repeated: long enough to remove temporary files on a busy machine
PIPE_CLOSED = 128 + 13  # SIGPIPE, which Python turns into an error


class Interrupted(Exception):
    """A verb was interrupted, and says how to go on; no KeyboardInterrupt, whose words the command line's parser would drop."""


def prepare_streams() -> bool:
    """Let stdout and stderr escape what their encoding lacks, and open a missing stderr onto nothing; return whether stdout is open."""
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - it is stderr from here on
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    return sys.stdout is not None


def settle_streams() -> None:
    """Flush stdout and stderr; what cannot be written is dropped, so that Python does not complain of it on its way out."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            _drop(stream)


def note(words: str) -> None:
    """Print a line on stderr; that nobody can receive it is no reason to fail."""
    with contextlib.suppress(OSError):
        print(words, file=sys.stderr, flush=True)


@contextlib.contextmanager
def warnings_as_notes() -> Iterator[None]:
    """Let a warning of ours be a line on stderr, without the place in our code that it comes from; others stay what they are."""
    show = warnings.showwarning

    def noted(message: Warning | str, category: type[Warning], *place: Any, **named: Any) -> None:
        if issubclass(category, MachineWarning):
            note(f"warning: {message}")
        else:
            show(message, category, *place, **named)

    warnings.showwarning = noted
    try:
        yield
    finally:
        warnings.showwarning = show


class Stops(list[int]):
    """The signals received so far."""

    heard = False  # whether one has got where it is answered, so that none need be repeated


@contextlib.contextmanager
def stopped_by_signals() -> Iterator[Stops]:
    """Let every signal of `STOPS` interrupt as Ctrl-C does, so that temporary files go; yield the list of those received.

    A signal that whoever started the process has chosen to ignore stays ignored.  An interrupt may be lost on its way, in a
    destructor or where a library in another language sorts its arguments, so an alarm repeats it until it is heard.
    """
    received = Stops()

    def stop(number: int, _: Any) -> None:
        if received.heard:
            return
        received.append(number)
        signal.setitimer(signal.ITIMER_REAL, AGAIN)
        raise KeyboardInterrupt

    def unless_interrupt(lost: Any) -> None:
        if not received or lost.exc_type is not KeyboardInterrupt:
            unraisable(lost)

    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
        yield received
        return
    usual = (signal.SIG_DFL, signal.default_int_handler)
    before = {each: signal.signal(each, stop) for each in STOPS if signal.getsignal(each) in usual}
    unraisable, sys.unraisablehook = sys.unraisablehook, unless_interrupt
    try:
        yield received
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        sys.unraisablehook = unraisable
        for each, handler in before.items():
            signal.signal(each, handler)


def answered() -> None:
    """Say that an interrupt has been answered by going on otherwise: it is not repeated, and the next one interrupts again."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, 0)


def forget_interrupt() -> None:
    """Let the exit code stand.

    `python -m` keeps in mind an interrupt that went through `exec` of a text, as dataclasses run while modules load, and would end by it
    whatever became of it; the next text that runs to its end makes it forget.
    """
    exec("")


def is_interrupt(error: BaseException | None) -> bool:
    """Return whether an error is an interrupt, or what a library in another language makes of one."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _drop(stream: TextIO) -> None:
    """Let a stream lead nowhere from now on."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
