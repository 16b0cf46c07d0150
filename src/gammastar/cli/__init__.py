"""The command `gammastar`: it parses, calls and prints, and knows nothing about flying."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from gammastar.cli.verbs import app
from gammastar.errors import GammastarError

__all__ = ["app", "main"]

REFUSED = 2  # the input cannot be used
INTERRUPTED = 130  # as shells count it: 128 + SIGINT


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    0: done.  1: a flight ended early, or the check of a claim failed.  2: input that cannot be used; one sentence on stderr says
    why.  130: interrupted.
    """
    try:
        code = app(args=None if arguments is None else list(arguments), prog_name="gammastar", standalone_mode=False)
    except GammastarError as error:
        return _refuse(str(error))
    except OSError as error:
        place = f" {error.filename}" if error.filename else ""
        return _refuse(
            f"files must be open to reading and writing (got{place}: {error.strerror or error}); choose another place"
        )
    except MemoryError:
        return _refuse("a flight must fit into memory (got a longer one); shorten it or take longer steps")
    except KeyboardInterrupt:
        code = INTERRUPTED
    except Exception as error:
        if not hasattr(error, "format_message"):  # what typer raises for a command line that it cannot read
            raise
        return _refuse(f"{error.format_message().rstrip('.')}; see gammastar --help")
    if code == INTERRUPTED:
        print("interrupted; no file was left half written", file=sys.stderr)
    return code or 0


def _refuse(sentence: str) -> int:
    print(f"error: {' '.join(sentence.split())}", file=sys.stderr)
    return REFUSED
