"""Frames that were drawn before, keyed by everything that decides what they show.

Called by the environment in place of a renderer; calls the renderer on a miss. Many runs of one
experiment start in the same scene and part ways late: what they see alike is drawn once. The key is
the content (the whole model with its present sizes and colours, the places of its geoms and lights,
the camera), so that nothing but the time depends on what is remembered.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from forestall.seams.acting import Renderer
from forestall.types.observation import Frame, Intrinsics
from forestall.worlds.kitchen.rendering.appearance import Appearance
from forestall.worlds.kitchen.rendering.drawn import Drawn
from forestall.worlds.kitchen.rendering.memory import FrameMemory


class RememberingRenderer:
    """Implements `Renderer` for one model; the real one is made when it is first needed."""

    def __init__(
        self,
        memory: FrameMemory,
        make: Callable[[], Renderer],
        name: str,
        model: mujoco.MjModel,
        appearance: Appearance,
        intrinsics: Intrinsics,
    ) -> None:
        self.name = name
        self._memory = memory
        self._make = make
        self._inner: Renderer | None = None
        self._model = model
        self._buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
        fixed = (name, appearance.instance_names, appearance.texture, intrinsics)
        self._fixed = hashlib.blake2b(repr(fixed).encode(), digest_size=16)
        self._fixed.update(np.ascontiguousarray(appearance.geom_instance).tobytes())

    def render(self, data: Any, camera_to_world: npt.NDArray[np.float64]) -> Frame:
        """See `interfaces.Renderer.render`; the arrays of a remembered frame are read-only."""
        key = self._key(data, camera_to_world)
        found = self._memory.get(key)
        if found is not None:
            return found.frame
        if self._inner is None:
            self._inner = self._make()
        return self._memory.keep(key, Drawn(self._inner.render(data, camera_to_world))).frame

    def _key(self, data: Any, camera_to_world: npt.NDArray[np.float64]) -> bytes:
        mujoco.mj_saveModel(self._model, None, self._buffer)
        digest = self._fixed.copy()
        digest.update(self._buffer.tobytes())
        for array in (
            data.geom_xpos,
            data.geom_xmat,
            data.light_xpos,
            data.light_xdir,
            np.asarray(camera_to_world, dtype=np.float64),
        ):
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.digest()
