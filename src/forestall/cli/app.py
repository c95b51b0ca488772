"""The commands of `forestall`, put together; called by `main.py`."""

from __future__ import annotations

from collections.abc import Sequence

import cyclopts
from cyclopts import App

import forestall
from forestall.cli import experiments, robustness, third_party
from forestall.cli.bench import bench
from forestall.cli.beside import beside
from forestall.cli.calibrate import calibrate
from forestall.cli.cases import cases
from forestall.cli.demos import demos
from forestall.cli.doctor import doctor
from forestall.cli.domain import domain
from forestall.cli.encoder import encoder
from forestall.cli.examples import EXAMPLES
from forestall.cli.flags import spelt, unknown_option
from forestall.cli.importing import import_
from forestall.cli.inspect import check, compare
from forestall.cli.listing import scenarios, tasks
from forestall.cli.page import export, gallery, page
from forestall.cli.parts import parts
from forestall.cli.perceive import perceive
from forestall.cli.plan import plan
from forestall.cli.preconditions import preconditions
from forestall.cli.replay import replay
from forestall.cli.run import run
from forestall.cli.study import study
from forestall.cli.view import view
from forestall.errors import InputError

app = App(
    name="forestall",
    help="See a failing subtask coming, explain it, replan, succeed.",
    version=forestall.__version__,
    suppress_keyboard_interrupt=False,
)
for command in (
    run,
    beside,
    view,
    page,
    gallery,
    export,
    tasks,
    scenarios,
    parts,
    perceive,
    check,
    compare,
    calibrate,
    doctor,
):
    app.command(command)
app.command(import_, name="import")
app.command(replay)
app.command(demos)
app.command(domain)
app.command(bench)
app.command(cases)
experiments.register(bench)
third_party.register(bench)
robustness.register(bench)
app.command(encoder)
app.command(plan)
app.command(preconditions)
app.command(study)
app.register_install_completion_command(
    help="Install completion for bash, zsh, fish or PowerShell, and have it loaded by new shells."
)
for name, example in EXAMPLES.items():
    shown = app
    for word in name.split():
        shown = shown[word]
    shown.help_epilogue = f"Example: `forestall {example}`"


def answer(arguments: Sequence[str]) -> int:
    """Run one command line and return what the command answers.

    Raises:
        InputError: the command line is not valid.
    """
    try:
        code = app(
            list(spelt(arguments)),
            exit_on_error=False,
            print_error=False,
            result_action="return_value",
        )
    except cyclopts.UnknownOptionError as error:
        raise InputError(unknown_option(error)) from error
    except cyclopts.CycloptsError as error:
        raise InputError(str(error)) from error
    return code if isinstance(code, int) else 0
