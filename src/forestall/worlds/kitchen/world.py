"""The household's geometry as the skills see it: `KitchenWorld` implements `World`.

Skills and the environment call it; it calls `bodies` (poses and looks), `spots` (free spots)
and `navigation` (standing places). It knows places and looks, no rules of the household.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from forestall.errors import SceneError
from forestall.types.observation import Vec3
from forestall.worlds.kitchen import navigation, spots
from forestall.worlds.kitchen.bodies import Bodies, Snapshot
from forestall.worlds.kitchen.forms import (
    FLOOR,
    Float,
    Instance,
    Pose,
    Rect,
    Region,
    Stance,
    inverse,
    pose_at,
    yaw_of,
)
from forestall.worlds.kitchen.navigation import EYE_HEIGHT_M, Floor, Standing
from forestall.worlds.kitchen.placement import (
    BLOCKING_HEIGHT_M,
    LEVELS,
    REST_M,
    Rules,
    Score,
    footprint_at,
)
from forestall.worlds.kitchen.rendering.appearance import Appearance
from forestall.worlds.kitchen.spots import YAWS, Found

HAND_M = (0.45, -0.21, EYE_HEIGHT_M - 0.45)
"""Where the hand is: forward and left (here: right) of the robot's axis, and above the floor."""

BLOCKING_WAY_M = 0.25


