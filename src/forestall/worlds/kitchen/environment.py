"""The embedded household as an `Environment`: scene, camera, skills, effects, clock.

Joins the geometry (`World` with a camera), a renderer and the truth (`Household`). Calls point
downwards: `execute` → skills → household → world. Ground truth leaves only through `oracle`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.config import FRAME_HEIGHT, FRAME_WIDTH, VERTICAL_FOV_DEG
from forestall.domain.model import Domain
from forestall.errors import ForestallError, SceneError
from forestall.seams.acting import Renderer
from forestall.types.episode import Event, SkillOutcome, SkillStatus
from forestall.types.facts import GRIPPER, Literal, category_of
from forestall.types.graph import SceneGraph
from forestall.types.observation import Frame, GripperState, Intrinsics, Observation, Vec3
from forestall.types.plan import Subtask
from forestall.types.scene import SceneNeeds
from forestall.worlds.kitchen import effects, navigation
from forestall.worlds.kitchen.actor import Robot, SkillTimes
from forestall.worlds.kitchen.catalogue import Catalogue, catalogue
from forestall.worlds.kitchen.household import FLOOR, Household
from forestall.worlds.kitchen.imperfection import ImperfectMotions, Rates
from forestall.worlds.kitchen.law import Way, draw_law
from forestall.worlds.kitchen.layout import Draw
from forestall.worlds.kitchen.motions import Motions
from forestall.worlds.kitchen.naming import (
    RefusalError,
    resolve_receptacle,
    resolve_thing,
    why_no_room,
)
from forestall.worlds.kitchen.needs import roomed
from forestall.worlds.kitchen.rendering.memory import FrameMemory
from forestall.worlds.kitchen.skills import perform
from forestall.worlds.kitchen.stage import Lifelike, Roving, Stage
from forestall.worlds.kitchen.streams import Streams, chance

SCAN_FRAMES = 7
"""Views of a full turn; 51° apart at 75° of horizontal view, so that each overlaps the next."""

SCAN_TILT_RAD = math.radians(25.0)
FLOOR_TILT_RAD = math.radians(62.0)
"""Shows the floor from 0.05 m to 1.0 m from the robot."""

NECK_RAD = math.radians(80.0)
"""What is further to the side than this is looked at by turning the base."""

AHEAD_TILT_RAD = math.radians(15.0)

HOLDS = "the robot was told to hold"


Build = Callable[[SceneNeeds, int, Catalogue], Stage]
MakeRenderer = Callable[[Stage, Intrinsics], Renderer]


class KitchenOracle:
    """Ground truth of the embedded household, for the benchmark and the oracle perception."""

    def __init__(self, current: Callable[[], Household]) -> None:
        self._current = current

    def truth(self) -> SceneGraph:
        """The complete state: every object, every state, containment, what is held."""
        return self._current().truth()

    def states(self, instance: str) -> Mapping[str, str]:
        """True attribute values of one instance, empty if there is no such instance now."""
        return self._current().states(instance)

    def history(self) -> frozenset[Literal]:
        """What has happened and cannot be undone."""
        return frozenset(Literal("spoiled", (x,)) for x in self._current().spoiled())

    def events(self) -> tuple[Event, ...]:
        """Everything that has happened since reset, in order."""
        return self._current().events()


class KitchenEnvironment:
    """One household scene in which a robot looks and acts.

    Args:
        needs: what the scene must contain.
        domain: of the task, for the categories that it adds to the kitchen's own.
        renderer: "auto", or the name of one renderer of the embedded household.
        intrinsics: of the head camera; 640×480 with 60° of vertical view by default.
        times: duration of each skill.
        effect_config: numbers of the automatic effects.
        build: makes the world of a seed; the embedded MuJoCo kitchen by default.
        make: makes the renderer of a world; by `renderer` name by default.
        frames: what was drawn before; everything is drawn anew by default.
        rates: how often motions go wrong; never where it is None.
        ways: in which the household may differ from its catalogue; none by default.
        draws: what draws a floor plan, by kind of room; the kitchen's own rooms by default.
        roves: whether the robot offers to look at things from elsewhere.
    """

    def __init__(
        self,
        needs: SceneNeeds,
        domain: Domain,
        renderer: str = "auto",
        intrinsics: Intrinsics | None = None,
        *,
        times: SkillTimes | None = None,
        effect_config: effects.EffectConfig | None = None,
        build: Build | None = None,
        make: MakeRenderer | None = None,
        frames: FrameMemory | None = None,
        rates: Rates | None = None,
        ways: Sequence[Way] = (),
        draws: Mapping[str, Draw] | None = None,
        roves: bool = False,
    ) -> None:
        self._roves = roves
        self._needs = roomed(needs)
        self._catalogue = catalogue(domain)
        self._intrinsics = intrinsics or Intrinsics.from_vertical_fov(
            FRAME_WIDTH, FRAME_HEIGHT, VERTICAL_FOV_DEG
        )
        self._times = times or SkillTimes()
        self._effect_config = effect_config or effects.EffectConfig()
        self._rates = rates
        self._ways = tuple(ways)
        self._build = build or _builder(rates is not None, draws)
        self._make = make or _maker(renderer, frames)
        self._seed: int | None = None
        self._released: tuple[str, Vec3] | None = None
        self._holding = False
        self._world: Stage | None = None
        self._renderer: Renderer | None = None
        self._robot: Robot | None = None
        self.oracle = KitchenOracle(lambda: self._acting.household)

    def reset(self, seed: int) -> None:
        """Build the scene of this seed, or put it back to its start if it stands already.

        Raises:
            SceneError: the scene cannot be built as asked.
        """
        if self._world is None or seed != self._seed:
            self._renderer = None
            self._world = self._build(self._needs, seed, self._catalogue)
            self._seed = seed
        else:
            self._world.reset()
        self._released, self._holding = None, False
        streams, instances = chance(self._needs, seed), tuple(self._world.instances)
        law = draw_law(streams, [i.name for i in instances if not i.prepared], self._ways)
        household = Household(self._catalogue, self._world, instances, law)
        self._robot = Robot(household, self._times, self._motions(streams))
        effects.settle(household, self._effect_config)

    def _motions(self, streams: Streams) -> Motions:
        if self._rates is None:
            return Motions()
        motions = ImperfectMotions(self._rates, streams)
        if isinstance(self._world, Lifelike):
            self._world.stand_with(motions.standing)
        return motions

    def scan(self, thorough: bool = False) -> Observation:
        """Views all around: the base turns once on the spot, which takes its time.

        A robot that was told to hold only looks ahead.
        """
        if self._holding:
            return self.observe()
        world, household = self._stage, self._acting.household
        start_rad = world.robot_yaw_rad
        frames = []
        for tilt_rad in (SCAN_TILT_RAD, FLOOR_TILT_RAD) if thorough else (SCAN_TILT_RAD,):
            for k in range(SCAN_FRAMES):
                world.turn_to(start_rad + 2 * math.pi * k / SCAN_FRAMES)
                frames.append(self._frame(world.camera_to_world(0.0, tilt_rad)))
            household.time_s += 4 * self._times.turn_s_per_90deg
        world.turn_to(start_rad)
        return self._observation(frames)

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """One frame for each group of points, the hand's among them when it holds something.

        The base turns where the neck does not reach, which takes its time.
        """
        world = self._stage
        if self._acting.household.held is not None:
            focus = (world.gripper_position_world_m, *focus)
        if not focus:
            return self._observation([self._frame(world.camera_to_world(0.0, AHEAD_TILT_RAD))])
        eye = world.look_at(focus[0])[:3, 3]
        frames = []
        for aim in navigation.aims(np.asarray(focus, dtype=float) - eye):
            heading = math.atan2(aim[1], aim[0])
            far = abs(navigation.wrapped(heading - world.robot_yaw_rad)) > NECK_RAD
            if far and not self._holding:
                self._acting.household.time_s += world.turn_to(heading)
            frames.append(self._frame(world.look_at((eye + aim).tolist())))
        return self._observation(frames)

    def approach(self, name: str) -> float:
        """Drive to where a thing can be reached, unless it is within reach; simulated seconds."""
        household = self._acting.household
        start_s = household.time_s
        if household.exists(name) and not self._holding:
            with suppress(RefusalError):
                self._acting.approach(name)
        return household.time_s - start_s

    def vantages(self, point: Vec3) -> Sequence[Vec3]:
        """See `Vantages`."""
        world = self._stage
        if not self._roves or self._holding or not isinstance(world, Roving):
            return ()
        return world.lookouts(point)

    def look_from(self, place: Vec3, point: Vec3) -> float:
        """See `Vantages`."""
        world = self._stage
        if self._holding or not isinstance(world, Roving):
            return 0.0
        seconds = world.look_from(place, point)
        self._acting.household.time_s += seconds
        return seconds

    def execute(self, subtask: Subtask) -> SkillOutcome:
        """Run one skill; the automatic effects settle before it (time has passed) and after."""
        if self._holding:
            return SkillOutcome(SkillStatus.REFUSED, 0.0, HOLDS)
        robot, household = self._acting, self._acting.household
        effects.settle(household, self._effect_config)
        held, believed, robot.lost = household.held, robot.believed, False
        outcome = perform(robot, subtask)
        for door in household.law.falling_shut(household.state):
            household.swing(door, "closed")
        effects.settle(household, self._effect_config)
        self._released = None
        if held is not None and household.held is None and not robot.lost:
            where = self._let_go_at(held, subtask)
            self._released = None if where is None else (believed or held, where)
            outcome = replace(outcome, hand_world_m=where)
        return outcome

    def _let_go_at(self, thing: str, subtask: Subtask) -> Vec3 | None:
        """Where the hand let go: where the thing is, unless it fell from there."""
        parent = self._acting.household.parent(thing)
        fell = parent is not None and category_of(parent) == FLOOR
        if fell and category_of(subtask.args[-1]) != FLOOR:
            return self._stage.gripper_position_world_m
        return self._stage.position_world_m(thing)

    def hold(self) -> None:
        """Nothing that the robot does moves anything again before `reset`."""
        self._holding = True

    def drop_held(self, hard: bool = False) -> str | None:
        """Let go of the held object where the robot is; its name, None when nothing fell.

        What falls stays intact, an egg apart, unless the fall is hard. Nothing falls from an empty
        hand or where there is no free floor.
        """
        household = self._acting.household
        held = household.held
        if held is None:
            return None
        try:
            household.fall(held)
        except SceneError:
            return None
        effects.crash(household, held, hard)
        effects.settle(household, self._effect_config)
        return held

    def rearrange(self, thing: str, place: str) -> bool:
        """See `Disturbance`; somebody else's hands reach everywhere and open what is closed."""
        household = self._acting.household
        try:
            name = resolve_thing(household, thing)
            if name == household.held or not household.category(name).pickupable:
                return False
            if place == GRIPPER:
                if household.held is not None:
                    return False
                household.hold(name)
            else:
                where = resolve_receptacle(household, place, name)
                full = why_no_room(household, name, where) is not None
                inside = name in (where, *household.ancestors(where))
                there = household.parent(name) == where
                if there or full or inside or not household.catalogue.accepts(where, name):
                    return False
                household.put(name, where)
                effects.arrived(household, name, where)
        except (RefusalError, SceneError):
            return False
        effects.settle(household, self._effect_config)
        return True

    def alter(self, thing: str, attribute: str, value: str) -> bool:
        """See `Disturbance`."""
        household = self._acting.household
        try:
            name = resolve_thing(household, thing)
        except RefusalError:
            return False
        changed = household.set_state(name, attribute, value)
        effects.settle(household, self._effect_config)
        return changed

    @property
    def time_s(self) -> float:
        """Simulated time since reset."""
        return self._acting.household.time_s

    def close(self) -> None:
        """Free the scene and the renderer; a later reset builds them again."""
        self._world = self._renderer = self._robot = self._seed = None

    @property
    def _acting(self) -> Robot:
        if self._robot is None:
            raise ForestallError("the kitchen has no scene yet: call reset(seed) first")
        return self._robot

    @property
    def _stage(self) -> Stage:
        if self._world is None:
            raise ForestallError("the kitchen has no scene yet: call reset(seed) first")
        return self._world

    def _gripper(self) -> GripperState:
        """What the hand feels: that there is something, and what the robot took it for."""
        world, held = self._stage, self._acting.household.held
        width_m = None
        if self._rates is not None and isinstance(world, Lifelike):
            width_m = 0.0 if held is None else world.grip_width_m(held)
        what, where = self._released or (None, None)
        hand = world.gripper_position_world_m
        return GripperState(self._acting.believed, hand, what, where, width_m=width_m)

    def _frame(self, camera_to_world: npt.NDArray[np.float64]) -> Frame:
        if self._renderer is None:
            self._renderer = self._make(self._stage, self._intrinsics)
        return self._renderer.render(self._stage.data, camera_to_world)

    def _observation(self, frames: Sequence[Frame]) -> Observation:
        world, household = self._stage, self._acting.household
        return Observation(
            frames=tuple(frames),
            gripper=self._gripper(),
            time_s=household.time_s,
            robot_position_world_m=world.robot_position_world_m,
        )


def _builder(honest: bool, draws: Mapping[str, Draw] | None) -> Build:
    def build(needs: SceneNeeds, seed: int, catalogue: Catalogue) -> Stage:
        from forestall.worlds.kitchen.honest_world import HonestWorld
        from forestall.worlds.kitchen.model import OWN, build_scene
        from forestall.worlds.kitchen.world import KitchenWorld

        make = HonestWorld if honest else KitchenWorld
        return build_scene(needs, seed, catalogue, make, OWN if draws is None else draws)

    return build


def _maker(renderer: str, frames: FrameMemory | None) -> MakeRenderer:
    def make(world: Any, intrinsics: Intrinsics) -> Renderer:
        from forestall.worlds.kitchen.rendering import make_remembering, make_renderer

        if frames is not None:
            return make_remembering(renderer, world.model, world.appearance, intrinsics, frames)
        return make_renderer(renderer, world.model, world.appearance, intrinsics)

    return make
