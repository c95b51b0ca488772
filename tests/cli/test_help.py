"""Help says what may be chosen, and shows an example that parses; in every command there is."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

import pytest
from cyclopts import App

from forestall.assembly.configuration import WITHOUT
from forestall.assembly.tables import DATA_SETS, FOREIGN, TABLES
from forestall.cli.app import app
from forestall.cli.examples import EXAMPLES
from forestall.cli.main import call
from forestall.comparison.options import Feature
from forestall.experiments.engines import ENGINES
from forestall.experiments.robustness import DISTURBANCES
from forestall.experiments.runs import PROFILES
from forestall.experiments.settings import PAGES
from forestall.statistics.cases import SPLITS
from forestall.tasks.files import SETS


def commands(of: App = app, path: tuple[str, ...] = ()) -> Iterator[tuple[str, App]]:
    below = [name for name in of if not name.startswith("-")]
    for name in below:
        yield from commands(of[name], (*path, name))
    if path and (not below or of.default_command is not None):
        yield " ".join(path), of


COMMANDS = dict(commands())

SETTLED: Mapping[str, Collection[str]] = {
    "--captioner": TABLES["captioner"].targets,
    "--detector": TABLES["detector"].targets,
    "--disturbance": [d.name for d in DISTURBANCES],
    "--encoder": TABLES["text-encoder"].targets,
    "--engine": ENGINES,
    "--feature": [f.value for f in Feature],
    "--image-encoder": TABLES["image-encoder"].targets,
    "--judge": ("scene-graph", "preconditions", "plan-check"),
    "--pages": PAGES,
    "--profile": PROFILES,
    "--profiles": PROFILES,
    "--sensor": TABLES["sensor"].targets,
    "--split": SPLITS,
    "--strategies": TABLES["strategy"].targets,
    "--strategy": TABLES["strategy"].targets,
    "--without": WITHOUT,
    "--world": TABLES["world"].targets,
    "DATA-SET": DATA_SETS,
    "HOUSEHOLD": FOREIGN,
    "KIND": TABLES,
}
"""Flag or argument → everything that it may be."""

OF_ONE: Mapping[tuple[str, str], Collection[str]] = {
    ("scenarios", "--set"): SETS,
    ("run", "--domain"): TABLES["domain"].targets,
    ("run", "--states"): set(TABLES["states"].targets) - {"given"},
    ("check", "--states"): ("given", "learned", "clip"),
    ("cases judge", "--world"): ("symbolic",),
}
"""Those that mean something else in one command than in another."""


def choices() -> Iterator[tuple[str, str, str, Collection[str]]]:
    """Command, flag, what is said of it, what it may be."""
    for name, command in COMMANDS.items():
        for argument in command.assemble_argument_collection(parse_docstring=True):
            settled = OF_ONE.get((name, argument.name), SETTLED.get(argument.name))
            if settled is None:
                continue
            listed = " ".join(map(str, argument.get_choices() or ()))
            yield name, argument.name, f"{argument.parameter.help} {listed}", settled


def test_every_command_has_an_example() -> None:
    assert set(COMMANDS) == set(EXAMPLES)
    for name, command in COMMANDS.items():
        assert f"`forestall {EXAMPLES[name]}`" in str(command.help_epilogue), name
        assert EXAMPLES[name].startswith(name)


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_the_example_parses(name: str) -> None:
    command, _, _ = app.parse_args(
        shlex.split(EXAMPLES[name]), exit_on_error=False, print_error=False
    )
    assert command is COMMANDS[name].default_command


def test_help_names_everything_that_may_be_chosen() -> None:
    found = list(choices())
    assert {flag for _, flag, _, _ in found} >= {"--strategy", "--world", "--split", "KIND"}
    for name, flag, text, settled in found:
        lacking = [one for one in settled if one not in text]
        assert not lacking, f"forestall {name} {flag} does not say {', '.join(lacking)}"


def test_help_prints_choices_and_the_example(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["preconditions", "export", "--help"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "toml" in printed and "domain" in printed
    assert "Example: forestall preconditions export pegs.db --out pegs.toml" in printed


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_installed_where_it_is_asked_for(
    shell: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    for variable in ("XDG_DATA_HOME", "XDG_CONFIG_HOME", "ZDOTDIR"):
        monkeypatch.delenv(variable, raising=False)
    assert call(["--install-completion", "--shell", shell]) == 0
    written = [p for p in tmp_path.rglob("*") if p.is_file()]
    assert any("--scenario" in p.read_text(encoding="utf-8") for p in written)
    capsys.readouterr()
