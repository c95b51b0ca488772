"""What a robot looks at and acts in: worlds, their truth, and what may disturb them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from forestall.domain.model import Domain
from forestall.types.episode import Event, SkillOutcome
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph
from forestall.types.observation import Frame, Observation, Vec3
from forestall.types.plan import Subtask
from forestall.types.scene import SceneNeeds
from forestall.types.world import Working


class Environment(Protocol):
    """A world in which a robot looks and acts. One instance is one scene."""

    def reset(self, seed: int) -> None:
        """Put the world into the start state of this seed, the same to the last bit each time."""

    def scan(self, thorough: bool = False) -> Observation:
        """Look all around from where the robot stands; `thorough`: the floor at its feet, too."""

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """Look towards world points: one frame for each group of points that one view can hold.

        Straight ahead and slightly down when there are none. What the hand holds is in a view, too.
        """

    def approach(self, name: str) -> float:
        """Drive to where a thing can be reached, unless it is within reach; simulated seconds."""

    def execute(self, subtask: Subtask) -> SkillOutcome:
        """Run one skill; refuse with a reason when its needs are not met."""

    def hold(self) -> None:
        """Stop all motion where it is, and keep what is held; nothing moves again before `reset`.

        Until then a skill is refused, and looking turns nothing. May be called at any time, more
        than once, and from another thread while another call has not come back.
        """

    @property
    def time_s(self) -> float:
        """Simulated time since reset."""

    def close(self) -> None:
        """Free what the environment holds."""


@runtime_checkable
class Unnamed(Protocol):
    """An environment that shares no names of things with perception, beside `Environment`.

    Its commands bear the names that perception gave, and say where it believes each thing to be:
    name → a point in the world, None for a thing whose place it has lost. What the points show is
    meant, and where nothing of the name's category is near, the command is refused. A category
    alone means what the robot takes for it, as in any environment.
    """

    def approach_at(self, name: str, where: Mapping[str, Vec3 | None]) -> float:
        """As `approach`; where the thing is not there, to where it was believed to be."""

    def execute_at(self, subtask: Subtask, where: Mapping[str, Vec3 | None]) -> SkillOutcome:
        """As `execute`."""


@runtime_checkable
class Vantages(Protocol):
    """A robot that can look at something from elsewhere, beside `Environment`."""

    def vantages(self, point: Vec3) -> Sequence[Vec3]:
        """Places of the camera, metres in the world, to which it could go to look at a point.

        As far as the robot knows the room; the one where it is need not be among them. Empty where
        there is none.
        """

    def look_from(self, place: Vec3, point: Vec3) -> float:
        """Bring the camera to one of them and face the point; simulated seconds.

        It may end somewhere near, and says by its pictures where it is.
        """


class OracleView(Protocol):
    """Ground truth. Only worlds, perception/oracle and tasks/ may touch it."""

    def truth(self) -> SceneGraph:
        """The complete state: every object, every state, containment, what is held."""

    def states(self, instance: str) -> Mapping[str, str]:
        """True attribute values of one instance, empty if there is no such instance now."""

    def history(self) -> frozenset[Literal]:
        """History facts that hold: what has happened and cannot be undone."""

    def events(self) -> tuple[Event, ...]:
        """Everything that has happened since reset, in order."""


class Disturbance(Protocol):
    """What a fault may do to a world while it runs (benchmark only)."""

    def drop_held(self, hard: bool = False) -> str | None:
        """Let go of the held object where the robot is; its name, None for an empty hand.

        A hard fall breaks what is fragile.
        """

    def rearrange(self, thing: str, place: str) -> bool:
        """Somebody puts a thing that the robot does not hold at a place, or into its empty hand.

        False where that cannot be done; then nothing has changed.
        """

    def alter(self, thing: str, attribute: str, value: str) -> bool:
        """Somebody changes a state; False where the thing is not there or has it already."""


class OpenWorld(Protocol):
    """One world made for one run, seen from its three sides.

    One that also has `shares_names`, False, keeps its names to itself: `tasks/edge.py` lies around
    what the robot gets.
    """

    @property
    def environment(self) -> Environment:
        """What the robot looks at and acts in."""

    @property
    def oracle(self) -> OracleView:
        """The truth, for the oracle's states, the scorer and the trace of an experiment alone."""

    @property
    def disturbance(self) -> Disturbance:
        """What the scenario's faults may do."""


class WorldPart(Protocol):
    """Makes worlds of one sort: the part of a run that stands for robot and surroundings.

    One that does not know every domain may say so in a static method `simulates(domain)`; where
    nobody named a world, a domain that the default one does not simulate has a symbolic one.
    """

    name: str

    def open(
        self, needs: SceneNeeds, domain: Domain, remember: bool = False
    ) -> AbstractContextManager[OpenWorld]:
        """A world with what is needed in it, freed at the end.

        `remember`: many runs follow, and what one of them drew may serve another.
        """

    def check(self) -> Sequence[Working]:
        """What of it works on this machine."""


class Eye(Protocol):
    """What a robot looks through: makes what it sees of what is there to be seen."""

    @property
    def identities(self) -> bool:
        """Whether masks tell which thing they show, and not only its category."""

    def around(self, environment: Environment) -> Environment:
        """The same world, seen through it."""


class World(Protocol):
    """Geometry of the embedded household: knows places and looks, not meanings or rules.

    Things are named by instance ("Mug-1"). What was placed on or in a thing is attached to it and
    moves with it.
    """

    def drive_to(self, name: str) -> float:
        """Drive to where `name` can be reached and face it; returns the simulated seconds."""

    def within_reach(self, name: str) -> bool:
        """Whether `name` can be reached from where the robot stands."""

    def blocker(self, name: str) -> str | None:
        """What stands between the robot's hand and `name` on the same support, if anything."""

    def has_room(self, thing: str, receptacle: str) -> bool:
        """Whether there is a free spot for `thing` on or in `receptacle`."""

    def place(self, thing: str, receptacle: str) -> None:
        """Put `thing` at a free spot on or in `receptacle`, resting on it, and attach it."""

    def hold(self, thing: str) -> None:
        """Move `thing` (with what is attached to it) into the gripper."""

    def drop(self, thing: str) -> None:
        """Let `thing` (with what is attached to it) fall from the gripper to the floor nearby."""

    def show(self, name: str, attribute: str, value: str) -> None:
        """Make a state visible (door angle, liquid, dirt, glow, ...); unknown pairs are ignored."""

    def replace(self, old: str, new: Sequence[str]) -> None:
        """Take `old` away and put prepared things (its slices, its cracked egg) at its place."""


class Renderer(Protocol):
    """Draws one frame of a compiled MuJoCo model (embedded household only)."""

    name: str

    def render(self, data: Any, camera_to_world: npt.NDArray[np.float64]) -> Frame:
        """RGB, metric z-depth and instance ids of the current state.

        Args:
            data: mujoco.MjData of the model that the renderer was made for.
            camera_to_world: (4, 4), x right, y down, z forward.
        """
