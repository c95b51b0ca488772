"""Seeded scenes in every state, as a robot sees them: what the encoder is trained and tested on.

Called by `shards.py`; calls the household's scene builder and renderer. Scenes are drawn to show
what is rare in a task: things in odd places, every state as often as every other one, many states
at once (a dirty mug with coffee, an open microwave with a bowl in it, a burner on under a pot).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from forestall.config import FRAME_HEIGHT, FRAME_WIDTH, VERTICAL_FOV_DEG
from forestall.domain.model import Domain
from forestall.errors import SceneError
from forestall.training.questions import ATTRIBUTES
from forestall.types.facts import category_of
from forestall.types.observation import Frame, Intrinsics
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.catalogue import Catalogue, catalogue
from forestall.worlds.kitchen.environment import SCAN_TILT_RAD
from forestall.worlds.kitchen.model import build_scene
from forestall.worlds.kitchen.rendering import make_renderer
from forestall.worlds.kitchen.world import KitchenWorld

UNSEEN = ("temperature",)
"""Attributes that no picture shows."""

ROOM_THINGS = {
    "kitchen": frozenset({"Laptop", "RemoteControl"}),
    "living-room": frozenset(
        {"Pot", "Pan", "Kettle", "Knife", "Lettuce", "LettuceSliced", "EggCracked", "Toaster"}
    ),
}
"""What a room of this kind does not hold."""


@dataclass(frozen=True, slots=True)
class SceneConfig:
    """How training scenes are drawn.

    Args:
        views: pictures of one scene, each with states drawn anew.
        things: smallest and largest number of movable things.
        living_rooms: share of living rooms.
        odd_places: share of things that are put into a receptacle rather than where there is room.
        moved: share of pictures before which a thing is put somewhere else.
        held: share of pictures that show something in the hand.
        aside: share of pictures not aimed at anything, as when the robot looks round.
        broken: share of things that can break that are broken.
        aim_m: standard deviation of the point looked at.
    """

    views: int = 10
    things: tuple[int, int] = (13, 19)
    living_rooms: float = 0.2
    odd_places: float = 0.35
    moved: float = 0.4
    held: float = 0.12
    aside: float = 0.2
    broken: float = 0.25
    aim_m: float = 0.10


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One frame and the truth about what is in it; `held` names what is in the hand."""

    seed: int
    view: int
    frame: Frame
    states: dict[str, dict[str, str]]
    held: str | None = None


