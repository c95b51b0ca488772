"""Small scenes with known answers, for the renderer tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from forestall.seams import Renderer
from forestall.types.observation import Frame, Intrinsics
from forestall.worlds.kitchen.rendering import Appearance, make_renderer

CAMERA = Intrinsics.from_vertical_fov(160, 120, 60.0)
GREY = (0.6, 0.6, 0.6, 1.0)
KINDS = mujoco.mjtGeom


@dataclass
class Room:
    """Collects geoms, then compiles; the camera sits at the origin and looks along world +x."""

    spec: mujoco.MjSpec = field(default_factory=mujoco.MjSpec)
    instances: dict[str, str] = field(default_factory=dict)
    textures: dict[str, str] = field(default_factory=dict)

    def add(
        self,
        name: str,
        kind: mujoco.mjtGeom,
        size: Sequence[float],
        pos: Sequence[float],
        *,
        rgba: Sequence[float] = GREY,
        instance: str | None = None,
        texture: str | None = None,
        group: int = 0,
        quat: Sequence[float] = (1, 0, 0, 0),
        free: bool = False,
        mesh: str = "",
    ) -> Room:
        body = self.spec.worldbody
        if free:
            body = body.add_body(name=f"{name} body", pos=list(pos))
            body.add_freejoint()
            pos = (0, 0, 0)
        geom = body.add_geom(
            name=name, type=kind, size=[*size, 0, 0, 0][:3], pos=list(pos), rgba=list(rgba),
            group=group, quat=list(quat),
        )  # fmt: skip
        if mesh:
            geom.meshname = mesh
        if instance:
            self.instances[name] = instance
        if texture:
            self.textures[name] = texture
        return self

    def light(self, pos: Sequence[float] = (0.5, 0, 1.8)) -> Room:
        self.spec.worldbody.add_light(
            name="key", type=mujoco.mjtLightType.mjLIGHT_POINT, pos=list(pos),
            diffuse=[0.7, 0.7, 0.7], castshadow=True,
        )  # fmt: skip
        return self

    def build(self) -> Scene:
        model = self.spec.compile()
        names = tuple(sorted(set(self.instances.values())))
        geoms = [model.geom(g).name for g in range(model.ngeom)]
        ids = [names.index(self.instances[g]) if g in self.instances else -1 for g in geoms]
        appearance = Appearance(
            names, np.array(ids, np.int32), tuple(self.textures.get(g) for g in geoms)
        )
        scene = Scene(model, mujoco.MjData(model), appearance)
        scene.refresh()
        return scene


@dataclass
class Scene:
    model: mujoco.MjModel
    data: mujoco.MjData
    appearance: Appearance

    def refresh(self) -> None:
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def renderer(self, name: str = "embree", camera: Intrinsics = CAMERA) -> Renderer:
        return make_renderer(name, self.model, self.appearance, camera)

    def frame(self, name: str = "embree", camera: Intrinsics = CAMERA) -> Frame:
        return self.renderer(name, camera).render(self.data, FORWARD)


FORWARD = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])
"""Camera at the origin that looks along world +x with world z up."""


def wall(room: Room, x: float = 2.0, **look: object) -> Room:
    """A vertical wall whose near face is at x."""
    return room.add("wall", KINDS.mjGEOM_BOX, (0.05, 4, 4), (x + 0.05, 0, 0), **look)  # type: ignore[arg-type]


def mixed_room() -> Room:
    """Boxes, cylinders, planes and round things in front of a wall, with textures and a light."""
    room = wall(Room(), 2.5, texture="plaster", rgba=(0.8, 0.75, 0.7, 1))
    room.add("floor", KINDS.mjGEOM_PLANE, (4, 4, 1), (0, 0, -0.8), texture="tiles")
    room.add("table", KINDS.mjGEOM_BOX, (0.4, 0.6, 0.03), (1.6, 0, -0.4), texture="wood",
             instance="Table-1", rgba=(0.6, 0.4, 0.2, 1))  # fmt: skip
    room.add("can", KINDS.mjGEOM_CYLINDER, (0.08, 0.12), (1.5, 0.3, -0.25), texture="metal",
             instance="Can-1", free=True)  # fmt: skip
    room.add("ball", KINDS.mjGEOM_SPHERE, (0.1,), (1.5, -0.25, -0.27), texture="food",
             instance="Ball-1", rgba=(0.8, 0.1, 0.1, 1), free=True)  # fmt: skip
    room.add("egg", KINDS.mjGEOM_ELLIPSOID, (0.06, 0.06, 0.09), (1.35, 0, -0.28),
             instance="Egg-1", free=True)  # fmt: skip
    return room.light()
