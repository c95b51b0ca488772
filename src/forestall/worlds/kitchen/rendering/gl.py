"""MuJoCo's own OpenGL renderer, only where it is asked for and a graphics library is there."""

from __future__ import annotations

import os
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from forestall.errors import InputError
from forestall.types.observation import Frame, Intrinsics
from forestall.worlds.kitchen.rendering.appearance import Appearance
from forestall.worlds.kitchen.rendering.probe import GL_HINT, probe_gl
from forestall.worlds.kitchen.rendering.tracer import DRAWN_GROUPS


class GlRenderer:
    """Wraps `mujoco.Renderer`; textures and emission of bare geoms are those of MuJoCo.

    MuJoCo reads MUJOCO_GL when it is first imported, so the variable has to be set before the
    program starts.

    Raises:
        InputError: there is no graphics library, or MUJOCO_GL was not set to the one that works.
    """

    name = "gl"

    def __init__(
        self, model: mujoco.MjModel, appearance: Appearance, intrinsics: Intrinsics
    ) -> None:
        probe = probe_gl()
        if not probe.available:
            raise InputError(f"the renderer 'gl' does not work here ({probe.detail}): {GL_HINT}")
        chosen = os.environ.get("MUJOCO_GL", "").strip().lower()
        if chosen != probe.backend:
            raise InputError(f"the renderer 'gl' works here: set MUJOCO_GL={probe.backend} first")
        self._intrinsics = intrinsics
        self._names = appearance.instance_names
        self._instance = np.append(appearance.geom_instance, np.int32(-1)).astype(np.int32)
        buffers = model.vis.global_
        buffers.offwidth = max(int(buffers.offwidth), intrinsics.width)
        buffers.offheight = max(int(buffers.offheight), intrinsics.height)
        try:
            self._renderer = mujoco.Renderer(model, intrinsics.height, intrinsics.width)
        except (ImportError, RuntimeError, mujoco.FatalError) as error:
            raise InputError(f"the renderer 'gl' cannot start ({error}): {GL_HINT}") from error
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = np.arange(6) < DRAWN_GROUPS

    def render(self, data: Any, camera_to_world: npt.NDArray[np.float64]) -> Frame:
        """See `interfaces.Renderer.render`."""
        self._renderer.update_scene(data, scene_option=self._option)
        self._aim(camera_to_world)
        rgb = self._renderer.render().copy()
        self._renderer.enable_depth_rendering()
        depth = self._renderer.render().astype(np.float32)
        self._renderer.disable_depth_rendering()
        self._renderer.enable_segmentation_rendering()
        segments = self._renderer.render()
        self._renderer.disable_segmentation_rendering()
        is_geom = segments[..., 1] == int(mujoco.mjtObj.mjOBJ_GEOM)
        geom = np.where(is_geom, segments[..., 0], -1)
        depth[geom < 0] = 0
        return Frame(
            rgb=rgb,
            depth_m=depth,
            intrinsics=self._intrinsics,
            camera_to_world=np.array(camera_to_world, dtype=np.float64),
            instance_ids=self._instance[geom],
            instance_names=self._names,
        )

    def _aim(self, camera_to_world: npt.NDArray[np.float64]) -> None:
        """Put both eyes of the scene's camera at the pose, with this pinhole's frustum."""
        camera = self._intrinsics
        for eye in self._renderer.scene.camera:
            near = float(eye.frustum_near)
            eye.pos = camera_to_world[:3, 3]
            eye.forward = camera_to_world[:3, 2]
            eye.up = -camera_to_world[:3, 1]
            eye.frustum_bottom = -near * (camera.height - 0.5 - camera.cy) / camera.fy
            eye.frustum_top = near * (camera.cy + 0.5) / camera.fy
            eye.frustum_center = near * (camera.width / 2 - 0.5 - camera.cx) / camera.fx
            eye.frustum_width = near * camera.width / 2 / camera.fx
