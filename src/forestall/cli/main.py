"""Entry point of the `forestall` command: whatever happens becomes an exit code.

Exit codes: 0 done, and for a run: the task succeeded; 1 the run ended and the task failed, or a
check raised an alarm; 2 what was given is not valid; 3 something else that forestall names (a
damaged memory or model, a scene without room, a full disk, a world or a part that failed or was
late); 4 a check that could not be judged, a run whose senses were not to be trusted; 70 a fault of
forestall itself; 130 interrupted. Nothing but a command's own answer gives 0, 1 or 4, heard or not
(a reader of standard output that goes away changes no code), so this file imports only what cannot
fail before it may catch.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from forestall.cli.streams import heard_or_not

OF_ITS_OWN = 70  # EX_SOFTWARE
DEBUG = "--debug"
VARIABLE = "FORESTALL_DEBUG"
MOST_TOLD = 2000


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with its code."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # what a terminal cannot show is no reason to fail
            stream.reconfigure(errors="backslashreplace")
    sys.exit(call(arguments))


def call(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; errors are one line on standard error.

    Args:
        arguments: without the program's name; those of the process by default. `--debug` among
            them, or FORESTALL_DEBUG=1, shows where an error comes from.
    """
    with heard_or_not():
        return _call(list(sys.argv[1:] if arguments is None else arguments))


def _call(given: Sequence[str]) -> int:
    debug = DEBUG in given or os.environ.get(VARIABLE, "") not in ("", "0")
    try:
        return _answered([argument for argument in given if argument != DEBUG])
    except KeyboardInterrupt:
        return _fail("interrupted", 130)
    except BaseException as error:  # noqa: BLE001 - a crash must not look like an answer
        if debug:
            import traceback

            traceback.print_exception(error)
        try:
            return _fail(*_told(error))
        except Exception:  # noqa: BLE001 - not even that can be said: standard error is gone
            return OF_ITS_OWN


def _answered(arguments: Sequence[str]) -> int:
    from forestall.cli.app import answer

    code = answer(arguments)
    if sys.stdout is not None:
        sys.stdout.flush()
    return code


def _told(error: BaseException) -> tuple[str, int]:
    """What is said of an error, and its code."""
    from forestall.errors import ForestallError, InputError, PerceptionError, where
    from forestall.extras import missed

    if isinstance(error, InputError | PerceptionError):
        return str(error), 2
    named = isinstance(error, OSError) and not isinstance(error, BrokenPipeError)
    if named or isinstance(error, ForestallError):
        return str(error), 3
    if (lacking := missed(error)) is not None:
        return lacking, 2
    text = f"internal error: {type(error).__name__}: {str(error)[:300]}{where(error)}"
    how = f"report it with what {DEBUG} shows (README, 'Reporting a fault')"
    return f"{text}. This is a fault of forestall, not an answer: {how}", OF_ITS_OWN


def _fail(text: str, code: int) -> int:
    from forestall.reading.printing import one_line

    print(f"forestall: error: {one_line(text)[:MOST_TOLD]}", file=sys.stderr)
    return code
