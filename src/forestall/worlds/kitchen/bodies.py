"""Where everything is and how it looks: poses, attachments and state geoms of a compiled scene.

The kinematic layer under `world`: it writes joints and geom properties and knows no rules.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from forestall.worlds.kitchen.assembly import HIDDEN, SHOWN, Compiled
from forestall.worlds.kitchen.forms import Float, Form, Pose, Rect, Region, Vec, inverse
from forestall.worlds.kitchen.placement import Occupant, footprint_at

PARKED_Z_M = -6.0

SIGHT_GROUPS = np.array([1, 1, 0, 0, 0, 0], dtype=np.uint8)
"""Geom groups that stop a glance: everything drawn but the robot."""


@dataclass(slots=True)
class Snapshot:
    """Everything that changes while a scene runs."""

    qpos: Float
    mocap: Float
    group: Any
    rgba: Any
    parents: dict[str, str | None]
    regions: dict[str, int]
    states: dict[str, dict[str, str]]
    present: set[str]


class Bodies:
    """Poses, parents and looks.

    Args:
        compiled: model and tables.
        forms: extents of every fixture and thing.
        states: start states of every instance.
    """

    def __init__(
        self, compiled: Compiled, forms: Mapping[str, Form], states: Mapping[str, dict[str, str]]
    ) -> None:
        self.compiled = compiled
        self.model = compiled.model
        self.data = mujoco.MjData(self.model)
        self.forms = forms
        self.parents: dict[str, str | None] = {}
        self._regions: dict[str, int] = {}
        self.states = {name: dict(values) for name, values in states.items()}
        self._between: set[tuple[str, str]] = set()
        self.present: set[str] = {n for n in forms if n not in compiled.free}
        self._body = {self.model.body(b).name: b for b in range(self.model.nbody)}
        self._instance_geoms: dict[str, list[int]] = {}
        for geom, index in enumerate(compiled.appearance.geom_instance.tolist()):
            if index >= 0:
                name = compiled.appearance.instance_names[index]
                self._instance_geoms.setdefault(name, []).append(geom)
        for k, name in enumerate(compiled.free):
            self._write(name, self._parked(k))
        self._parking = {name: k for k, name in enumerate(compiled.free)}
        for name in self.states:
            self._apply(name)
            for attribute in self.states[name]:
                self._turn(name, attribute)
        self.refresh()

    def refresh(self) -> None:
        """Bring derived positions up to date."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    # poses

    def pose(self, body: str) -> Pose:
        """World pose of a body."""
        out = np.eye(4)
        index = self._body[body]
        out[:3, :3] = self.data.xmat[index].reshape(3, 3)
        out[:3, 3] = self.data.xpos[index]
        return out

    def descendants(self, name: str) -> list[str]:
        """What is on or in a thing, and on or in that."""
        found, front = [], [name]
        while front:
            front = sorted(n for n, p in self.parents.items() if p in front)
            found += front
        return found

    def root(self, name: str) -> str:
        """The fixture (or thing without parent) that carries a thing in the end."""
        while (parent := self.parents.get(name)) is not None:
            name = parent
        return name

    def base(self, name: str) -> str:
        """The thing that carries `name` and itself lies on a fixture; `name` if it does so."""
        while (parent := self.parents.get(name)) is not None and parent in self.compiled.free:
            name = parent
        return name

    def move(self, name: str, pose: Pose) -> None:
        """Move a thing with what is attached to it."""
        change = pose @ inverse(self.pose(name))
        moves = [(n, change @ self.pose(n)) for n in self.descendants(name)]
        self._write(name, pose)
        for other, at in moves:
            self._write(other, at)
        self.refresh()

    def attach(self, name: str, region: Region, index: int, local: Pose) -> None:
        """Put a thing into a region at a pose in its carrier's frame."""
        self.appear(name)
        self.parents.pop(name, None)
        self.move(name, self.pose(region.carrier) @ local)
        self.parents[name] = region.receptacle
        self._regions[name] = index

    def appear(self, name: str) -> None:
        """Show a thing that was not there."""
        self.present.add(name)
        self._apply(name)

    def detach(self, name: str) -> None:
        """Let a thing be carried by nothing."""
        self.parents.pop(name, None)
        self._regions.pop(name, None)

    def remove(self, name: str) -> None:
        """Take a thing out of the scene."""
        self.detach(name)
        self.present.discard(name)
        self._apply(name)
        self._write(name, self._parked(self._parking[name]))
        self.refresh()

    def occupants(self, region: Region, index: int, without: str = "") -> list[Occupant]:
        """What lies in a region, in its carrier's frame."""
        to_local = inverse(self.pose(region.carrier))
        found = []
        for name in sorted(self.parents):
            if self.parents[name] != region.receptacle or self._regions.get(name) != index:
                continue
            if name == without:
                continue
            form = self.forms[name]
            local = to_local @ self.pose(name)
            flat = abs(local[2, 2]) > 0.5
            found.append(
                Occupant(
                    name,
                    footprint_at(form, local),
                    form.height_m if flat else form.footprint.size[1],
                    float(local[2, 3]) - region.z_m,
                    form.core_m,
                )
            )
        return found

    def region_of(self, name: str) -> tuple[Region, int] | None:
        """The region in which a thing lies."""
        parent, index = self.parents.get(name), self._regions.get(name)
        if parent is None or index is None:
            return None
        return self.forms[parent].regions[index], index

    def _parked(self, k: int) -> Pose:
        out = np.eye(4)
        out[:3, 3] = (k % 12, k // 12, PARKED_Z_M)
        return out

    def _write(self, name: str, pose: Pose) -> None:
        start = self.compiled.free[name]
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, np.ascontiguousarray(pose[:3, :3]).ravel())
        self.data.qpos[start : start + 3] = pose[:3, 3]
        self.data.qpos[start + 3 : start + 7] = quat

    # looks

    def show(self, name: str, attribute: str, value: str) -> None:
        """Set a state and make it visible; unknown pairs are ignored."""
        known = self.states.get(name)
        if known is None or attribute not in known:
            return
        if known[attribute] == value and (name, attribute) not in self._between:
            return
        known[attribute] = value
        self._between.discard((name, attribute))
        self._apply(name)
        self._move_joints(name, attribute)

    def leave_between(self, name: str, attribute: str, towards: str, share: float) -> None:
        """Leave the joints of an attribute a share of the way from its state to another value."""
        if attribute in self.states.get(name, {}):
            self._between.add((name, attribute))
            self._move_joints(name, attribute, towards, share)

    def _move_joints(
        self, name: str, attribute: str, towards: str | None = None, share: float = 0.0
    ) -> None:
        carried = self._turn(name, attribute, towards, share)
        self.refresh()
        for thing, body, local in carried:
            self.move(thing, self.pose(body) @ local)

    def _turn(
        self, name: str, attribute: str, towards: str | None = None, share: float = 0.0
    ) -> list[tuple[str, str, Pose]]:
        """Move the joints of an attribute; what must follow: (thing, body, pose in body)."""
        follow: list[tuple[str, str, Pose]] = []
        for address, body, values in self.compiled.motions.get((name, attribute), ()):
            value = values.get(self.states[name][attribute])
            if value is None:
                continue
            if towards is not None:
                value += share * (values.get(towards, value) - value)
            carrier = self.model.body(body).name
            for k, region in enumerate(self.forms[name].regions):
                if region.carrier != carrier:
                    continue
                to_local = inverse(self.pose(carrier))
                follow += [
                    (o.name, carrier, to_local @ self.pose(o.name))
                    for o in self.occupants(region, k)
                ]
            self.data.qpos[address] = value
        return follow

    def _apply(self, name: str) -> None:
        states = self.states.get(name, {})
        there = name in self.present
        for geom, conditions in self.compiled.shown_when.get(name, ()):
            seen = there and all(states.get(a) in values for a, values in conditions)
            self.model.geom_group[geom] = SHOWN if seen else HIDDEN
        for geom, attribute, colours in self.compiled.tints.get(name, ()):
            rgba = colours.get(states.get(attribute, ""))
            if rgba is not None:
                self.model.geom_rgba[geom] = rgba

    # measures

    def box(self, name: str) -> tuple[Float, Float]:
        """Low and high corner of what is seen of an instance, in the world."""
        geoms = [g for g in self._instance_geoms.get(name, ()) if self.model.geom_group[g] < 3]
        if not geoms:
            at = self.pose(name)[:3, 3] if name in self._body else np.zeros(3)
            return at.copy(), at.copy()
        return self._bounds(geoms)

    def _bounds(self, geoms: list[int]) -> tuple[Float, Float]:
        aabb = self.model.geom_aabb[geoms]
        turn = self.data.geom_xmat[geoms].reshape(-1, 3, 3)
        centre = np.einsum("nij,nj->ni", turn, aabb[:, :3]) + self.data.geom_xpos[geoms]
        half = np.einsum("nij,nj->ni", np.abs(turn), aabb[:, 3:])
        return (centre - half).min(axis=0), (centre + half).max(axis=0)

    def swung_rects(self) -> list[Rect]:
        """Floor under doors and drawers that stick out where the robot stands."""
        rects = []
        for name, attribute in sorted(self.compiled.motions):
            if attribute != "open" or name in self.compiled.free:
                continue
            if self.states[name]["open"] == "closed":
                continue
            for _, body, _ in self.compiled.motions[name, attribute]:
                first, count = self.model.body_geomadr[body], self.model.body_geomnum[body]
                low, high = self._bounds(list(range(int(first), int(first + count))))
                if low[2] < 1.3:
                    rects.append(Rect(float(low[0]), float(low[1]), float(high[0]), float(high[1])))
        return rects

    def glance(self, eye: Float, targets: Float) -> list[str | None]:
        """What is hit first from the eye towards each target (n, 3), up to a little beyond it."""
        hits: list[str | None] = []
        names = self.compiled.appearance.instance_names
        for target in targets:
            way = target - eye
            geom = np.full(1, -1, dtype=np.int32)
            far = mujoco.mj_ray(self.model, self.data, eye, way, SIGHT_GROUPS, 1, -1, geom)
            index = -1
            if far >= 0 and geom[0] >= 0:
                index = int(self.compiled.appearance.geom_instance[int(geom[0])])
            hits.append(names[index] if index >= 0 else None)
        return hits

    # snapshots

    def snapshot(self) -> Snapshot:
        """Copy everything that changes."""
        return Snapshot(
            self.data.qpos.copy(),
            self.data.mocap_pos.copy(),
            self.model.geom_group.copy(),
            self.model.geom_rgba.copy(),
            dict(self.parents),
            dict(self._regions),
            {name: dict(values) for name, values in self.states.items()},
            set(self.present),
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot."""
        self.data.qpos[:] = snapshot.qpos
        self.model.geom_group[:] = snapshot.group
        self.model.geom_rgba[:] = snapshot.rgba
        self.parents = dict(snapshot.parents)
        self._regions = dict(snapshot.regions)
        self.states = {name: dict(values) for name, values in snapshot.states.items()}
        self.present = set(snapshot.present)
        self._between.clear()
        self.refresh()

    def place_robot(self, x: float, y: float, yaw_rad: float) -> None:
        """Write the pose of the robot's body."""
        self.data.mocap_pos[0] = (x, y, 0.0)
        self.data.mocap_quat[0] = (np.cos(yaw_rad / 2), 0, 0, np.sin(yaw_rad / 2))
        self.refresh()

    def is_thing(self, name: str) -> bool:
        """Whether a name is a movable thing (prepared ones included)."""
        return name in self.compiled.free

    def centre(self, name: str) -> Vec:
        """Middle of the box of an instance."""
        low, high = self.box(name)
        x, y, z = ((low + high) / 2).tolist()
        return (x, y, z)
