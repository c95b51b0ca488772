"""The documents: examples work, and every path and command that they name exists."""

import re
from pathlib import Path

import pytest

from forestall.assembly.configuration import run_config
from forestall.assembly.make import prepare
from forestall.cli.app import app
from forestall.cli.main import call

ROOT = Path(__file__).parent.parent
DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
PATH = re.compile(r"`([\w./-]+\.(?:py|md|toml|jsonl?|jinja))`|\]\(([\w./-]+)\)")
MADE_BY_USERS = {
    "observation.json", "record.json", "boundaries.jsonl", "runs/episodes.jsonl", "ladle-lost.toml",
    "fetch-ladle.toml", "episodes.jsonl", "experiment.json", "effort.jsonl", "summary.json",
    "task.json", "001.json", "OUT/failing.json", "OUT/report.json", "run.json", "meta/info.json",
    "scene.json", "data/tasks/TASK.json",
    "graph.json", "perception.json", "config.json", "preprocessor_config.json",
}  # fmt: skip


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda d: d.name)
def test_every_path_exists(document: Path) -> None:
    named = {a or b for a, b in PATH.findall(document.read_text(encoding="utf-8"))}
    bases = (document.parent, ROOT, ROOT / "src" / "forestall")
    gone = [
        n
        for n in sorted(named - MADE_BY_USERS)
        if not any((base / n).exists() for base in bases)
        and not list((ROOT / "src" / "forestall").rglob(n))
    ]
    assert not gone


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda d: d.name)
def test_every_command_exists(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    known = {name for name in app if not name.startswith("-")}
    named = set(re.findall(r"\bforestall ([a-z]+)\b", text.replace("`forestall`", "")))
    prose = {"stops", "speaks", "record", "import"}
    assert named - prose <= known


def test_the_example_files_are_valid(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "task-format.md").read_text(encoding="utf-8")
    task, attributes, scenario = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    (tmp_path / "task.toml").write_text(task)
    (tmp_path / "scenario.toml").write_text(scenario)
    config = run_config(str(tmp_path / "task.toml"), str(tmp_path / "scenario.toml"))
    assert prepare(config).loaded.task.name == "fetch-ladle"
    (tmp_path / "with-attribute.toml").write_text(task + attributes)
    words = prepare(run_config(str(tmp_path / "with-attribute.toml"))).loaded.domain
    assert words.phrases("Tomato", "ripe", "unripe") == ("an unripe tomato", "a green tomato")


def test_the_page_for_ones_own_robot_runs_and_prints_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "your-robot.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```(python|text|bash|json)\n(.*?)```", page, re.S)
    names: dict[str, object] = {}
    printed = ""
    for kind, text in blocks:
        if kind == "python":
            exec(compile(text, "docs/your-robot.md", "exec"), names)
            printed = capsys.readouterr().out
        elif kind == "text":
            assert printed == text
        elif kind == "bash":
            for line in text.splitlines():
                assert call(line.split()[1:]) == 0, line
        else:
            (tmp_path / "one.json").write_text(text, encoding="utf-8")
            assert call(["demos", "add", "other.db", "one.json"]) == 0
    assert [k for k, _ in blocks].count("python") == 6
