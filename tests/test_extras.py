"""The monitor alone: what works without the extras, and what is said of what does not."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from forestall.assembly.registry import lacking
from forestall.assembly.tables import NEEDS, TABLES
from forestall.errors import InputError
from forestall.extras import EXTRAS, how, installed, missed, need, present
from stranger import INSERT

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

WITHOUT = """
import sys

class Gone:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {names}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Gone())
"""
"""As where these modules were never installed."""

OF_EXTRAS = ("scipy", "onnxruntime", "matplotlib", "mujoco", "embreex")


def alone(code: str, cache: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a program where the monitor came alone."""
    return subprocess.run(
        [sys.executable, "-c", WITHOUT.format(names=set(OF_EXTRAS)) + code, *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=cache.parent,
        env={**os.environ, "FORESTALL_CACHE": str(cache)},
    )


def command(cache: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return alone("from forestall.cli.main import main; main()", cache, *arguments)


def test_the_tables_say_what_the_project_file_says() -> None:
    extras = PROJECT["optional-dependencies"]
    assert set(EXTRAS) == set(extras) - {"dev", "docs"}
    for (kind, name), extra in NEEDS.items():
        assert name in TABLES[kind].targets and extra in EXTRAS
    for module in OF_EXTRAS:
        assert any(module in brings.modules for brings in EXTRAS.values())
    assert not [d for d in PROJECT["dependencies"] if d.startswith(OF_EXTRAS)]
    of_dev = next(d for d in extras["dev"] if d.startswith("forestall["))
    assert {"docs", "kitchen"} <= set(re.findall(r"\w+", of_dev))


def test_what_is_missing_is_said_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    assert present("json") and not present("a_module_that_is_not_there")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr("forestall.extras.find_spec", lambda name: None)
    assert not installed("kitchen") and lacking("world", "kitchen") == "kitchen"
    assert lacking("world", "symbolic") is None
    with pytest.raises(InputError, match=r"^a figure needs matplotlib, which is not installed: "):
        need("a figure", "figures")
    error = ModuleNotFoundError("No module named 'scipy.stats'", name="scipy.stats")
    assert missed(error) == f"this needs scipy, which is not installed: {how('perception')}"
    assert missed(ModuleNotFoundError("x", name="torch")) is None, "three extras bring it"
    assert missed(ModuleNotFoundError("x", name="somebody_elses")) is None
    assert missed(ImportError("broken")) is None


def test_a_monitor_of_ones_own_needs_no_extra(tmp_path: Path) -> None:
    code = f"""
from forestall import Monitor
from stranger import TWELVE, scene

monitor = Monitor.from_demonstrations(TWELVE)
paper = Monitor.from_demonstrations(TWELVE, detector="scene-graph")
for seen in (scene("hand"), scene()):
    print(monitor.check(seen, {INSERT!r}).outcome.value, end=" ")
    print(paper.check(seen, {INSERT!r}).verdict.score)
assert not [m for m in sys.modules if m.partition(".")[0] in {OF_EXTRAS}]
"""
    path = f"import sys; sys.path.insert(0, {str(ROOT / 'tests')!r})\n"
    done = alone(path + code, tmp_path / "cache")
    assert done.returncode == 0, done.stderr
    fits, differs = (line.split() for line in done.stdout.splitlines())
    assert (fits[0], differs[0]) == ("proceed", "replan")
    assert float(fits[1]) == 1.0 > float(differs[1])


def test_a_run_in_a_symbolic_world_needs_no_extra(tmp_path: Path) -> None:
    flags = ("--scenario", "hole-full-of-chips", "--out", str(tmp_path / "run"), "--quiet")
    done = command(tmp_path / "cache", "run", "fasten-plate", *flags)
    assert done.returncode == 0, done.stderr
    assert "success" in done.stdout and (tmp_path / "run" / "index.html").is_file()


@pytest.mark.parametrize(
    ("arguments", "what", "extra"),
    [
        (["run", "heat-potato"], "the world kitchen needs mujoco", "kitchen"),
        (["demos", "record", "x.db", "--task", "heat-potato"], "kitchen needs mujoco", "kitchen"),
        (["bench", "detection", "--limit", "1"], "kitchen needs mujoco", "kitchen"),
        (["encoder", "pictures", "--out", "p"], "this needs mujoco", "kitchen"),
    ],
)
def test_what_needs_the_kitchen_names_its_extra(
    arguments: list[str], what: str, extra: str, tmp_path: Path
) -> None:
    done = command(tmp_path / "cache", *arguments)
    assert done.returncode == 2 and done.stdout == ""
    assert what in done.stderr and how(extra) in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_picture_of_ones_own_names_what_sees_it(tmp_path: Path) -> None:
    code = """
import numpy as np
from forestall import Found, Monitor, Picture, Scenes, load_domain
from stranger import TWELVE

domain = load_domain("household")
scenes = Scenes(domain)
rgb = np.full((48, 64, 3), 90, np.uint8)
seen = scenes.scene(Picture(rgb, [Found("mug", box=(10, 10, 30, 30))]))
steps = [[("pick_up(Mug-1)", {"objects": ["Mug-1"]}), {"objects": ["Mug-1"]}]]
monitor = Monitor.from_demonstrations(steps, "household")
print(monitor.check(seen, "pick_up(mug)"))
"""
    path = f"import sys; sys.path.insert(0, {str(ROOT / 'tests')!r})\n"
    done = alone(path + code, tmp_path / "cache")
    said = done.stdout + done.stderr
    assert "a scene graph from pictures needs scipy, which is not installed" in said
    assert how("perception") in said and "proceed" not in done.stdout


def test_doctor_and_parts_say_what_is_missing(tmp_path: Path) -> None:
    told = command(tmp_path / "cache", "doctor", "--json")
    assert told.returncode == 0, told.stderr
    rows = {r["part"]: r for r in json.loads(told.stdout)["parts"]}
    for extra in ("kitchen", "perception", "figures"):
        row = rows[f"extra [{extra}]"]
        assert not row["works"] and not row["needed"] and row["hint"] == how(extra)
    parts = command(tmp_path / "cache", "parts").stdout
    assert "world: kitchen (default, needs [kitchen])" in parts
    assert f"[perception] is not installed: {how('perception')}" in parts
    worlds = command(tmp_path / "cache", "parts", "world").stdout
    assert f"kitchen (default), not installed: {how('kitchen')}" in worlds


def test_a_calibration_without_matplotlib_has_no_picture(tmp_path: Path) -> None:
    from forestall import Monitor, open_memory
    from stranger import TWELVE

    with open_memory(tmp_path / "good.db", create=True) as memory:
        for demonstration in Monitor.from_demonstrations(TWELVE).demonstrations:
            memory.add(demonstration)
    out = tmp_path / "lines.toml"
    flags = ("--judge", "preconditions", "--level", "0.2", "--out", str(out), "--quiet")
    done = command(tmp_path / "cache", "calibrate", str(tmp_path / "good.db"), *flags)
    assert done.returncode == 0, done.stderr
    assert out.is_file() and not out.with_suffix(".svg").exists()
    assert f"no picture of it: {how('figures')}" in done.stdout


def test_importing_is_quick() -> None:
    """A fifth of a second of one processor, numpy not among it; the best of five."""
    code = "import time; a = time.process_time(); import forestall; print(time.process_time() - a)"
    seconds = [
        float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                             check=True).stdout)
        for _ in range(5)
    ]  # fmt: skip
    assert min(seconds) < 0.2, seconds
