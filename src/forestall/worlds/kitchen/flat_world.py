"""A household without geometry: the `World` as a row of stations, for tests of the rules.

Every fixture is a station one metre from the next; what lies on or in it shares its place. Nothing
is simulated and no simulator is imported. It is strict where the real world would be: placing
where there is no room, or moving what is not there, is an error and not a shrug.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.domain.model import Domain
from forestall.errors import SceneError
from forestall.types.facts import category_of
from forestall.types.observation import Frame, Intrinsics, Vec3
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.catalogue import Catalogue
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.imperfection import Rates
from forestall.worlds.kitchen.law import Way
from forestall.worlds.kitchen.needs import roomed

REACH_M = 0.8
SPEED_M_PER_S = 0.25
FLOOR = "Floor-1"

_ROOMS: dict[str, dict[str, int]] = {
    "kitchen": {
        "CounterTop": 3,
        "DiningTable": 1,
        "Sink": 1,
        "Faucet": 1,
        "Fridge": 1,
        "Microwave": 1,
        "CoffeeMachine": 1,
        "Toaster": 1,
        "StoveBurner": 4,
        "StoveKnob": 4,
        "Cabinet": 2,
        "Drawer": 1,
        "GarbageCan": 1,
        "Floor": 1,
    },
    "living-room": {
        "TVStand": 1,
        "Television": 1,
        "FloorLamp": 1,
        "DiningTable": 1,
        "Shelf": 1,
        "Floor": 1,
    },
}


@dataclass(frozen=True, slots=True)
class FlatInstance:
    """One instance of a flat scene; the fields are those of any scene builder."""

    name: str
    category: str
    parent: str | None = None
    states: tuple[tuple[str, str], ...] = ()
    prepared: bool = False


@dataclass(frozen=True, slots=True)
class FlatScene:
    """Everything that a flat world starts from.

    Args:
        instances: all things, prepared ones included.
        blocked: thing → what stands in front of it, while both are on the same support.
        spots: receptacle → how many things have room (8 where nothing is said).
        crowded: receptacles where everything new stands in something's way.
    """

    instances: tuple[FlatInstance, ...]
    blocked: Mapping[str, str] = field(default_factory=dict)
    spots: Mapping[str, int] = field(default_factory=dict)
    crowded: frozenset[str] = frozenset()


class FlatWorld:
    """`World` on a row of stations, with the camera calls that the environment needs."""

    model: Any = None
    appearance: Any = None

    def __init__(self, scene: FlatScene) -> None:
        self.scene = scene
        self.instances = scene.instances
        fixtures = [i.name for i in scene.instances if i.parent is None and not i.prepared]
        self._stations = {name: float(k) for k, name in enumerate(fixtures)}
        self._robot_x_m = -1.0
        self._yaw_rad = math.pi / 2
        self.shown: list[tuple[str, str, str]] = []
        self._parents: dict[str, str | None] = {}
        self._lying_x_m: dict[str, float] = {}
        self._held: str | None = None
        self.reset()

    @property
    def data(self) -> FlatWorld:
        """What the flat renderer draws."""
        return self

    def reset(self) -> None:
        """Everything back to the start of the scene."""
        self._parents = {i.name: i.parent for i in self.instances if not i.prepared}
        self._lying_x_m = {}
        self._held = None
        self._robot_x_m, self._yaw_rad = -1.0, math.pi / 2
        self.shown = []

    def x_m(self, name: str) -> float:
        """Where a thing is on the row."""
        if name not in self._parents:
            raise SceneError(f"{name} is not in the flat scene")
        if name in (self._held, FLOOR):
            return self._robot_x_m
        if name in self._lying_x_m:
            return self._lying_x_m[name]
        parent = self._parents[name]
        return self._stations[name] if parent is None else self.x_m(parent)

    def present(self) -> list[str]:
        """Every thing that is there now, in order."""
        return sorted(self._parents)

    # World

    def drive_to(self, name: str) -> float:
        """Drive along the row; one second for every 0.25 m and one for the turn."""
        x = self.x_m(name)
        distance = abs(x - self._robot_x_m)
        self._robot_x_m = x
        return distance / SPEED_M_PER_S + 1.0 if distance else 0.0

    def within_reach(self, name: str) -> bool:
        """Whether a thing is nearer than an arm's length."""
        return abs(self.x_m(name) - self._robot_x_m) < REACH_M

    def blocker(self, name: str) -> str | None:
        """What the scene put in front, as long as both stay on the same support."""
        front = self.scene.blocked.get(name)
        if front is None or front not in self._parents or name not in self._parents:
            return None
        support = self._parents[name]
        return front if support is not None and self._parents[front] == support else None

    def has_room(self, thing: str, receptacle: str) -> bool:
        """Whether a spot of the receptacle is free."""
        on_it = [n for n, p in self._parents.items() if p == receptacle and n != thing]
        return len(on_it) < self.scene.spots.get(receptacle, 8)

    def has_clear_room(self, thing: str, receptacle: str) -> bool:
        """Whether a spot is free on a receptacle that is not crowded."""
        return receptacle not in self.scene.crowded and self.has_room(thing, receptacle)

    def place(self, thing: str, receptacle: str) -> None:
        """Attach a thing to a receptacle."""
        if thing not in self._parents or receptacle not in self._parents:
            raise SceneError(f"cannot place {thing} on {receptacle}: not in the flat scene")
        if not self.has_room(thing, receptacle):
            raise SceneError(f"{receptacle} has no room for {thing}")
        self._parents[thing] = receptacle
        self._lying_x_m.pop(thing, None)
        if receptacle == FLOOR:
            self._lying_x_m[thing] = self._robot_x_m
        if self._held == thing:
            self._held = None

    def hold(self, thing: str) -> None:
        """Put a thing into the gripper."""
        if self._held is not None:
            raise SceneError(f"cannot hold {thing}: the hand is full")
        self._parents[thing] = None
        self._lying_x_m.pop(thing, None)
        self._held = thing

    def drop(self, thing: str) -> None:
        """Let the held thing fall to the floor."""
        if self._held != thing:
            raise SceneError(f"cannot drop {thing}: it is not held")
        self._held = None
        self._parents[thing] = FLOOR
        self._lying_x_m[thing] = self._robot_x_m

    def show(self, name: str, attribute: str, value: str) -> None:
        """Remember what would be visible."""
        self.shown.append((name, attribute, value))

    def replace(self, old: str, new: Sequence[str]) -> None:
        """Put prepared things where `old` was; what was held ends on the floor."""
        if old not in self._parents:
            raise SceneError(f"cannot replace {old}: not in the flat scene")
        x = self.x_m(old)
        parent = self._parents.pop(old)
        if self._held == old:
            self._held, parent = None, FLOOR
        self._lying_x_m.pop(old, None)
        for name in new:
            self._parents[name] = parent
            if parent == FLOOR:
                self._lying_x_m[name] = x

    # what the environment asks for beyond `World`

    @property
    def robot_position_world_m(self) -> Vec3:
        """The robot stands half a metre before the row."""
        return (self._robot_x_m, -0.5, 0.0)

    @property
    def robot_yaw_rad(self) -> float:
        """The robot faces the row until it is turned."""
        return self._yaw_rad

    def turn_to(self, yaw_rad: float) -> float:
        """Turn on the spot; one second for every quarter."""
        turned = abs(yaw_rad - self._yaw_rad)
        self._yaw_rad = yaw_rad
        return turned / (math.pi / 2)

    @property
    def gripper_position_world_m(self) -> Vec3:
        """The hand is in front of the robot."""
        return (self._robot_x_m, -0.2, 1.0)

    def camera_to_world(self, pan_rad: float, tilt_rad: float) -> npt.NDArray[np.float64]:
        """A camera 1.5 m high, turned by pan (left positive) and tilt (down positive)."""
        yaw = self._yaw_rad + pan_rad
        forward = np.array(
            [np.cos(yaw) * np.cos(tilt_rad), np.sin(yaw) * np.cos(tilt_rad), -np.sin(tilt_rad)]
        )
        right = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
        pose = np.eye(4)
        pose[:3, 0], pose[:3, 1], pose[:3, 2] = right, np.cross(forward, right), forward
        pose[:3, 3] = (self._robot_x_m, -0.5, 1.5)
        return pose

    def position_world_m(self, name: str) -> Vec3 | None:
        """A flat world knows no places."""
        return None

    def look_at(self, point_world_m: Sequence[float]) -> npt.NDArray[np.float64]:
        """The camera turned towards a point."""
        x, y, z = (p - q for p, q in zip(point_world_m, (self._robot_x_m, -0.5, 1.5), strict=True))
        return self.camera_to_world(
            float(np.arctan2(y, x)) - self._yaw_rad, -float(np.arctan2(z, np.hypot(x, y)))
        )


