"""What happened in one run, complete enough to rebuild and to redraw it."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from forestall.types.decision import Outcome
from forestall.types.drawing import html_of
from forestall.types.graph import SceneGraph
from forestall.types.observation import GripperState, Intrinsics, Observation, Vec3
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import When
from forestall.types.task import Task
from forestall.types.verdict import Diagnosis, Replan, Verdict


class SkillStatus(Enum):
    """How a skill ended."""

    SUCCEEDED = "succeeded"
    REFUSED = "refused"  # a need was not met; nothing changed but the robot's own position
    FAILED = "failed"  # it started and went wrong


@dataclass(frozen=True, slots=True)
class SkillOutcome:
    """The environment's answer to one subtask, as the robot's own controller would know it."""

    status: SkillStatus
    duration_s: float
    reason: str = ""
    hand_world_m: Vec3 | None = None  # where the hand let go of something


SLIP = "slip"
"""Kind of the event that a motion of the robot did not come out as it was meant."""


@dataclass(frozen=True, slots=True)
class Event:
    """One thing that happened in the world (oracle side): time, kind, objects, words."""

    time_s: float
    kind: str
    objects: tuple[str, ...]
    text: str


@dataclass(frozen=True, slots=True)
class StoredFrame:
    """One picture of a stored observation.

    `camera_to_world` has the rows of the (4, 4) pose. `picture` is the path of the picture relative
    to the folder of the record, None where it was not kept.
    """

    intrinsics: Intrinsics
    camera_to_world: tuple[tuple[float, ...], ...]
    picture: str | None = None


@dataclass(frozen=True, slots=True)
class StoredObservation:
    """An observation by reference: where the cameras stood, and which files hold the pictures."""

    frames: tuple[StoredFrame, ...]
    gripper: GripperState
    time_s: float
    robot_position_world_m: Vec3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class BoundaryRecord:
    """One subtask boundary: what was seen, judged and decided before the subtask.

    `seconds` is the measured time that this boundary took, `compute_s` that of the run until it was
    decided, both by phase.
    """

    index: int  # position among all boundaries
    subtask: Subtask  # as grounded
    graph: SceneGraph  # whole fused graph
    scoped: SceneGraph  # what concerns the subtask
    observation: Observation | StoredObservation | None
    looks: int
    verdict: Verdict | None
    diagnosis: Diagnosis | None = None
    replan: Replan | None = None
    why: str = ""  # the strategy's reason, where the verdict does not say it all
    seconds: tuple[tuple[str, float], ...] = ()  # compute by phase
    time_s: float = 0.0  # simulated
    when: When = (
        When.BEFORE
    )  # of the subtask: judged before it, after it, or at the end of the plan
    watched: tuple[Verdict, ...] = ()  # what further detectors said of the same observation
    outcome: Outcome | None = None  # what the monitor decided
    compute_s: tuple[tuple[str, float], ...] = ()
    sentence: str = ""  # what the owner is told


@dataclass(frozen=True, slots=True)
class ExecutedRecord:
    """One executed subtask; `index` is that of the boundary before it."""

    subtask: Subtask
    outcome: SkillOutcome
    index: int


STORED = "stored observations"
"""What stands in the place of a scenario where scenes were judged and nothing was carried out."""


class EpisodeEnd(Enum):
    """Why an episode ended."""

    PLAN_FINISHED = "plan finished"
    SUBTASK_LIMIT = "subtask limit"
    REPLAN_LIMIT = "replan limit"  # a further plan was asked for than may be adopted
    STOPPED = "stopped safely"
    HELD = "held"  # something of ours failed, was late or went wrong too often; see `trouble`
    ERROR = "error"  # the world failed
    UNFINISHED = "unfinished"  # the record breaks off: the run was killed, or is not over


class TroubleKind(Enum):
    """What sort of thing went wrong inside a run."""

    LATE = "did not answer in time"
    INTERNAL = "internal error"  # a mistake in a program of ours, or in somebody's part
    FAILED = "failed"  # a part said what is wrong
    WORLD = "the world failed"
    SENSES = "senses not to be trusted"
    TOO_MANY = "too many in a row"


@dataclass(frozen=True, slots=True)
class Trouble:
    """Why a run was held or broke off: which part, what it did, in words.

    `trace` is where in the program an internal error came up, for whoever mends it.
    """

    kind: TroubleKind
    part: str
    text: str
    trace: str = ""


@dataclass(frozen=True, slots=True)
class EpisodeRecord:
    """The record of one run.

    `notes` say what else befell it: whether the robot could be told to hold, listeners that failed
    or were late, a scorer that failed.
    """

    task: Task
    scenario: str | None
    strategy: str
    seed: int
    initial_plan: Plan
    boundaries: tuple[BoundaryRecord, ...]
    executed: tuple[ExecutedRecord, ...]
    end: EpisodeEnd
    success: bool | None = None  # strict check, filled by the scorer
    weak_success: bool | None = None  # REFLECT's own check
    failures: tuple[str, ...] = ()  # which goal facts failed, in words
    events: tuple[Event, ...] = ()  # oracle history, filled by the scorer
    harmed: tuple[tuple[float, str], ...] = ()  # what must never happen and did: when, words
    simulated_s: float = 0.0
    compute_s: tuple[tuple[str, float], ...] = ()
    final: SceneGraph | None = None  # everything known after the last subtask, if anybody looked
    provenance: tuple[tuple[str, Any], ...] = field(default=(), hash=False)
    trouble: Trouble | None = None
    notes: tuple[str, ...] = ()

    def _repr_html_(self) -> str:
        return html_of(self)
