"""Exit codes: a crash never looks like an answer, and what is printed steers no terminal."""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from forestall.cli import app, main
from forestall.cli.main import call
from forestall.errors import (
    DomainError,
    FileFormatError,
    InputError,
    MemoryFileError,
    ModelFileError,
    PerceptionError,
    SceneError,
    UnknownNameError,
)


def failing(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def raise_it(arguments: object) -> int:
        raise error

    monkeypatch.setattr(app, "answer", raise_it)


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (InputError("x"), 2),
        (UnknownNameError("task", "x", ["y"]), 2),
        (FileFormatError("x"), 2),
        (DomainError("x"), 2),
        (PerceptionError("x"), 2),
        (MemoryFileError("x"), 3),
        (ModelFileError("x"), 3),
        (SceneError("x"), 3),
        (OSError(28, "No space left on device"), 3),
        (ZeroDivisionError("division by zero"), 70),
        (MemoryError(), 70),
        (RecursionError("maximum recursion depth exceeded"), 70),
        (BrokenPipeError(32, "Broken pipe"), 70),
        (SystemExit(1), 70),
        (AssertionError(), 70),
        (KeyboardInterrupt(), 130),
    ],
)
def test_every_error_has_its_code_and_one_line(
    error: BaseException,
    code: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    failing(monkeypatch, error)
    assert call(["tasks"]) == code
    printed = capsys.readouterr()
    assert printed.err.startswith("forestall: error: ") and printed.err.count("\n") == 1
    assert printed.out == ""


def test_an_internal_error_says_where_and_how_to_report_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv(main.VARIABLE, raising=False)
    failing(monkeypatch, ZeroDivisionError("division by zero"))
    assert call(["tasks"]) == 70
    told = capsys.readouterr().err
    assert "internal error: ZeroDivisionError: division by zero (test_exit_codes.py, line" in told
    assert "report" in told and "--debug" in told and "Traceback" not in told
    assert "**Reporting a fault.**" in Path("README.md").read_text("utf-8")


@pytest.mark.parametrize("how", ["flag", "variable"])
def test_debug_shows_the_traceback(
    how: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if how == "variable":
        monkeypatch.setenv(main.VARIABLE, "1")
    failing(monkeypatch, ZeroDivisionError("division by zero"))
    assert call(["tasks", "--debug"] if how == "flag" else ["tasks"]) == 70
    assert "Traceback (most recent call last)" in capsys.readouterr().err


def test_a_package_that_cannot_be_imported_is_no_alarm(tmp_path: Path) -> None:
    """Python itself would end with 1, which means an alarm."""
    (tmp_path / "cyclopts.py").write_text("raise RuntimeError('damaged')")
    done = subprocess.run(
        [sys.executable, "-m", "forestall", "tasks"],
        capture_output=True,
        text=True,
        check=False,
        env={
            **os.environ,
            "PYTHONPATH": f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}",
        },
    )
    assert done.returncode == 70, done.stderr
    assert "internal error: RuntimeError: damaged" in done.stderr


def unheard(arguments: Sequence[str]) -> int:
    """The exit code of a command to whose answer nobody listens; it has to be silent about that."""
    code = "import sys; from forestall.cli.main import main; main(sys.argv[1:])"
    with subprocess.Popen(
        [sys.executable, "-c", code, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as run:
        assert run.stdout is not None and run.stderr is not None
        run.stdout.close()
        assert run.stderr.read() == b""
    return run.returncode


@pytest.mark.parametrize("arguments", [["bench", "all", "--help"], ["parts"]])
def test_a_reader_that_has_seen_enough_is_no_fault(arguments: list[str]) -> None:
    assert unheard(arguments) == 0


def test_an_answer_that_nobody_hears_keeps_its_code(tmp_path: Path) -> None:
    wrong = tmp_path / "task.toml"
    wrong.write_text("nmae = 1\n", "utf-8")
    assert call(["tasks", "check", str(wrong)]) == 1
    assert unheard(["tasks", "check", str(wrong)]) == 1


def test_an_error_that_nobody_hears_keeps_its_code() -> None:
    code = "import sys; from forestall.cli.main import main; main(['rnu'])"
    with subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE) as run:
        assert run.stderr is not None
        run.stderr.close()
    assert run.returncode == 2


@pytest.mark.parametrize(
    "arguments", [["rnu"], ["tasks", "--sed", "1"], ["compare"], ["check", "x", "--threshold", "a"]]
)
def test_a_wrong_command_line_is_invalid_input(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(arguments) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_names_in_files_steer_no_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one, two = tmp_path / "one.json", tmp_path / "two.json"

    def write(file: Path, name: str) -> None:
        nodes = [{"id": name, "category": name}, {"id": "Table-1", "category": "Table"}]
        relations = [[name, "on_top_of", "Table-1"]]
        file.write_text(json.dumps({"format": 1, "nodes": nodes, "relations": relations}))

    write(one, "Mug-1\u202e1-guM")
    write(two, "Mug-2")
    assert call(["compare", str(one), str(two)]) == 0
    shown = capsys.readouterr().out
    assert r"Mug-1\u202e1-guM" in shown and "\u202e" not in shown
    write(two, "Mug-1\x1b[2J\x1b]0;owned\x07")
    assert call(["compare", str(one), str(two)]) == 2
    told = capsys.readouterr().err
    assert r"nodes[0].id: a name" in told and r"Mug-1\x1b[2J" in told
    assert not any(c in told for c in "\x1b\x07") and told.count("\n") == 1
    two.rename(tmp_path / "three\x1b[31m.json")
    assert call(["compare", str(one), str(tmp_path / "three\x1b[31m.json")]) == 2
    assert "\x1b" not in capsys.readouterr().err


PARTS = """
from forestall.detection.scene_graph import SceneGraphDetector
from forestall.errors import PerceptionError


class Broken:
    name = "broken"

    def judge(self, observed, observation, references):
        raise {error}
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        ("ZeroDivisionError('division by zero')", 70, "internal error"),
        ("PerceptionError('the lens is cracked')", 3, "the lens is cracked"),
    ],
)
def test_a_run_that_was_held_does_not_look_like_a_task_that_failed(
    error: str,
    code: int,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    name = f"parts_of_test_{code}"
    (tmp_path / f"{name}.py").write_text(PARTS.format(error=error), encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    run = ["run", "fasten-plate", "--out", str(tmp_path / "run"), "--quiet"]
    assert call([*run, "--detector", f"{name}:Broken"]) == code
    printed = capsys.readouterr()
    assert said in printed.err and "detector" in printed.err
