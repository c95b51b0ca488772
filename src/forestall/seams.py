"""Every Protocol of the project; implementations never import each other.

Calls point downwards: a command has a runtime built (`assembly/`), its monitor calls
the strategy, the strategy calls detector, reasoner, replanner; all see only this and `types/`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
import numpy.typing as npt

from forestall.deadline import Deadline
from forestall.domain.model import Domain
from forestall.types.demonstration import Demonstration
from forestall.types.encoder import StateReading
from forestall.types.episode import (
    BoundaryRecord,
    EpisodeRecord,
    Event,
    ExecutedRecord,
    SkillOutcome,
)
from forestall.types.exchange import Exchange, Request
from forestall.types.facts import Literal
from forestall.types.foreign import ForeignPlan, ForeignRun
from forestall.types.graph import SceneGraph
from forestall.types.grounding import Corners, GroundedBox
from forestall.types.kind import Kind
from forestall.types.observation import Detection, Frame, Mask, Observation, Rgb, Vec3
from forestall.types.plan import Plan, Subtask
from forestall.types.recorded import RecordedRun, Unread
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer
from forestall.types.scene import SceneNeeds
from forestall.types.story import Located, Tried, Verified
from forestall.types.task import Goal
from forestall.types.verdict import (
    Diagnosis,
    PlanCheck,
    Precondition,
    Reference,
    Replan,
    Verdict,
)
from forestall.types.world import Working

T = TypeVar("T")


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
    """Makes worlds of one sort: the part of a run that stands for robot and surroundings."""

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


class Foreign(Protocol):
    """A household that somebody else wrote, with runs of it; its options are its own."""

    name: str
    hands: tuple[str, ...]
    """Node ids of the hands in its scenes."""
    geometry: tuple[str, ...]
    """Relations that only say where things happen to be: left out where there is no domain."""

    @property
    def good(self) -> Sequence[ForeignRun]:
        """Runs that went well, to be judged."""

    def failing(self) -> Iterator[ForeignRun]:
        """Runs made from them by one change each, in which a step is refused."""

    def demonstrations(self, run: ForeignRun) -> Sequence[ForeignRun]:
        """What a run made of this program is compared with: others of its task."""

    def domains(self) -> Mapping[str, Domain]:
        """Its domain, in one or several versions, each by what it is called in tables."""


class DataSet(Protocol):
    """Runs that somebody else recorded, in a folder; made with the folder, and its own options."""

    name: str
    domain: str
    """The name of the domain in whose words its plans are."""
    options: Mapping[str, Mapping[str, Any]]
    """Kind of part → options that its pictures need."""
    parts: Mapping[str, str]
    """Kind of part → the part that they need, where it is not the one of stored scenes."""

    def __len__(self) -> int:
        """How many runs there may be."""

    def runs(self, domain: Domain) -> Iterator[RecordedRun | Unread]:
        """Each run, or why it cannot be used."""


class PlanSet(Protocol):
    """Plans that somebody else wrote and what must never be so around their steps.

    Made with a file or a folder. A plan in whose domain something is left out says what.
    """

    name: str

    def __len__(self) -> int:
        """How many plans there may be."""

    def plans(self) -> Iterator[ForeignPlan | Unread]:
        """Each plan, or why it cannot be converted."""

    def domain(self, plan: ForeignPlan) -> Domain:
        """What a plan's steps need and do, and its safety rules; plans may share one."""


class Parts(Protocol):
    """What a part may borrow while it is built: its factory's first argument, called `parts`."""

    @property
    def domain(self) -> Domain:
        """Categories, predicates and skills of the run's domain."""

    @property
    def demonstrations(self) -> Sequence[Demonstration]:
        """The memory; InputError where there is none."""

    def part(self, kind: Kind[T], name: str | None = None, **options: Any) -> T:
        """The run's part of a kind, or one of another name with these options."""

    def name(self, kind: Kind[Any]) -> str:
        """What the run's part of a kind is called."""

    def options(self, kind: Kind[Any]) -> Mapping[str, Any]:
        """Its options, given and defaulted."""

    def given(self, kind: Kind[Any]) -> Mapping[str, Any]:
        """Those that were given."""

    def declared(self, kind: Kind[Any], name: str | None = None) -> Sequence[str]:
        """Every name of a kind; or every option of one part of it."""

    def lent(self, what: str) -> Any:
        """Something of this very run: "truth", "states", "task"; InputError where there is none."""


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