class FlatRenderer:
    """Draws nothing but a pattern: one column of the picture for each thing within reach."""

    name = "flat"

    def __init__(self, intrinsics: Intrinsics) -> None:
        self._intrinsics = intrinsics

    def render(self, data: Any, camera_to_world: npt.NDArray[np.float64]) -> Frame:
        """A frame whose ids name what is in reach of the robot."""
        world: FlatWorld = data
        names = tuple(n for n in world.present() if world.within_reach(n))
        width, height = self._intrinsics.width, self._intrinsics.height
        ids = np.tile(np.arange(width, dtype=np.int32), (height, 1))
        ids[ids >= len(names)] = -1
        depth = np.where(ids >= 0, 1.0, 3.0).astype(np.float32)
        rgb = np.zeros((height, width, 3), dtype=np.uint8)
        rgb[..., 0] = np.clip(ids + 1, 0, 255)
        return Frame(rgb, depth, self._intrinsics, camera_to_world.copy(), ids, names)


def flat_environment(
    needs: SceneNeeds, domain: Domain, rates: Rates | None = None, ways: Sequence[Way] = ()
) -> KitchenEnvironment:
    """A whole environment without geometry: the true rules on a flat world.

    Args:
        needs: what the scene must contain.
        domain: of the task.
        rates: how often motions go wrong; never by default.
        ways: in which the household may differ from its catalogue.
    """
    return KitchenEnvironment(
        needs,
        domain,
        intrinsics=Intrinsics.from_vertical_fov(64, 48, 60.0),
        build=lambda n, seed, v: FlatWorld(flat_scene(n, seed, v)),
        make=lambda _, intrinsics: FlatRenderer(intrinsics),
        rates=rates,
        ways=ways,
    )


