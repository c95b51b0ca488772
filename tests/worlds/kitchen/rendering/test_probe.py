"""The probes tell what works and never raise."""

from __future__ import annotations

import builtins
import importlib
import os
import subprocess
import sys
from typing import Any

import pytest
from room import CAMERA, mixed_room

from forestall.errors import InputError
from forestall.worlds.kitchen.rendering import probe
from forestall.worlds.kitchen.rendering.gl import GlRenderer


def test_software_renderers_work_here() -> None:
    works = {name: probe._probe_ray_caster(name, "") for name in ("embree", "rays")}
    assert all(p.works for p in works.values()), works


def test_broken_mujoco_gl_is_reported_not_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "nonsense")
    monkeypatch.setattr(probe, "_GL_BACKENDS", ())
    found = probe.probe_gl()
    assert not found.available
    assert found.backend is None
    assert "nonsense" in found.detail
    assert "unset it" in probe._import_hint()


def test_all_probes_survive_an_environment_in_which_mujoco_cannot_be_imported() -> None:
    script = (
        "from forestall.worlds.kitchen.rendering import probe\n"
        "probe._GL_BACKENDS = ()\n"
        "for p in probe.probe_renderers(): print(p.name, p.works, p.hint)\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", script],
        env=os.environ | {"MUJOCO_GL": "nonsense"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    lines = run.stdout.splitlines()
    assert [line.split()[:2] for line in lines] == [
        ["embree", "False"], ["rays", "False"], ["gl", "False"],
    ]  # fmt: skip
    assert "unset it" in lines[0]


def test_probe_gl_tries_what_the_environment_says_first(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []

    def answer(backend: str, timeout_s: float) -> str | None:
        tried.append(backend)
        return None if backend == "osmesa" else "not there"

    monkeypatch.setenv("MUJOCO_GL", "glfw")
    monkeypatch.setattr(probe, "_try_gl", answer)
    assert probe.probe_gl() == probe.GlProbe(True, "osmesa", "draws with MUJOCO_GL=osmesa")
    assert tried == ["glfw", "egl", "osmesa"]


def test_a_backend_that_hangs_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(probe, "_GL_SCRIPT", "import time; time.sleep(30)")
    assert probe._try_gl("egl", 0.3) == "no answer in 0 s"


def test_probe_renderers_names_all_three(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(probe, "probe_gl", lambda: probe.GlProbe(False, None, "no library"))
    probes = probe.probe_renderers()
    assert [p.name for p in probes] == ["embree", "rays", "gl"]
    assert [p.works for p in probes] == [True, True, False]
    assert "MUJOCO_GL=egl" in probes[2].hint


def test_gl_without_a_library_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    gone = probe.GlProbe(False, None, "egl: no library")
    monkeypatch.setattr("forestall.worlds.kitchen.rendering.gl.probe_gl", lambda: gone)
    scene = mixed_room().build()
    with pytest.raises(InputError, match=r"libegl1.*MUJOCO_GL=egl"):
        GlRenderer(scene.model, scene.appearance, CAMERA)


def test_gl_with_another_backend_says_what_to_set(monkeypatch: pytest.MonkeyPatch) -> None:
    there = probe.GlProbe(True, "egl", "draws")
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    monkeypatch.setattr("forestall.worlds.kitchen.rendering.gl.probe_gl", lambda: there)
    scene = mixed_room().build()
    with pytest.raises(InputError, match="set MUJOCO_GL=egl first"):
        GlRenderer(scene.model, scene.appearance, CAMERA)


def without_embreex(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def refuse(name: str, *args: Any, **kwargs: Any) -> Any:
        if name.startswith("embreex"):
            raise ImportError("no wheel for this machine")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    monkeypatch.delitem(sys.modules, "forestall.worlds.kitchen.rendering.embree", raising=False)
    monkeypatch.delitem(sys.modules, "embreex.rtcore_scene", raising=False)
    load = importlib.import_module
    monkeypatch.setattr(
        importlib, "import_module", lambda n: refuse(n) if "embreex" in n else load(n)
    )


def test_auto_falls_back_to_rays_and_embree_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = mixed_room().build()
    assert scene.renderer("auto").name == "embree"
    without_embreex(monkeypatch)
    assert scene.renderer("auto").name == "rays"
    with pytest.raises(InputError, match="embreex cannot be imported"):
        scene.renderer("embree")
