"""Chooses a renderer by name; imports mujoco only when one is made.

A bad MUJOCO_GL makes importing mujoco fail, and the probes must survive that.
"""

from __future__ import annotations

import importlib
import importlib.util
from typing import TYPE_CHECKING

from forestall.errors import InputError, UnknownNameError
from forestall.seams.acting import Renderer
from forestall.types.observation import Intrinsics
from forestall.worlds.kitchen.rendering.appearance import Appearance

if TYPE_CHECKING:
    import mujoco

    from forestall.worlds.kitchen.rendering.memory import FrameMemory
    from forestall.worlds.kitchen.rendering.picture import RayRenderer

RENDERERS = ("auto", "embree", "gl", "rays")


def make_remembering(
    name: str,
    model: mujoco.MjModel,
    appearance: Appearance,
    intrinsics: Intrinsics,
    frames: FrameMemory,
) -> Renderer:
    """As `make_renderer`, for one that draws nothing twice."""
    if name == "embree" or (name == "auto" and _embree_imports()):
        from forestall.worlds.kitchen.rendering.redrawing import RedrawingRenderer

        return RedrawingRenderer(
            frames,
            lambda: _make_embree(model, appearance, intrinsics, threads=1),
            name,
            model,
            appearance,
            intrinsics,
        )
    from forestall.worlds.kitchen.rendering.remembered import RememberingRenderer

    return RememberingRenderer(
        frames,
        lambda: make_renderer(name, model, appearance, intrinsics),
        name,
        model,
        appearance,
        intrinsics,
    )


def make_renderer(
    name: str, model: mujoco.MjModel, appearance: Appearance, intrinsics: Intrinsics
) -> Renderer:
    """A renderer for one compiled model.

    Args:
        name: "embree"; "rays" (MuJoCo's own rays, where embreex has no wheel); "gl" (needs a
            system graphics library); "auto" is embree where embreex can be imported, else rays.
        model: compiled model.
        appearance: instances and textures of its geoms.
        intrinsics: camera of every frame.

    Raises:
        UnknownNameError: no renderer has that name.
        InputError: the renderer does not work on this machine; says what to install.
    """
    if name not in RENDERERS:
        raise UnknownNameError("renderer", name, RENDERERS)
    if name == "gl":
        from forestall.worlds.kitchen.rendering.gl import GlRenderer

        return GlRenderer(model, appearance, intrinsics)
    if name == "rays" or (name == "auto" and not _embree_imports()):
        from forestall.worlds.kitchen.rendering.picture import RayRenderer
        from forestall.worlds.kitchen.rendering.rays import MujocoTracer

        return RayRenderer(MujocoTracer(model), model, appearance, intrinsics)
    return _make_embree(model, appearance, intrinsics)


def _make_embree(
    model: mujoco.MjModel,
    appearance: Appearance,
    intrinsics: Intrinsics,
    threads: int | None = None,
) -> RayRenderer:
    from forestall.worlds.kitchen.rendering.picture import RayRenderer

    try:
        from forestall.worlds.kitchen.rendering.embree import EmbreeTracer
    except ImportError as error:
        raise InputError(
            f"embreex cannot be imported ({error}): pip install embreex, or use the renderer 'rays'"
        ) from error
    return RayRenderer(EmbreeTracer(model), model, appearance, intrinsics, threads)


def _embree_imports() -> bool:
    if importlib.util.find_spec("embreex") is None:
        return False
    try:
        importlib.import_module("embreex.rtcore_scene")
    except ImportError:
        return False
    return True