@dataclass(slots=True)
class Artist:
    """Draws scenes and pictures; remembers what it has shown, so that rare things come next.

    Args:
        domain: categories.
        config: how scenes are drawn.
        renderer: by name.
    """

    domain: Domain
    config: SceneConfig = field(default_factory=SceneConfig)
    renderer: str = "auto"
    shown: Counter[str] = field(default_factory=Counter)
    _catalogue: Catalogue = field(init=False)

    def __post_init__(self) -> None:
        self._catalogue = catalogue(self.domain)

    def pictures(self, seed: int) -> Iterator[Picture]:
        """Every picture of one scene; none where the seed's scene cannot be built."""
        rng = np.random.default_rng([seed, 0])
        world = self._world(seed, rng)
        if world is None:
            return
        intrinsics = Intrinsics.from_vertical_fov(FRAME_WIDTH, FRAME_HEIGHT, VERTICAL_FOV_DEG)
        renderer = make_renderer(self.renderer, world.model, world.appearance, intrinsics)
        for view in range(self.config.views):
            rng = np.random.default_rng([seed, 1, view])
            camera, held = self._compose(world, rng)
            frame = renderer.render(world.data, camera)
            names = [n for n in world.bodies.states if n in world.bodies.present]
            states = {n: self.visible_states(world, n) for n in names}
            yield Picture(seed, view, frame, states, held)

    def visible_states(self, world: KitchenWorld, name: str) -> dict[str, str]:
        """True states that a picture can show; of a broken thing only that it is broken."""
        states = {a: v for a, v in world.bodies.states[name].items() if a not in UNSEEN}
        if states.get("broken") == "broken":
            return {"broken": "broken"}
        if category_of(name) == "HousePlant" and states["filled"] != "empty":
            states["filled"] = "water"  # wet earth looks the same whatever made it wet
        return states

    def _world(self, seed: int, rng: np.random.Generator) -> KitchenWorld | None:
        for attempt in range(6):
            room = "living-room" if rng.uniform() < self.config.living_rooms else "kitchen"
            needs = SceneNeeds(room, self._needs(room, rng), (), (0, 2))
            try:
                return build_scene(needs, seed * 8 + attempt, self._catalogue)
            except SceneError:
                continue
        return None

    def _needs(self, room: str, rng: np.random.Generator) -> tuple[ObjectNeed, ...]:
        categories = [
            c
            for n, c in sorted(self._catalogue.categories.items())
            if not c.fixture and n not in ROOM_THINGS[room]
        ]
        rarity = np.array([1.0 / (8 + self.shown[c.name]) for c in categories])
        weight = rarity * [2.0 if set(c.attributes) - {"temperature"} else 1.0 for c in categories]
        low, high = self.config.things
        count = min(int(rng.integers(low, high + 1)), len(categories))
        chosen = rng.choice(len(categories), count, replace=False, p=weight / weight.sum())
        names = [categories[int(i)].name for i in chosen]
        full: set[str] = set()
        needs = []
        for name in names:
            places: tuple[str, ...] = ()
            if rng.uniform() < self.config.odd_places or name == "EggCracked":
                places = self._odd_place(name, names, full, room, rng)
            needs.append(ObjectNeed(f"{name}-1", name, places))
        return tuple(needs)

    def _odd_place(
        self, name: str, names: list[str], full: set[str], room: str, rng: np.random.Generator
    ) -> tuple[str, ...]:
        """One receptacle that takes the thing, and no two of those that take one thing only."""
        options = [
            n
            for n, c in sorted(self._catalogue.categories.items())
            if c.receptacle is not None
            and self._catalogue.accepts(n, name)
            and n not in full
            and (n in names if not c.fixture else room == "kitchen")
            and n not in ("Floor", "Shelf", "TVStand", "CounterTop", "DiningTable")
        ]
        if not options:
            return ()
        chosen = options[int(rng.integers(len(options)))]
        receptacle = self._catalogue[chosen].receptacle
        if receptacle is not None and receptacle.capacity is not None:
            full.add(chosen)
        return (chosen,)

    def _compose(
        self, world: KitchenWorld, rng: np.random.Generator
    ) -> tuple[npt.NDArray[np.float64], str | None]:
        """Draw states, move something, go somewhere and look: the camera's pose, what is held."""
        world.reset()
        bodies = world.bodies
        here = sorted(n for n in bodies.states if n in bodies.present)
        things = [n for n in here if bodies.is_thing(n)]
        for name in here:
            for attribute, value in bodies.states[name].items():
                world.show(name, attribute, self._draw(attribute, value, rng))
        if things and rng.uniform() < self.config.moved:
            self._move(world, things, rng)
        rarity = np.array([1.0 / (8 + self.shown[category_of(n)]) for n in here])
        stateful = [bool(set(bodies.states[n]) - set(UNSEEN)) for n in here]
        weight = rarity * np.where(stateful, 1.0, 0.25)
        target = here[int(rng.choice(len(here), p=weight / weight.sum()))]
        self._uncover(world, target)
        world.drive_to(target)
        if target in things and rng.uniform() < self.config.held:
            world.hold(target)
            world.drive_to(here[int(rng.integers(len(here)))])
            return world.look_at(self._about(world.gripper_position_world_m, 0.15, rng)), target
        if rng.uniform() < self.config.aside:
            tilt = float(np.clip(rng.normal(SCAN_TILT_RAD, 0.2), 0.0, 1.1))
            return world.camera_to_world(float(rng.uniform(-1.2, 1.2)), tilt), None
        if rng.uniform() < self.config.aside:  # something else, seen from here
            target = here[int(rng.integers(len(here)))]
        return world.look_at(self._about(bodies.centre(target), self.config.aim_m, rng)), None

    def _draw(self, attribute: str, value: str, rng: np.random.Generator) -> str:
        """A random value; what is decided by the category stays."""
        if attribute == "sliced" or attribute in UNSEEN:
            return value
        values = ATTRIBUTES[attribute]
        if attribute == "broken":
            return values[int(rng.uniform() < self.config.broken)]
        if attribute == "filled" and rng.uniform() < 0.2:
            return values[0]
        return values[int(rng.integers(len(values)))]

    def _move(self, world: KitchenWorld, things: list[str], rng: np.random.Generator) -> None:
        thing = things[int(rng.integers(len(things)))]
        if any(p == thing for p in world.bodies.parents.values()):
            return
        options = [
            n
            for n in sorted(world.bodies.states)
            if n in world.bodies.present
            and n != thing
            and self._catalogue[n].receptacle is not None
            and self._catalogue.accepts(n, category_of(thing))
        ]
        for index in rng.permutation(len(options))[:3]:
            receptacle = self._catalogue[options[int(index)]].receptacle
            inside = [p for p in world.bodies.parents.values() if p == options[int(index)]]
            if receptacle is None or (receptacle.capacity or 99) <= len(inside):
                continue
            try:
                world.place(thing, options[int(index)])
            except SceneError:
                continue
            return

    def _uncover(self, world: KitchenWorld, target: str) -> None:
        """Open what the target is in, so that it can be seen."""
        at = world.bodies.parents.get(target)
        while at is not None:
            world.show(at, "open", "open")
            at = world.bodies.parents.get(at)

    def _about(
        self, point: tuple[float, float, float], spread_m: float, rng: np.random.Generator
    ) -> tuple[float, float, float]:
        x, y, z = (np.asarray(point) + rng.normal(0, spread_m, 3)).tolist()
        return (x, y, z)