class Segmenter(Protocol):
    """Finds instances in a frame.

    One with a method `segment_all(frames)`, an answer for each, is asked for all frames of an
    observation at once. One whose `tracks` is False has no names of its own for things: the world
    is then spoken to as one that keeps its names to itself.
    """

    name: str

    def segment(self, frame: Frame) -> Sequence[Detection]:
        """Instance masks with categories; the same instance name over frames when it tracks."""


class Finder(Protocol):
    """Finds in pictures what phrases name: boxes, without outlines.

    `vocabulary` is all that it can be asked for, None for one that takes any phrase.
    """

    name: str
    vocabulary: Sequence[str] | None

    def find(
        self, pictures: Sequence[Rgb], phrases: Sequence[str]
    ) -> Sequence[Sequence[GroundedBox]]:
        """For each picture what was found in it; several boxes may be of one thing."""


class Outliner(Protocol):
    """Turns boxes into masks; `exact`: a mask ends where its thing ends."""

    name: str
    exact: bool

    def outline(self, frame: Frame, boxes: Sequence[Corners]) -> Sequence[Mask]:
        """For each box the (H, W) mask of the thing in it; an empty one where there is none."""


class StateEstimator(Protocol):
    """Reads states of detected objects off a frame."""

    name: str

    def estimate(
        self, frame: Frame, detections: Sequence[Detection]
    ) -> Sequence[Mapping[str, str | None]]:
        """For each detection: attribute → value, None where it cannot be told."""


class Perceiver(Protocol):
    """Turns observations into one scene graph that lives over the episode.

    One with a method `acted(subtask, succeeded)` is told each skill that was carried out and
    whether it is said to have succeeded, so that it can doubt what that may have changed.
    """

    def reset(self) -> None:
        """Forget everything."""

    def perceive(self, observation: Observation) -> SceneGraph:
        """Fuse an observation and return the whole graph as believed now."""

    def scope(self, graph: SceneGraph, subtask: Subtask) -> SceneGraph:
        """The part of a graph that concerns a (grounded) subtask, with its subtask node."""

    def describe(self) -> Mapping[str, str]:
        """Which segmenter, state estimator and image encoder are used (goes into every record)."""


class TextEncoder(Protocol):
    """Embeds short texts."""

    name: str

    def encode(self, texts: Sequence[str]) -> npt.NDArray[np.float32]:
        """(n, d) float32 rows of unit length."""


class ImageEncoder(Protocol):
    """Embeds pictures; what one encoder gives compares only with what the same one gives."""

    name: str

    def encode_crops(self, rgb: Rgb, masks: Sequence[Mask]) -> npt.NDArray[np.float32]:
        """(n, d) float32 rows of unit length, one for the object under each mask."""

    def encode_image(self, rgb: Rgb) -> npt.NDArray[np.float32]:
        """(d,) float32 of unit length: the whole picture."""


class Captioner(Protocol):
    """Says in a few sentences what a picture shows."""

    name: str

    def caption(self, observation: Observation, scoped: SceneGraph) -> str:
        """`scoped` is what perception made of the observation; a model that sees ignores it."""


class ImageTextEncoder(ImageEncoder, TextEncoder, Protocol):
    """Pictures and texts in one space, as CLIP has them."""

    reading: StateReading


class DemonstrationStore(Protocol):
    """Where demonstrations live."""

    def add(self, demonstration: Demonstration) -> str:
        """Store one successful run in one transaction; returns its id."""

    def all(self) -> Sequence[Demonstration]:
        """Every demonstration in id order (graphs loaded, images by reference)."""

    def required(self) -> Sequence[Demonstration]:
        """As `all`; MemoryFileError where there is none."""

    def close(self) -> None:
        """Free what the store holds."""


class Retriever(Protocol):
    """Context-aware reference retrieval (paper, Sec. 3)."""

    def retrieve(self, subtask: Subtask, task: str, done: int) -> Sequence[Reference]:
        """References for a subtask, best first; `done` is the position in the nominal plan."""


