"""Finds out which renderers work on this machine.

Graphics libraries are tried in a subprocess: with MUJOCO_GL set to something that is not there,
importing mujoco itself can fail, and a broken driver can end the process.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass

from forestall.types.observation import Intrinsics

GL_HINT = (
    "install a graphics library (Debian/Ubuntu: apt-get install libegl1 libgl1, or libosmesa6), "
    "then pip install pyopengl and set MUJOCO_GL=egl (or osmesa)"
)

_GL_BACKENDS = ("egl", "osmesa")
_GL_SCRIPT = """
import mujoco
spec = mujoco.MjSpec()
spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.5, 0, 0])
spec.visual.global_.offwidth, spec.visual.global_.offheight = 16, 16
model = spec.compile()
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
renderer = mujoco.Renderer(model, 16, 16)
renderer.update_scene(data)
assert renderer.render().shape == (16, 16, 3)
renderer.close()
print("drawn")
"""


@dataclass(frozen=True, slots=True)
class GlProbe:
    """Whether MuJoCo's own renderer draws here.

    `backend` is the value of MUJOCO_GL with which it does, None where it does not.
    """

    available: bool
    backend: str | None
    detail: str


@dataclass(frozen=True, slots=True)
class Probe:
    """Whether one renderer works; `hint` says what to do where it does not."""

    name: str
    works: bool
    detail: str
    hint: str


def probe_gl(timeout_s: float = 60.0) -> GlProbe:
    """Draw 16×16 pixels in a subprocess with each graphics backend.

    Tries the environment's own MUJOCO_GL first, then EGL, then OSMesa.
    """
    chosen = os.environ.get("MUJOCO_GL", "").strip().lower()
    backends = list(dict.fromkeys([*([chosen] if chosen else []), *_GL_BACKENDS]))
    reasons = []
    for backend in backends:
        reason = _try_gl(backend, timeout_s)
        if reason is None:
            return GlProbe(True, backend, f"draws with MUJOCO_GL={backend}")
        reasons.append(f"{backend}: {reason}")
    return GlProbe(False, None, "; ".join(reasons))


def _try_gl(backend: str, timeout_s: float) -> str | None:
    environment = {k: v for k, v in os.environ.items() if k != "PYOPENGL_PLATFORM"}
    try:
        run = subprocess.run(
            [sys.executable, "-c", _GL_SCRIPT],
            env=environment | {"MUJOCO_GL": backend},
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no answer in {timeout_s:.0f} s"
    except OSError as error:
        return str(error)
    if run.returncode == 0 and "drawn" in run.stdout:
        return None
    lines = [line for line in run.stderr.splitlines() if line and not line.startswith((" ", "\t"))]
    errors = [line for line in lines if "Error" in line]
    return (errors or lines or [f"ended with code {run.returncode}"])[0 if errors else -1][:160]


def probe_renderers() -> list[Probe]:
    """Try every renderer on a tiny scene, the default first."""
    gl = probe_gl()
    return [
        _probe_ray_caster("embree", "pip install embreex"),
        _probe_ray_caster("rays", "pip install mujoco-core"),
        Probe("gl", gl.available, gl.detail, "" if gl.available else GL_HINT),
    ]


def _probe_ray_caster(name: str, hint: str) -> Probe:
    try:
        detail = _draw_sphere(name)
    except Exception as error:  # noqa: BLE001 - whatever is wrong is the answer
        return Probe(name, False, f"{type(error).__name__}: {error}"[:200], _import_hint() or hint)
    return Probe(name, True, detail, "")


def _import_hint() -> str:
    backend = os.environ.get("MUJOCO_GL", "")
    known = ("", "egl", "osmesa", "glfw", "glx", "wgl", "cgl", "disable", "disabled", "off")
    if backend.strip().lower() not in known:
        return f"MUJOCO_GL is {backend!r}, which keeps mujoco from being imported: unset it"
    return ""


def _draw_sphere(name: str) -> str:
    import mujoco
    import numpy as np

    from forestall.worlds.kitchen.rendering import Appearance, make_renderer

    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.5, 0, 0], pos=[0, 0, 2], rgba=[0.8, 0.2, 0.2, 1]
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    looks = Appearance(("Sphere-1",), np.zeros(1, np.int32), (None,))
    camera = Intrinsics.from_vertical_fov(16, 16, 60.0)
    frame = make_renderer(name, model, looks, camera).render(data, np.eye(4))
    depth = float(frame.depth_m[8, 8])
    if abs(depth - 1.5) > 0.02:
        raise RuntimeError(f"a sphere 1.5 m away was seen at {depth:.3f} m")
    return "draws, with metric depth"
