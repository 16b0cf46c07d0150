"""The command `gammastar`: it parses, calls and prints, and knows nothing about flying."""

from __future__ import annotations

import signal
from collections.abc import Sequence
from typing import Any

from gammastar.cli import output, process
from gammastar.errors import GammastarError

__all__ = ["main"]

FAILED = 1
REFUSED = 2  # the input cannot be used
LONGEST_SENTENCE = 800  # characters; what was refused may be far longer


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    0: done.  1: a flight ended early, the check of a claim failed, or stdout cannot be written.  2: input that cannot be used; one
    sentence on stderr says why.  130, 141, 143: ended by an interrupt, by a reader of stdout that went away, or by SIGTERM.
    """
    if not process.prepare_streams():
        return _stopped("standard output must be open to writing (got a closed one); open it, or send it to a file", 1)
    said = "interrupted; no file was left half written"
    with process.warnings_as_notes(), process.stopped_by_signals() as received:
        try:
            code = _run(arguments)
        except (Exception, KeyboardInterrupt) as error:
            received.heard = True
            # A library in another language may turn an interrupt into any error.
            interrupted = received or process.is_interrupt(error)
            code = process.INTERRUPTED if interrupted else _explained(error)
            if isinstance(error, process.Interrupted):
                said = str(error)
        finally:
            process.settle_streams()
    if code == process.INTERRUPTED:
        code = 128 + (received or [signal.SIGINT])[0]
        process.forget_interrupt()
        process.note(said)
    return code


def _run(arguments: Sequence[str] | None) -> int:
    """Parse and call; return the exit code."""
    from gammastar.cli.verbs import app

    words = None if arguments is None else list(arguments)
    with output.reported():
        code: Any = app(args=words, prog_name="gammastar", standalone_mode=False)
    return code or 0


def _explained(error: BaseException) -> int:
    """Say why nothing more is done and return the exit code; an error that is ours to mend is raised again."""
    match error:
        case GammastarError():
            return _stopped(str(error))
        case output.OutputError(cause=BrokenPipeError()):
            return process.PIPE_CLOSED
        case output.OutputError(cause=cause):
            return _stopped(
                f"standard output must be open to writing (got: {cause.strerror}); send it elsewhere", FAILED
            )
        case OSError():
            file = error.filename2 or error.filename
            place = f" {file}" if file else ""
            return _stopped(
                f"files must be open to reading and writing (got{place}: {error.strerror or error}); choose another place"
            )
        case MemoryError():
            return _stopped("a flight must fit into memory (got a longer one); shorten it or take longer steps")
    if hasattr(error, "format_message"):  # what typer raises for a command line that it cannot read
        context = getattr(error, "ctx", None)
        verb = context.command_path if context else "gammastar"
        return _stopped(f"{error.format_message().rstrip('.')}; see {verb} --help")
    raise error


def _stopped(sentence: str, code: int = REFUSED) -> int:
    """Say why nothing more is done, on one printable line, and return the exit code."""
    line = " ".join(sentence.split())
    line = "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in line)
    if len(line) > LONGEST_SENTENCE:
        line = f"{line[: LONGEST_SENTENCE // 2]} ... {line[-LONGEST_SENTENCE // 2 :]}"
    process.note(f"error: {line}")
    return code
