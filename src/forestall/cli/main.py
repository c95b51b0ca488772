"""Entry point of the `forestall` command.

Exit codes: 0 done, and for a run: the task succeeded; 1 the run ended and the task failed, or a
check raised an alarm; 2 the input was not valid; 3 something else that forestall names (a damaged
memory, a full disk); 4 a check that could not be judged; 130 interrupted.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import cyclopts
from cyclopts import App

import forestall
from forestall.cli import experiments
from forestall.cli.bench import bench
from forestall.cli.demos import demos
from forestall.cli.doctor import doctor
from forestall.cli.domain import domain
from forestall.cli.encoder import encoder
from forestall.cli.flags import spelt
from forestall.cli.inspect import check, compare
from forestall.cli.listing import scenarios, tasks
from forestall.cli.page import page
from forestall.cli.parts import parts
from forestall.cli.run import run
from forestall.errors import ForestallError, InputError

app = App(
    name="forestall",
    help="See a failing subtask coming, explain it, replan, succeed.",
    version=forestall.__version__,
    suppress_keyboard_interrupt=False,
)
for command in (run, page, tasks, scenarios, parts, check, compare, doctor):
    app.command(command)
app.command(demos)
app.command(domain)
app.command(bench)
experiments.register(bench)
app.command(encoder)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with its code."""
    sys.exit(call(arguments))


def call(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; errors are one line on standard error."""
    given = sys.argv[1:] if arguments is None else arguments
    try:
        code = app(
            list(spelt(given)), exit_on_error=False, print_error=False, result_action="return_value"
        )
    except cyclopts.CycloptsError as error:
        return _fail(" ".join(str(error).split()), 2)
    except InputError as error:
        return _fail(str(error), 2)
    except ForestallError as error:
        return _fail(str(error), 3)
    except KeyboardInterrupt:
        return _fail("interrupted", 130)
    except BrokenPipeError:
        return 0
    except OSError as error:
        return _fail(str(error), 3)
    return code if isinstance(code, int) else 0


def _fail(text: str, code: int) -> int:
    print(f"forestall: error: {text}", file=sys.stderr)
    return code
