"""Collects the geoms of a scene in one MjSpec, with what each belongs to and when it is seen.

Furniture and object builders call `Assembly`; `compile_kit` turns everything into a model with
index tables, which `world` reads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from forestall.worlds.kitchen.forms import Rgba, Vec
from forestall.worlds.kitchen.meshes import Mesh
from forestall.worlds.kitchen.rendering.appearance import Appearance

SHOWN, HIDDEN, PROXY = 0, 4, 5
"""geom_group of what is drawn, of what its state hides, and of collision shapes."""

Quat = tuple[float, float, float, float]
UPRIGHT: Quat = (1.0, 0.0, 0.0, 0.0)
When = Mapping[str, Sequence[str]]
Tints = tuple[str, Mapping[str, Rgba]]


@dataclass(slots=True)
class Part:
    """One geom before compilation."""

    geom: Any
    instance: str | None
    texture: str | None
    when: tuple[tuple[str, frozenset[str]], ...]
    tints: tuple[str, tuple[tuple[str, Rgba], ...]] | None
    proxy: bool


@dataclass(slots=True)
class Motion:
    """A joint that follows an attribute of an instance."""

    joint: Any
    instance: str
    attribute: str
    values: tuple[tuple[str, float], ...]


@dataclass(slots=True)
class Kit:
    """Everything that goes into one scene.

    `rng` drives colours and shapes. `fixed` are joints of the knobs, doors and leaves.
    """

    spec: Any
    rng: np.random.Generator
    parts: list[Part] = field(default_factory=list)
    motions: list[Motion] = field(default_factory=list)
    things: list[tuple[str, Any]] = field(default_factory=list)
    meshes: int = 0

    def furniture(self, instance: str | None, body: str, pose: tuple[float, ...]) -> Assembly:
        """A fixed body at (x, y, z, yaw)."""
        x, y, z, yaw = pose
        half = yaw / 2
        made = self.spec.worldbody.add_body(
            name=body, pos=[x, y, z], quat=[float(np.cos(half)), 0, 0, float(np.sin(half))]
        )
        return Assembly(self, made, body, instance)

    def thing(self, instance: str) -> Assembly:
        """A free body."""
        made = self.spec.worldbody.add_body(name=instance)
        made.add_freejoint()
        self.things.append((instance, made))
        return Assembly(self, made, instance, instance)

    def carried(self, body: str) -> Assembly:
        """A body without instance whose pose is written (the robot)."""
        return Assembly(self, self.spec.worldbody.add_body(name=body, mocap=True), body, None)


@dataclass(slots=True)
class Assembly:
    """Adds geoms to one body of one instance, in the body's frame.

    Arguments shared by every shape: `at` its centre, `rgba`, `texture` (one of the renderers'
    textures), `quat`, `when` (attribute → values under which it is seen), `tints` (an attribute
    and its colours), `solid` (whether it collides).
    """

    kit: Kit
    body: Any
    name: str
    instance: str | None

    def box(self, at: Vec, size: Vec, rgba: Rgba, **look: Any) -> None:
        """A box of full edge lengths `size`."""
        half = [max(s / 2, 5e-5) for s in size]
        self._add(mujoco.mjtGeom.mjGEOM_BOX, at, half, rgba, **look)

    def cylinder(self, at: Vec, radius: float, height: float, rgba: Rgba, **look: Any) -> None:
        """A cylinder along z."""
        self._add(mujoco.mjtGeom.mjGEOM_CYLINDER, at, [radius, height / 2, 0], rgba, **look)

    def capsule(self, start: Vec, end: Vec, radius: float, rgba: Rgba, **look: Any) -> None:
        """A capsule between two points."""
        a, b = np.array(start), np.array(end)
        axis = b - a
        length = float(np.linalg.norm(axis))
        direction = axis / length
        turn = np.cross([0, 0, 1.0], direction)
        w = 1 + float(direction[2])
        quat = np.array([w, *turn]) if w > 1e-9 else np.array([0, 1.0, 0, 0])
        quat /= np.linalg.norm(quat)
        at = tuple(((a + b) / 2).tolist())
        look["quat"] = tuple(quat.tolist())
        self._add(mujoco.mjtGeom.mjGEOM_CAPSULE, at, [radius, length / 2, 0], rgba, **look)

    def ellipsoid(self, at: Vec, radii: Vec, rgba: Rgba, **look: Any) -> None:
        """An ellipsoid of the given radii."""
        self._add(mujoco.mjtGeom.mjGEOM_ELLIPSOID, at, list(radii), rgba, **look)

    def mesh(self, mesh: Mesh, rgba: Rgba, *, at: Vec = (0, 0, 0), **look: Any) -> None:
        """Triangles in the body's frame; never collide (add a `proxy`)."""
        name = f"mesh-{self.kit.meshes}"
        self.kit.meshes += 1
        asset = self.kit.spec.add_mesh(
            name=name, uservert=mesh[0].ravel().tolist(), userface=mesh[1].ravel().tolist()
        )
        asset.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        look["solid"] = False
        self._add(mujoco.mjtGeom.mjGEOM_MESH, at, [1, 1, 1], rgba, meshname=name, **look)

    def proxy(self, at: Vec, radius: float, height: float) -> None:
        """An unseen solid cylinder that stands for meshes in collision checks."""
        self._add(
            mujoco.mjtGeom.mjGEOM_CYLINDER, at, [radius, height / 2, 0], (1, 0, 1, 1), proxy=True
        )

    def proxy_box(self, at: Vec, size: Vec, quat: Quat = UPRIGHT) -> None:
        """An unseen solid box that stands for meshes in collision checks."""
        half = [s / 2 for s in size]
        self._add(mujoco.mjtGeom.mjGEOM_BOX, at, half, (1, 0, 1, 1), proxy=True, quat=quat)

    def swinging(
        self, tag: str, at: Vec, axis: Vec, attribute: str, values: Mapping[str, float], **of: Any
    ) -> Assembly:
        """A child body on a hinge through `at`; it follows an attribute (radians)."""
        return self._moving("hinge", tag, at, axis, attribute, values, **of)

    def sliding(
        self, tag: str, at: Vec, axis: Vec, attribute: str, values: Mapping[str, float], **of: Any
    ) -> Assembly:
        """A child body on a slide; it follows an attribute (metres)."""
        return self._moving("slide", tag, at, axis, attribute, values, **of)

    def _moving(
        self,
        kind: str,
        tag: str,
        at: Vec,
        axis: Vec,
        attribute: str,
        values: Mapping[str, float],
        follows: str | None = None,
    ) -> Assembly:
        name = f"{self.name}/{tag}"
        body = self.body.add_body(name=name, pos=list(at))
        joints = {"hinge": mujoco.mjtJoint.mjJNT_HINGE, "slide": mujoco.mjtJoint.mjJNT_SLIDE}
        joint = body.add_joint(name=name, type=joints[kind], axis=list(axis))
        owner = follows or self.instance
        if owner is not None:
            self.kit.motions.append(Motion(joint, owner, attribute, tuple(values.items())))
        return Assembly(self.kit, body, name, self.instance)

    def _add(
        self,
        kind: Any,
        at: Vec,
        size: Sequence[float],
        rgba: Rgba,
        *,
        texture: str | None = None,
        quat: Quat = UPRIGHT,
        when: When | None = None,
        tints: Tints | None = None,
        solid: bool = True,
        proxy: bool = False,
        instance: str | None = None,
        **extra: Any,
    ) -> None:
        bit = int(solid)
        geom = self.body.add_geom(
            type=kind,
            pos=list(at),
            size=list(size),
            rgba=list(rgba),
            quat=list(quat),
            contype=bit,
            conaffinity=bit,
            group=PROXY if proxy else SHOWN,
            **extra,
        )
        conditions = tuple(sorted((a, frozenset(v)) for a, v in (when or {}).items()))
        colours = (tints[0], tuple(sorted(tints[1].items()))) if tints else None
        owner = instance or self.instance
        self.kit.parts.append(Part(geom, owner, texture, conditions, colours, proxy))


