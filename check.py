"""Every check of the project in one command: `python check.py`.

Formatting, linting, types, import contracts, the documentation as a site (every warning is an
error), tests.
`python check.py fast` leaves out the tests that draw in the simulator or take long: the check
before every commit. `python check.py tests -k memory` runs the tests alone and hands the rest to
pytest; `python check.py lines` runs them and says which share of the lines they run, which takes a
fifth longer.
"""

import json
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

STATIC = {
    "format": ["-m", "ruff", "format", "--check", "."],
    "lint": ["-m", "ruff", "check", "."],
    "types": ["-m", "mypy"],
    "imports": ["-c", "from importlinter.cli import lint_imports_command as run; run()"],
    "docs": ["-m", "mkdocs", "build", "--strict", "--quiet"],
}
TESTS = ["-m", "pytest", "-n", "auto", "--dist", "loadgroup", "--no-loadscope-reorder"]
FAST = ["-m", "not slow and not simulator"]
SLIPCOVER = ["-m", "slipcover", "--source", "src/forestall", "--json"]
"""On Python 3.11 a fifth more time for the tests; coverage.py doubles it."""
SENT = ["--omit", "src/forestall/experiments/engines.py"]
"""Ray sends functions of this file to its workers, and cannot send what Slipcover has changed."""
NOT_REWRITTEN = ["-W", "ignore::pytest.PytestAssertRewriteWarning"]
"""Slipcover is a plug-in of pytest and is there before pytest is."""
WORST = 8


def main(arguments: list[str]) -> int:
    """Run the named check, or all; every one runs even when an earlier one failed."""
    name, *rest = arguments or ["all"]
    if name not in (*STATIC, "tests", "lines", "fast", "all"):
        print(f"no check {name!r}; there are {', '.join(STATIC)}, tests, lines, fast, all")
        return 2
    if name in STATIC:
        return 0 if _static(name, rest) else 1
    if name in ("tests", "lines"):
        return 0 if (_tests if name == "tests" else _measured)(rest) else 1
    with ThreadPoolExecutor(1) as beside:  # a core would idle while mypy runs alone
        static = {check: beside.submit(_static, check, ()) for check in STATIC}
        passed = {"tests": _tests([*FAST, *rest] if name == "fast" else rest)}
        passed |= {check: done.result() for check, done in static.items()}
    failed = [check for check, well in passed.items() if not well]
    print("all checks passed" if not failed else f"failed: {', '.join(failed)}", flush=True)
    return 1 if failed else 0


def _static(check: str, rest: Sequence[str]) -> bool:
    started = time.monotonic()
    command = [sys.executable, *STATIC[check], *rest]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    return _ended(check, started, done.returncode, done.stdout + done.stderr)


def _tests(rest: Sequence[str]) -> bool:
    started = time.monotonic()
    done = subprocess.run([sys.executable, *TESTS, *rest], check=False)
    return _ended("tests", started, done.returncode)


def _measured(rest: Sequence[str]) -> bool:
    with TemporaryDirectory() as folder:
        found, started = Path(folder) / "lines.json", time.monotonic()
        command = [
            sys.executable,
            *SLIPCOVER,
            *SENT,
            "--out",
            str(found),
            *TESTS,
            *NOT_REWRITTEN,
            *rest,
        ]
        done = subprocess.run(command, check=False)
        if found.is_file():
            print(_share(json.loads(found.read_text("utf-8"))), flush=True)
    return _ended("tests", started, done.returncode)


def _share(found: dict[str, dict[str, dict[str, dict[str, float]]]]) -> str:
    """The lines that ran, in one sentence. Those of processes that a test starts are not seen."""
    files = {name: file["summary"] for name, file in found["files"].items()}
    ran = sum(s["covered_lines"] for s in files.values())
    lines = ran + sum(s["missing_lines"] for s in files.values())
    worst = sorted(files, key=lambda name: files[name]["percent_covered"])[:WORST]
    shown = (
        f"{name.removeprefix('src/forestall/')} {files[name]['percent_covered']:.0f} %"
        for name in worst
    )
    return f"lines run: {ran / max(lines, 1):.1%} of {lines:.0f}; least of {', '.join(shown)}"


def _ended(check: str, started: float, code: int, output: str = "") -> bool:
    seconds = time.monotonic() - started
    told = f"{output.rstrip()}\n" if code else ""
    print(f"{told}== {check}: {'FAILED' if code else 'ok'} ({seconds:.0f} s)", flush=True)
    return code == 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