class KitchenWorld:
    """A room with its furniture, things and robot.

    Args:
        bodies: poses and looks.
        floor: the room's floor with the furniture on it.
        start: where the robot starts.
        decks: instance standing on a counter → that counter.
    """

    def __init__(
        self, bodies: Bodies, floor: Floor, start: Standing, decks: Mapping[str, str]
    ) -> None:
        self.bodies = bodies
        self.model: Any = bodies.model
        self.data: Any = bodies.data
        self.appearance: Appearance = bodies.compiled.appearance
        self.instances: tuple[Instance, ...] = ()
        self.held_name: str | None = None
        self._floor = floor
        self._decks = dict(decks)
        self._robot = start
        self._start = start
        self._snapshot: Snapshot | None = None
        bodies.place_robot(start.x, start.y, start.yaw_rad)

    # start state

    def freeze(self, instances: Sequence[Instance]) -> None:
        """Make the present state the one that `reset` goes back to."""
        self.instances = tuple(instances)
        self._snapshot = self.bodies.snapshot()
        self._start = self._robot

    def reset(self) -> None:
        """Go back to the start state, bit for bit."""
        if self._snapshot is None:
            raise SceneError("the scene was not finished: freeze() comes before reset()")
        self.held_name = None
        self._stand(self._start)
        self.bodies.restore(self._snapshot)

    # the robot

    @property
    def robot_position_world_m(self) -> Vec3:
        """The robot's axis on the floor."""
        return (self._robot.x, self._robot.y, 0.0)

    @property
    def robot_yaw_rad(self) -> float:
        """Heading of the robot's base, counter-clockwise from +x."""
        return self._robot.yaw_rad

    @property
    def eye_world_m(self) -> Float:
        """The head camera's place."""
        return self._robot.local_to_world(0, 0, EYE_HEIGHT_M)

    @property
    def gripper_position_world_m(self) -> Vec3:
        """Where the hand is."""
        x, y, z = self._robot.local_to_world(*HAND_M).tolist()
        return (x, y, z)

    def camera_to_world(self, pan_rad: float = 0.0, tilt_rad: float = 0.52) -> Pose:
        """Head camera: a positive pan turns left, a positive tilt down; both are limited."""
        pan = float(np.clip(pan_rad, -navigation.PAN_LIMIT_RAD, navigation.PAN_LIMIT_RAD))
        tilt = float(np.clip(tilt_rad, *navigation.TILT_LIMITS_RAD))
        return navigation.camera(self.eye_world_m, self._robot.yaw_rad + pan, tilt)

    def look_at(self, point: Sequence[float]) -> Pose:
        """Head camera turned towards a world point as far as the neck allows."""
        way = np.asarray(point, dtype=np.float64) - self.eye_world_m
        pan = navigation.wrapped(float(np.arctan2(way[1], way[0])) - self._robot.yaw_rad)
        tilt = float(np.arctan2(-way[2], np.hypot(way[0], way[1])))
        return self.camera_to_world(pan, tilt)

    def drive_to(self, name: str) -> float:
        """Drive to where `name` can be reached and face it; returns the simulated seconds."""
        if name in (FLOOR, self.held_name):
            return 0.0
        goal = self.standing_for(name)
        if goal is None:
            return 0.0
        return self.go_to(goal)

    def turn_to(self, yaw_rad: float) -> float:
        """Turn on the spot to a heading; returns the simulated seconds."""
        return self.go_to(Standing(self._robot.x, self._robot.y, yaw_rad))

    def go_to(self, goal: Standing) -> float:
        """Drive to a pose; returns the simulated seconds."""
        seconds = self._robot.seconds_to(goal)
        self._stand(goal)
        return seconds

    def lookouts(self, point: Vec3) -> list[Vec3]:
        """See `stage.Roving`."""
        return navigation.lookouts(self._free_floor(), self._robot, point)

    def look_from(self, place: Vec3, point: Vec3) -> float:
        """See `stage.Roving`."""
        x, y, _ = place
        return self.go_to(Standing(x, y, float(np.arctan2(point[1] - y, point[0] - x))))

    def standing_for(self, name: str) -> Standing | None:
        """Where the robot stands to work at something; None when there is no place."""
        target, places = self._approach(name)
        floor = self._free_floor(without=self.bodies.base(name))
        seen_as = self._seen_as(name)
        points = navigation.sight_points(*self.bodies.box(seen_as))
        wanted = frozenset({seen_as, name, *self.bodies.descendants(seen_as)})
        needed = 0.5 if self.bodies.is_thing(seen_as) else 0.15
        best: tuple[float, Standing] | None = None
        tried = 0
        for x, y in places:
            if not floor.free(x, y):
                continue
            here = Standing(x, y, float(np.arctan2(target[1] - y, target[0] - x)))
            hits = self.bodies.glance(here.local_to_world(0, 0, EYE_HEIGHT_M), points)
            if self.held_name is not None:
                hits = [seen_as if h == self.held_name else h for h in hits]
            seen = navigation.share(hits, wanted)
            if seen >= needed:
                return here
            if best is None or seen > best[0]:
                best = (seen, here)
            tried += 1
            if tried > 60:
                break
        return best[1] if best else None

    @property
    def standing(self) -> Standing:
        """Where the robot stands."""
        return self._robot

    def connected(self, a: Standing, b: Standing) -> bool:
        """Whether the robot can drive from one place to another."""
        return self._free_floor().connected((a.x, a.y), (b.x, b.y))

    def _seen_as(self, name: str) -> str:
        """The outermost closed thing around `name`, else `name`."""
        shown, at = name, self.bodies.parents.get(name)
        while at is not None:
            if self.bodies.states.get(at, {}).get("open") == "closed":
                shown = at
            at = self.bodies.parents.get(at)
        return shown

    def _approach(self, name: str) -> tuple[Float, list[tuple[float, float]]]:
        """What the robot faces and where it may stand."""
        root = self.bodies.root(name)
        if root == FLOOR or (root == name and self.bodies.is_thing(name)):
            x, y, _ = self.bodies.centre(self.bodies.base(name))
            near = (self._robot.x, self._robot.y)
            return np.array([x, y]), navigation.around(x, y, near)
        form, frame = self.bodies.forms[root], self.bodies.pose(root)
        stance = form.stance or Stance(form.footprint.y1)
        if root == name:
            x = form.middle_x
            y = (form.footprint.y0 + form.footprint.y1) / 2
            local = np.array([x, y, 0, 1.0])
            target = (frame @ local)[:2]
        else:
            at = np.array([*self.bodies.centre(name), 1.0])
            target = at[:2]
            x = float((inverse(frame) @ at)[0])
        return target, navigation.before(frame, stance, x)

    def _free_floor(self, without: str = "") -> Floor:
        lying = [
            footprint_at(self.bodies.forms[n], self.bodies.pose(n))
            for n in sorted(self.bodies.parents)
            if self.bodies.parents[n] == FLOOR and n != without
        ]
        return Floor(
            self._floor.area,
            (*self._floor.obstacles, *self.bodies.swung_rects(), *lying),
        )

    def _stand(self, at: Standing) -> None:
        self._robot = at
        self.bodies.place_robot(at.x, at.y, at.yaw_rad)
        if self.held_name is not None:
            self.bodies.move(self.held_name, self._hand_pose(self.held_name))

    def within_reach(self, name: str) -> bool:
        """Whether `name` can be reached from where the robot stands."""
        if name == self.held_name or self.bodies.root(name) == self.held_name:
            return True
        return self.reachable_from(self._robot, name)

    def reachable_from(self, standing: Standing, name: str) -> bool:
        """Whether `name` could be reached from a standing place."""
        return navigation.in_reach(standing, *self.bodies.box(name))

    # what stands in the way

    def blocker(self, name: str) -> str | None:
        """What stands between the robot's hand and `name` on the same support, if anything."""
        thing = self.bodies.base(name)
        parent = self.bodies.parents.get(thing) or self._decks.get(thing)
        if parent is None or parent == FLOOR:
            return None
        found = self.bodies.region_of(thing)
        region, index = found if found is not None else (self.bodies.forms[parent].regions[0], 0)
        if region.front_m is None:
            return None
        local = inverse(self.bodies.pose(region.carrier)) @ self.bodies.pose(thing)
        rect = footprint_at(self.bodies.forms[thing], local)
        margin = 0.2 * rect.size[0]
        end = min(region.front_m, rect.y1 + BLOCKING_WAY_M)
        way = Rect(rect.x0 + margin, rect.y1, rect.x1 - margin, end)
        front = sorted(
            (o.rect.y0, o.name)
            for o in self.bodies.occupants(region, index, without=thing)
            if o.height_m >= BLOCKING_HEIGHT_M and o.rect.overlaps(way)
        )
        return front[0][1] if front else None

    # putting things somewhere

    def has_room(self, thing: str, receptacle: str) -> bool:
        """Whether there is a free spot for `thing` on or in `receptacle`."""
        return self.find_spot(thing, receptacle) is not None

    def has_clear_room(self, thing: str, receptacle: str) -> bool:
        """Whether `thing` finds a spot where it blocks nothing and nothing blocks it."""
        return self.find_spot(thing, receptacle, levels=LEVELS[:1]) is not None

    def find_spot(
        self,
        thing: str,
        receptacle: str,
        *,
        levels: Sequence[Rules] = LEVELS,
        near: Float | None = None,
        yaws: Sequence[float] = YAWS,
        score: Score | None = None,
    ) -> Found | None:
        """The best free spot; the arguments are those of `spots.find`."""
        if receptacle == FLOOR:
            return spots.on_floor(
                self.bodies, self._free_floor(without=thing), self._robot, thing, near
            )
        here = np.array(self.robot_position_world_m)
        return spots.find(
            self.bodies,
            thing,
            receptacle,
            here=here,
            levels=levels,
            near=near,
            yaws=yaws,
            score=score,
        )

    def place(self, thing: str, receptacle: str) -> None:
        """Put `thing` at a free spot on or in `receptacle`, or raise SceneError."""
        found = self.find_spot(thing, receptacle)
        if found is None:
            raise SceneError(f"{receptacle} has no room for {thing}")
        self.settle(thing, *found)

    def settle(self, thing: str, region: Region, index: int, local: Pose) -> None:
        """Put a thing at a spot that was found."""
        if self.held_name == thing:
            self.held_name = None
        self.bodies.attach(thing, region, index, local)

    def hold(self, thing: str) -> None:
        """Move `thing` (with what is attached to it) into the gripper."""
        self.bodies.detach(thing)
        self.held_name = thing
        self.bodies.move(thing, self._hand_pose(thing))

    def _hand_pose(self, thing: str) -> Pose:
        """Upright in the hand, its front to the robot; long things point forward."""
        form = self.bodies.forms[thing]
        wide, deep = form.footprint.size
        turn = np.pi / 2 if not wide > 2.5 * deep else 0.0
        yaw = self._robot.yaw_rad + turn
        x, y, z = self.gripper_position_world_m
        middle = form.footprint.turned(yaw).centre
        return pose_at(x - middle[0], y - middle[1], z - min(form.height_m / 2, 0.08), yaw)

    def drop(self, thing: str) -> None:
        """Let `thing` (with what is attached to it) fall from the gripper to the floor nearby."""
        found = self.find_spot(thing, FLOOR)
        if found is None:
            raise SceneError(f"there is no free floor near the robot for {thing}")
        self.settle(thing, *found)

    # looks and replacement

    def show(self, name: str, attribute: str, value: str) -> None:
        """Make a state visible (door angle, liquid, dirt, glow, ...); unknown pairs are ignored."""
        self.bodies.show(name, attribute, value)

    def replace(self, old: str, new: Sequence[str]) -> None:
        """Take `old` away and put prepared things (its slices, its cracked egg) at its place."""
        where = self.bodies.region_of(old)
        pose = self.bodies.pose(old)
        was_held = self.held_name == old
        if was_held:
            self.held_name = None
        self.bodies.remove(old)
        for k, name in enumerate(new):
            if where is None:
                self._replace_in_hand(name, pose, first=k == 0 and was_held)
                continue
            region, _ = where
            found = self.find_spot(name, region.receptacle, near=pose[:3, 3])
            if found is None:
                index = where[1]
                local = inverse(self.bodies.pose(region.carrier)) @ pose
                x, y = float(local[0, 3]), float(local[1, 3])
                lift = sum(self.bodies.forms[n].height_m + REST_M for n in new[:k])
                z = region.z_m + REST_M + lift
                found = (region, index, pose_at(x, y, z, yaw_of(local)))
            self.settle(name, *found)

    def _replace_in_hand(self, name: str, pose: Pose, first: bool) -> None:
        self.bodies.appear(name)
        if first:
            self.hold(name)
            return
        found = self.find_spot(name, FLOOR, near=pose[:3, 3])
        if found is not None:
            self.settle(name, *found)

    def position_world_m(self, name: str) -> Vec3 | None:
        """Middle of what is seen of an instance; None when it is not there."""
        box = self.box_world_m(name)
        if box is None:
            return None
        (a, b, c), (d, e, f) = box
        return ((a + d) / 2, (b + e) / 2, (c + f) / 2)

    def box_world_m(self, name: str) -> tuple[Vec3, Vec3] | None:
        """Low and high corner of what is seen of an instance; None when it is not there."""
        if name not in self.bodies.present:
            return None
        low, high = self.bodies.box(name)
        a, b = low.tolist(), high.tolist()
        return (a[0], a[1], a[2]), (b[0], b[1], b[2])
