"""A scene of AI2-THOR as a world that a robot acts in.

Implements `Environment`; `ThorOracle` and the two ways of `Disturbance` are its other sides. Called
by the loop; calls `skills`, `driving`, `staging`, `effects`, `history` over one `Link`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np

from forestall.domain.model import Domain
from forestall.errors import ForestallError, InputError, SceneError
from forestall.types.episode import Event, SkillOutcome, SkillStatus
from forestall.types.facts import GRIPPER, Literal, is_instance
from forestall.types.graph import SceneGraph
from forestall.types.observation import Frame, GripperState, Observation, Vec3
from forestall.types.plan import Subtask
from forestall.types.scene import SceneNeeds
from forestall.worlds.ai2thor.driving import Base, turning_s
from forestall.worlds.ai2thor.effects import settle
from forestall.worlds.ai2thor.frames import (
    angles_to,
    box_from_thor,
    frame_from_event,
    point_from_thor,
)
from forestall.worlds.ai2thor.history import History
from forestall.worlds.ai2thor.link import Build, Link
from forestall.worlds.ai2thor.naming import Names
from forestall.worlds.ai2thor.rooms import scenes
from forestall.worlds.ai2thor.scene import Scene
from forestall.worlds.ai2thor.skills import SKILLS, Agent, RefusalError
from forestall.worlds.ai2thor.staging import Stage, chosen

SCAN_TILT_DEG = 25.0
FLOOR_TILT_DEG = 60.0
AHEAD_TILT_DEG = 15.0
ONE_VIEW_DEG = 17.0
"""Directions this near to the first of a group are looked at in one frame."""

SKILL_S = 4.0
"""How long a skill takes of which the domain does not say it."""

HOLDS = "the robot was told to hold"


class ThorOracle:
    """Ground truth, for the benchmark and the oracle perception."""

    def __init__(self, world: ThorWorld) -> None:
        self._world = world

    def truth(self) -> SceneGraph:
        """The complete state."""
        return self._world.scene.graph(self._world.time_s)

    def states(self, instance: str) -> Mapping[str, str]:
        """True attribute values of one instance, empty if there is no such instance now."""
        return self._world.scene.states(instance)

    def history(self) -> frozenset[Literal]:
        """What has happened and cannot be undone."""
        return self._world.past.facts

    def events(self) -> tuple[Event, ...]:
        """Everything that has happened since reset, in order."""
        return self._world.past.events


class ThorWorld:
    """One build of AI2-THOR with one scene.

    Args:
        build: which, and how it draws.
        needs: what the scene must contain.
        domain: in whose words.
        scene: its name ("FloorPlan1"); drawn by the seed where it is empty.
    """

    def __init__(self, build: Build, needs: SceneNeeds, domain: Domain, scene: str = "") -> None:
        self._build, self._needs, self._domain, self._fixed = build, needs, domain, scene
        self._link: Link | None = None
        self._past: History | None = None
        self._holding = False
        self._time_s = 0.0
        self._cached: tuple[object, Scene] | None = None
        self.oracle = ThorOracle(self)

    # --- Environment -----------------------------------------------------------------------------

    def reset(self, seed: int) -> None:
        """Put the scene of this seed into its start, and what the task needs into the scene.

        Raises:
            SceneError: no scene of the room's kind has all of it.
            ForestallError: the build does not start, or has died.
        """
        self._holding = False
        order = [self._fixed] if self._fixed else scenes(self._needs.room, seed)
        why = ""
        for name in order:
            self._enter(name)
            try:
                self._set(seed)
            except SceneError as error:
                why = why or f"{name}: {error}"
                continue
            return
        raise SceneError(why)

    def _enter(self, scene: str) -> None:
        if self._link is None:
            self._link = Link(self._build, scene)
        else:
            try:
                self._link.reset(scene)
            except ForestallError:
                self.close()
                self._link = Link(self._build, scene)
        self._base = Base(self._link)
        self._cached, self._time_s = None, 0.0
        self._released: tuple[str, Vec3] | None = None

    def _set(self, seed: int) -> None:
        things = self._open.event.metadata["objects"]
        self._names = Names(things, {})
        wanted = chosen(self._needs, things, self.scene)
        self._names, self._cached = Names(things, wanted), None
        self.stage = Stage(self._open, lambda: self.scene)
        self.stage.prepare(self._needs)
        settle(self._open, self.scene)
        self._base.learn_floor()
        self._start(np.random.default_rng(seed))
        self._agent = Agent(self._open, self._base, lambda: self.scene, self._domain.canonical)
        self._agent.go_on = self._go_on
        self._past = History(self.scene)

    def _start(self, rng: np.random.Generator) -> None:
        """Stand somewhere and look somewhere, by the seed."""
        if not self._base.floor:
            raise SceneError("there is no floor on which the agent can stand")
        x, y, z = self._base.floor[int(rng.integers(len(self._base.floor)))]
        self._open.step(
            "Teleport",
            position={"x": x, "y": y, "z": z},
            rotation={"x": 0.0, "y": 90.0 * int(rng.integers(4)), "z": 0.0},
            horizon=AHEAD_TILT_DEG,
            standing=True,
        )

    def scan(self, thorough: bool = False) -> Observation:
        """Views all around, from where the robot stands; one told to hold only looks ahead."""
        if self._holding:
            return self.observe()
        yaw, horizon = self._base.looks
        frames = []
        count = self._views()
        for tilt in (SCAN_TILT_DEG, FLOOR_TILT_DEG) if thorough else (SCAN_TILT_DEG,):
            for k in range(count):
                self._base.turn_to(yaw + 360.0 * k / count, tilt)
                frames.append(self._frame())
            self._time_s += turning_s(0.0, 90.0) * 4
        self._base.turn_to(yaw, horizon)
        return self._observation(frames)

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """One frame for each group of points; what is held is in AI2-THOR's every view."""
        if self._holding:
            return self._observation([self._frame()])
        if not focus:
            self._time_s += self._base.turn_to(self._base.looks[0], AHEAD_TILT_DEG)
            return self._observation([self._frame()])
        frames = []
        for yaw, horizon in _groups([angles_to(self._base.eye_world_m, p) for p in focus]):
            self._time_s += self._base.turn_to(yaw, horizon)
            frames.append(self._frame())
        return self._observation(frames)

    def approach(self, name: str) -> float:
        """Drive to where a thing can be reached, unless it is within reach; simulated seconds."""
        if self._holding or not name:
            return 0.0
        with suppress(RefusalError):
            self._agent.reach(name)
        return self._pass()

    def execute(self, subtask: Subtask) -> SkillOutcome:
        """Run one skill; what AI2-THOR or a need of the skill refuses is refused with its words."""
        if self._holding:
            return SkillOutcome(SkillStatus.REFUSED, 0.0, HOLDS)
        held, status, reason = self.scene.held, SkillStatus.SUCCEEDED, ""
        try:
            self._domain.check(subtask)
            if subtask.skill not in SKILLS:
                raise RefusalError(f"AI2-THOR's robot has no skill {subtask.skill}")
            self._agent.perform(subtask)
        except (InputError, RefusalError) as error:
            status, reason = SkillStatus.REFUSED, str(error)
        seconds = self._pass()
        if status is SkillStatus.SUCCEEDED:
            skill = self._domain.skills[subtask.skill]
            seconds += 0.0 if skill.drives else skill.duration_s or SKILL_S
            self._time_s += 0.0 if skill.drives else skill.duration_s or SKILL_S
        self._happened()
        self._released = None
        if held is not None and self.scene.held is None:
            self._released = (held, self._where(held))
        hand = None if self._released is None else self._released[1]
        return SkillOutcome(status, seconds, reason, hand)

    def hold(self) -> None:
        """No action follows the one that is under way, until `reset`."""
        self._holding = True

    @property
    def time_s(self) -> float:
        """Simulated time since reset."""
        return self._time_s

    def close(self) -> None:
        """End the build."""
        if self._link is not None:
            self._link.stop()
        self._link = None

    # --- Disturbance -----------------------------------------------------------------------------

    def drop_held(self, hard: bool = False) -> str | None:
        """See `Disturbance`; an egg breaks however it falls."""
        held = self.scene.held
        if held is None:
            return None
        thing = self.scene.things[held]
        event = self._open.step("DropHandObject", forceAction=True)
        if not event.metadata["lastActionSuccess"]:
            return None
        if hard and thing.get("breakable") and held in self.scene:
            self._open.step("BreakObject", objectId=thing["objectId"], forceAction=True)
        self._happened()
        return held

    def rearrange(self, thing: str, place: str) -> bool:
        """See `Disturbance`."""
        scene = self.scene
        name = next(iter(self._named(thing)), None)
        if name is None or name == scene.held or not scene.things[name].get("pickupable"):
            return False
        if place == GRIPPER:
            done = scene.held is None and bool(
                self._open.step(
                    "PickupObject", objectId=scene.things[name]["objectId"], forceAction=True
                ).metadata["lastActionSuccess"]
            )
        else:
            around = (name, *scene.within(name))
            free = [p for p in self.stage.options([place]) if p not in around]
            done = scene.parent(name) not in free and any(self.stage.place(name, p) for p in free)
        self._happened()
        return done

    def alter(self, thing: str, attribute: str, value: str) -> bool:
        """See `Disturbance`."""
        name = next(iter(self._named(thing)), None)
        done = name is not None and self.stage.set(name, attribute, value)
        self._happened()
        return done

    # --- what both are made of --------------------------------------------------------------------

    @property
    def scene(self) -> Scene:
        """What is true now."""
        event = self._open.event
        if self._cached is None or self._cached[0] is not event:
            self._cached = (event, Scene(event.metadata, self._names, self._domain))
        return self._cached[1]

    @property
    def past(self) -> History:
        """What has happened."""
        if self._past is None:
            raise ForestallError("AI2-THOR has no scene yet: call reset(seed) first")
        return self._past

    @property
    def _open(self) -> Link:
        if self._link is None:
            raise ForestallError("AI2-THOR has no scene yet: call reset(seed) first")
        return self._link

    def _go_on(self) -> None:
        if self._holding:
            raise RefusalError(HOLDS)

    def _pass(self) -> float:
        """Let the time pass that driving took."""
        seconds, self._agent.driven_s = self._agent.driven_s, 0.0
        self._time_s += seconds
        return seconds

    def _happened(self) -> None:
        settle(self._open, self.scene)
        self.past.note(self.scene, self._time_s)

    def _named(self, name: str) -> list[str]:
        if is_instance(name):
            return [name] if name in self.scene else []
        return self.scene.of(name)

    def _where(self, name: str) -> Vec3:
        """Where a thing is, or what was made of it is; the hand, if neither can be told."""
        scene = self.scene
        box = box_from_thor(scene.things[name]) if name in scene else None
        return self._hand() if box is None else box.centre

    def _hand(self) -> Vec3:
        about = self._open.event.metadata
        pose = about.get("heldObjectPose") or {}
        place = pose.get("position")
        return self._base.eye_world_m if place is None else point_from_thor(place)

    def _views(self) -> int:
        """How many views of a full turn overlap each other by a third."""
        half = math.tan(math.radians(self._build.fov_deg / 2)) * self._build.width
        across = 2 * math.degrees(math.atan(half / self._build.height))
        return math.ceil(360.0 / (across * 2 / 3))

    def _frame(self) -> Frame:
        scene = self.scene

        def shown(object_id: str) -> str | None:
            name = self._names.name(object_id)
            return name if name in scene.things else None

        return frame_from_event(self._open.event, shown)

    def _observation(self, frames: Sequence[Frame]) -> Observation:
        held = self.scene.held
        thing, where = self._released or (None, None)
        return Observation(
            frames=tuple(frames),
            gripper=GripperState(held, self._hand(), thing, where),
            time_s=self._time_s,
            robot_position_world_m=self._base.position_world_m,
        )


def _groups(ways: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """One direction for each group that fits into one view; that of the last point comes last."""
    found: list[tuple[float, float]] = []
    for yaw, horizon in reversed(ways):
        near = any(
            abs((yaw - y + 180.0) % 360.0 - 180.0) <= ONE_VIEW_DEG
            and abs(horizon - h) <= ONE_VIEW_DEG
            for y, h in found
        )
        if not near:
            found.append((yaw, horizon))
    return found[::-1]
