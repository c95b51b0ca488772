"""Frames that were drawn before, and those that differ from one in few places.

Called by the environment in place of a renderer; calls the ray caster's renderer where something
was never seen. Many runs of one experiment stand in the same room with one thing elsewhere. The
frame of the most similar scene that was drawn from the same place is taken over, and drawn anew
where it can differ: where something came, went or changed its colour, and where light reached or
no longer reaches. The result is that of a full drawing.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from forestall.types.observation import Frame, Intrinsics
from forestall.worlds.kitchen.rendering.appearance import Appearance
from forestall.worlds.kitchen.rendering.changes import (
    FARTHEST_M,
    Sphere,
    area,
    in_light,
    on_screen,
    spheres,
    windows,
)
from forestall.worlds.kitchen.rendering.content import (
    ContentReader,
    differing,
    reshaped,
    translation,
)
from forestall.worlds.kitchen.rendering.drawn import Basis, Content, Drawn
from forestall.worlds.kitchen.rendering.lighting import (
    AMBIENT_REACH_M,
    RAYS,
    STRIDE,
    block_group,
)
from forestall.worlds.kitchen.rendering.memory import FrameMemory
from forestall.worlds.kitchen.rendering.picture import INFLUENCE, RayRenderer
from forestall.worlds.kitchen.rendering.pixels import grown
from forestall.worlds.kitchen.rendering.tracer import Bool, Float, Int
from forestall.worlds.kitchen.rendering.window import Shot, Window

LOOKED_AT = 12
"""Of the frames from one place, how many are compared with a scene."""

MOST_ANEW = 0.7
"""Share of the picture from which on all of it is drawn."""


class RedrawingRenderer:
    """Implements `Renderer` for one model; the real one is made when it is first needed."""

    def __init__(
        self,
        memory: FrameMemory,
        make: Callable[[], RayRenderer],
        name: str,
        model: mujoco.MjModel,
        appearance: Appearance,
        intrinsics: Intrinsics,
    ) -> None:
        self.name = name
        self._memory = memory
        self._make = make
        self._made: RayRenderer | None = None
        self._reader = ContentReader(model, appearance)
        self._camera = intrinsics
        self._fixed = repr((name, intrinsics)).encode()
        self._named = repr(appearance.instance_names).encode() + appearance.geom_instance.tobytes()

    def render(self, data: Any, camera_to_world: npt.NDArray[np.float64]) -> Frame:
        """See `interfaces.Renderer.render`; the arrays of the frame are read-only."""
        content = self._reader.read(data)
        pose = np.ascontiguousarray(camera_to_world, dtype=np.float64)
        place = _digest(self._fixed, self._reader.lights(data), pose.tobytes())
        key = _digest(place, self._named, *(x or b"hidden" for x in content.look))
        found = self._memory.get(key)
        if found is None:
            found = self._redrawn(place, content, data, pose) or self._drawn(content, data, pose)
            found = self._memory.keep(key, found, place)
        return found.frame

    def _drawn(self, content: Content, data: Any, pose: npt.NDArray[np.float64]) -> Drawn:
        frame, basis = self._renderer.draw(data, pose)
        return Drawn(frame, content, basis)

    def _redrawn(
        self, place: bytes, content: Content, data: Any, pose: npt.NDArray[np.float64]
    ) -> Drawn | None:
        """From the most similar frame; None where there is none that helps."""
        looks, best, fewest = set(content.look), None, len(content.look) // 2
        for drawn in islice(self._memory.near(place), LOOKED_AT):
            assert drawn.content is not None
            count = len(looks.symmetric_difference(drawn.content.look))
            if count < fewest:
                best, fewest = drawn, count
        if best is None:
            return None
        return _Redrawing(self._renderer, self._camera, best, content, data, pose).drawn()

    @property
    def _renderer(self) -> RayRenderer:
        if self._made is None:
            self._made = self._make()
        return self._made


class _Redrawing:
    """One frame on its way from an old scene to a new one."""

    def __init__(
        self,
        renderer: RayRenderer,
        camera: Intrinsics,
        old: Drawn,
        content: Content,
        data: Any,
        pose: npt.NDArray[np.float64],
    ) -> None:
        assert old.content is not None and old.basis is not None
        self._renderer, self._camera, self._content = renderer, camera, content
        self._data, self._pose = data, pose
        self._old, self._basis, self._frame = old.content, old.basis, old.frame
        self._gone, self._come = differing(old.content, content)
        self._geom = translation(old.content, content)[old.basis.geom]
        self._depth = old.frame.depth_m

    def drawn(self) -> Drawn | None:
        """The frame; None where nearly all of it would be drawn anew."""
        if not self._gone and not self._come:
            return self._finished(self._frame.rgb, replace(self._basis, geom=self._geom))
        self._geom, self._depth = self._geom.copy(), self._depth.copy()
        boxed = self._boxed()
        if boxed.mean() > MOST_ANEW:
            return None
        shot = self._renderer.aim(self._data, self._pose)
        other = np.zeros(boxed.shape, dtype=bool)
        normal = self._basis.normal.copy()
        self._look_again(shot, boxed, other, normal)
        reach = self._light_again(shot, other, normal)
        dirty = grown(other, INFLUENCE) | (boxed & self._basis.smoothed)
        parts = windows(dirty, INFLUENCE)
        if area(parts) > MOST_ANEW * dirty.size:
            return None
        basis = replace(self._basis, geom=self._geom, normal=normal, reach=reach)
        rgb = self._frame.rgb
        if parts:
            rgb = rgb.copy()
            smoothed = basis.smoothed.copy()
            kept = np.ones(dirty.shape, dtype=bool)
            own = []
            for (top, left, bottom, right), around in parts:
                window = Window(*around)
                known = (reach[window.grid] / np.float32(RAYS)).astype(np.float32)
                patch = self._renderer.paint(shot, window, known)
                inner = np.s_[top:bottom, left:right]
                y, x = top - window.top, left - window.left
                local = np.s_[y : y + bottom - top, x : x + right - left]
                rgb[inner] = patch.rgb[local]
                smoothed[inner] = patch.basis.smoothed[local]
                kept[inner] = False
                row, column = np.divmod(patch.basis.own_at, dirty.shape[1])
                here = (row >= top) & (row < bottom) & (column >= left) & (column < right)
                own.append((patch.basis.own_at[here], patch.basis.own_points[here]))
            still = kept.ravel()[basis.own_at]
            own.append((basis.own_at[still], basis.own_points[still]))
            basis = replace(
                basis,
                smoothed=smoothed,
                own_at=np.concatenate([at for at, _ in own]),
                own_points=np.concatenate([points for _, points in own]),
            )
        return self._finished(rgb, basis)

    def _finished(self, rgb: npt.NDArray[np.uint8], basis: Basis) -> Drawn:
        frame = self._renderer.frame(rgb, self._depth, basis, self._pose)
        return Drawn(frame, self._content, basis)

    def _boxed(self) -> Bool:
        """(h, w) pixels whose rays can meet what has come or gone."""
        mask = np.zeros((self._camera.height, self._camera.width), dtype=bool)
        for content, geoms in ((self._old, self._gone), (self._content, self._come)):
            for g in geoms:
                box = on_screen(content.corners_m[g], self._pose, self._camera)
                if box is not None:
                    mask[box[0] : box[2], box[1] : box[3]] = True
        return mask

    def _look_again(self, shot: Shot, boxed: Bool, other: Bool, normal: Float) -> None:
        """Trace the camera's rays; mark what they meet otherwise than before in `other`."""
        at = np.flatnonzero(boxed)
        if not at.size:
            return
        hits, _ = self._renderer.trace(shot, at)
        special = np.append(self._content.clear, False)
        special[self._come] = True
        geom, depth = self._geom.reshape(-1), self._depth.reshape(-1)
        differs = (hits.geom != geom[at]) | (hits.distance != depth[at]) | special[hits.geom]
        geom[at], depth[at] = hits.geom, hits.distance
        other.reshape(-1)[at] = differs
        row, column = np.divmod(at, self._camera.width)
        some = np.flatnonzero((row % STRIDE == 0) & (column % STRIDE == 0))
        normal[row[some] // STRIDE, column[some] // STRIDE] = hits.normal[some]

    def _light_again(self, shot: Shot, other: Bool, normal: Float) -> npt.NDArray[np.uint8]:
        """Cast light rays where they may end otherwise; mark where they do in `other`."""
        old, new = self._old, self._content
        around = [*spheres(old, reshaped(self._gone, old, new))]
        around += spheres(new, reshaped(self._come, new, old))
        reach = self._basis.reach.copy()
        every = np.s_[::STRIDE, ::STRIDE]
        anew = other[every].copy()
        row, column = np.divmod(np.arange(anew.size), anew.shape[1])
        group = block_group(row, column)
        flat = row * STRIDE * self._camera.width + column * STRIDE
        points = shot.origin + self._renderer.directions(shot, flat) * self._depth[every].reshape(
            -1, 1
        )
        anew |= self._shaded(shot, points, group, around).reshape(anew.shape)
        met = self._geom[every] >= 0
        reach[anew & ~met] = RAYS
        some = np.flatnonzero(anew & met)
        if some.size:
            facing = normal.reshape(-1, 3)[some]
            answer = self._renderer.reach(shot, points[some], facing, group[some])
            reach.reshape(-1, 2)[some] = np.round(answer * RAYS)
        other[every] |= (reach != self._basis.reach).any(axis=-1)
        own = self._basis
        far = np.full(len(own.own_at), FARTHEST_M)
        lit = in_light(own.own_points, far, shot.lights.key.position_world_m, around)
        other.reshape(-1)[own.own_at[lit]] = True
        return reach

    @staticmethod
    def _shaded(shot: Shot, points: Float, group: Int, around: list[Sphere]) -> Bool:
        lengths = np.array(AMBIENT_REACH_M, np.float32)
        reach_m = lengths[group % len(lengths)]
        return in_light(points, reach_m, shot.lights.key.position_world_m, around)


def _digest(*parts: bytes) -> bytes:
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        digest.update(part)
    return digest.digest()