@dataclass(frozen=True, slots=True, eq=False)
class Compiled:
    """A compiled scene with tables from instances to geoms and joints.

    Args:
        model: MuJoCo model.
        appearance: what the renderers need.
        shown_when: instance → ((geom, conditions), ...) of every geom that is not a proxy.
        tints: instance → ((geom, attribute, value → rgba), ...).
        motions: (instance, attribute) → ((qpos address, body, value → position), ...).
        free: thing → address of its free joint in qpos.
        proxies: geoms that only stand for others in collision checks.
    """

    model: Any
    appearance: Appearance
    shown_when: Mapping[str, tuple[tuple[int, tuple[tuple[str, frozenset[str]], ...]], ...]]
    tints: Mapping[str, tuple[tuple[int, str, Mapping[str, Rgba]], ...]]
    motions: Mapping[tuple[str, str], tuple[tuple[int, int, Mapping[str, float]], ...]]
    free: Mapping[str, int]
    proxies: frozenset[int]


def compile_kit(kit: Kit) -> Compiled:
    """Compile the scene."""
    model = kit.spec.compile()
    names = tuple(sorted({p.instance for p in kit.parts if p.instance is not None}))
    index = {name: i for i, name in enumerate(names)}
    geom_instance = np.full(model.ngeom, -1, dtype=np.int32)
    texture: list[str | None] = [None] * model.ngeom
    shown: dict[str, list[tuple[int, tuple[tuple[str, frozenset[str]], ...]]]] = {}
    tints: dict[str, list[tuple[int, str, Mapping[str, Rgba]]]] = {}
    for part in kit.parts:
        geom = int(part.geom.id)
        texture[geom] = part.texture
        if part.instance is None:
            continue
        geom_instance[geom] = index[part.instance]
        if not part.proxy:
            shown.setdefault(part.instance, []).append((geom, part.when))
        if part.tints is not None:
            attribute, colours = part.tints
            tints.setdefault(part.instance, []).append((geom, attribute, dict(colours)))
    motions: dict[tuple[str, str], list[tuple[int, int, Mapping[str, float]]]] = {}
    for motion in kit.motions:
        joint = int(motion.joint.id)
        entry = (int(model.jnt_qposadr[joint]), int(model.jnt_bodyid[joint]), dict(motion.values))
        motions.setdefault((motion.instance, motion.attribute), []).append(entry)
    free = {
        name: int(model.jnt_qposadr[model.body_jntadr[int(body.id)]]) for name, body in kit.things
    }
    return Compiled(
        model=model,
        appearance=Appearance(names, geom_instance, tuple(texture)),
        shown_when={k: tuple(v) for k, v in shown.items()},
        tints={k: tuple(v) for k, v in tints.items()},
        motions={k: tuple(v) for k, v in motions.items()},
        free=free,
        proxies=frozenset(int(p.geom.id) for p in kit.parts if p.proxy),
    )