def flat_scene(needs: SceneNeeds, seed: int, catalogue: Catalogue) -> FlatScene:
    """A scene with a room's fixtures and the needed objects, places drawn from the seed.

    Raises:
        SceneError: an object fits nowhere that it may be.
    """
    rng = np.random.default_rng(seed)
    overrides: dict[str, dict[str, str]] = {}
    for name, attribute, value in needs.fixtures:
        overrides.setdefault(name, {})[attribute] = value
    things = [
        FlatInstance(f"{c}-{k}", c, None, tuple(sorted(overrides.get(f"{c}-{k}", {}).items())))
        for c, count in _ROOMS[roomed(needs).room].items()
        for k in range(1, count + 1)
    ]
    blocked: dict[str, str] = {}
    waiting = list(needs.objects)
    while waiting:
        ready = [o for o in waiting if _placeable(o, things, catalogue)]
        if not ready:
            raise SceneError(f"no place in the flat scene for {waiting[0].id}")
        need = ready[0]
        waiting.remove(need)
        if need.in_front_of is not None:
            blocked[need.in_front_of] = need.id
        parents = _placeable(need, things, catalogue)
        parent = parents[int(rng.integers(len(parents)))]
        things.append(FlatInstance(need.id, need.category, parent, need.states))
    return FlatScene((*things, *_prepared(things, catalogue)), blocked)


def _placeable(need: ObjectNeed, things: list[FlatInstance], catalogue: Catalogue) -> list[str]:
    if need.in_front_of is not None:
        return [t.parent for t in things if t.name == need.in_front_of and t.parent is not None]
    wanted = need.places or ("CounterTop", "DiningTable")
    found = []
    for thing in things:
        kind = catalogue[thing.name].receptacle
        if kind is None or not {thing.name, category_of(thing.name)} & set(wanted):
            continue
        count = sum(1 for t in things if t.parent == thing.name)
        if catalogue.accepts(thing.name, need.category) and (
            kind.capacity is None or count < kind.capacity
        ):
            found.append(thing.name)
    return found


def _prepared(things: Iterable[FlatInstance], catalogue: Catalogue) -> list[FlatInstance]:
    numbers: dict[str, int] = {}
    made = []
    for thing in things:
        category = catalogue[thing.category]
        for into, count in ((category.slices_into, category.slices), (category.cracks_into, 1)):
            for _ in range(count if into is not None else 0):
                assert into is not None
                numbers[into] = numbers.get(into, 0) + 1
                made.append(FlatInstance(f"{into}-{numbers[into]}", into, prepared=True))
    return made