class GraphScorer(Protocol):
    """Compares an observed graph with an expected one."""

    def best(self, observed: SceneGraph, references: Sequence[Reference]) -> Verdict | None:
        """Score against every reference; None where there is none."""


class Detector(Protocol):
    """Judges whether a scene fits its references."""

    name: str

    def judge(
        self, observed: SceneGraph, observation: Observation | None, references: Sequence[Reference]
    ) -> Verdict:
        """`observed` is the scoped graph of the boundary; it may be all that there is."""


class LanguageModel(Protocol):
    """Answers questions in words, in a form that is asked for."""

    name: str

    def ask(self, request: Request, deadline: Deadline | None = None) -> Exchange:
        """What came of a question, in time: an answer, or a problem that says why there is none."""


class Expectations(Protocol):
    """What should hold before subtasks that no demonstration shows.

    The paper's third source of precondition states, beside demonstrations and what people say.
    """

    name: str

    def over(
        self,
        mined: Sequence[Precondition],
        subtask: Subtask,
        context: BoundaryContext,
        shown: Callable[[Subtask], bool],
    ) -> tuple[Precondition, ...]:
        """What was mined for a subtask, and what is expected; `shown`: has a demonstration."""

    def asked(self, context: BoundaryContext) -> tuple[Exchange, ...]:
        """What was asked of a language model at this boundary."""


class Reasoner(Protocol):
    """Explains a mismatch and says what must change (paper, "reasoning module")."""

    name: str

    def diagnose(self, context: BoundaryContext, verdict: Verdict) -> Diagnosis:
        """No `must_change` and no `advice`: nothing was found that must change."""


class Locator(Protocol):
    """Finds in what happened where a run went wrong, and says why (REFLECT's two stages)."""

    name: str

    def verify(self, context: BoundaryContext, tried: Tried) -> Verified:
        """Whether a subtask did what it is for, by what was seen after it."""

    def explain(
        self, context: BoundaryContext, story: Sequence[Tried], failed: Tried | None
    ) -> Located:
        """Why a step failed; where none did, what is wrong with the plan."""


class PlanValidator(Protocol):
    """Executes any plan on an observed graph."""

    @property
    def domain(self) -> Domain:
        """Whose skills it executes."""

    def check(self, plan: Plan, graph: SceneGraph, goal: Goal) -> PlanCheck:
        """Names the first step that cannot run and why; then checks the goal."""


class Replanner(Protocol):
    """Makes the corrected plan for the rest of the task (paper, "replanning module")."""

    name: str

    def replan(self, context: BoundaryContext, diagnosis: Diagnosis) -> Replan:
        """A plan that starts from the observed state and replaces what was left of the old one."""


class Strategy(Protocol):
    """Where a run may be interrupted; one loop serves all strategies."""

    name: str
    looks_after: LooksAfter

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        """Called with the perceived scene before each subtask."""

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        """Called after each subtask: with what is seen then, if it `looks_after` subtasks."""

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        """Called when the plan is finished; may ask for a further plan.

        With what is seen then, if it `looks_after` subtasks or episodes.
        """


class Listener(Protocol):
    """Records, pages, progress; cannot change an episode."""

    def on_start(self, record: EpisodeRecord) -> None:
        """The episode begins: what is known before it, without a boundary and without an end."""

    def on_boundary(self, boundary: BoundaryRecord, context: BoundaryContext) -> None:
        """A boundary was judged: its record, and what was known."""

    def on_executed(self, executed: ExecutedRecord, time_s: float) -> None:
        """A subtask was executed."""

    def on_end(self, record: EpisodeRecord) -> None:
        """The episode is over."""


@runtime_checkable
class LookListener(Protocol):
    """A listener that is told of every look, too, beside `Listener`: a log of what was seen."""

    def on_look(self, observation: Observation) -> None:
        """The robot has looked; nothing is believed of it yet."""


class GoalChecker(Protocol):
    """Scores a finished run on the truth (benchmark only)."""

    def check(self, goal: Goal, oracle: OracleView) -> tuple[bool, bool | None, tuple[str, ...]]:
        """Strict success, the weaker check of REFLECT, and what failed in words."""


__all__ = [name for name, value in list(globals().items()) if getattr(value, "_is_protocol", False)]
