"""What the comparison of observed and expected graphs says."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from numbers import Real

from forestall.errors import InputError
from forestall.types.demonstration import View
from forestall.types.drawing import html_of
from forestall.types.exchange import Exchange
from forestall.types.facts import Literal, Truth
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan, Subtask


class Decision(Enum):
    """What a strategy or a detector asks for at a boundary."""

    PROCEED = "proceed"
    LOOK_AGAIN = "look_again"
    REPLAN = "replan"
    STOP = "stop"


class Calibration(Enum):
    """Where a threshold comes from."""

    FIXED = "fixed"
    CALIBRATED = "calibrated"
    UNCALIBRATED = "uncalibrated"


class Reach(Enum):
    """How much of a demonstrated step speaks of the subtask at hand."""

    SCENE = "scene"  # the same words: the whole scene can be compared
    ROLE = "role"  # the same skill on what plays the same part: what the skill needs, and no more


@dataclass(frozen=True, slots=True)
class Threshold:
    """Where a detector draws the line, and what that rests on.

    Args:
        value: scores below it are alarms.
        calibration: where it comes from; a calibration that cannot bound false alarms here leaves
            the detector's own threshold and is called uncalibrated.
        note: the same in words, "" where somebody fixed it.
    """

    value: float
    calibration: Calibration = Calibration.FIXED
    note: str = ""


@dataclass(frozen=True, slots=True)
class Reference:
    """A retrieved demonstration step: its graph just before the subtask."""

    demonstration: str  # id of the demonstration
    task: str
    index: int
    subtask: Subtask
    similarity: float  # of the subtask texts
    graph: SceneGraph
    later: tuple[Subtask, ...] = ()  # what the demonstration did afterwards, this step first
    view: View | None = None  # the picture as a whole, where it was kept
    after: SceneGraph | None = None  # everything that was known after the step, if anybody looked
    reach: Reach = Reach.SCENE


def scenes(references: Sequence[Reference]) -> tuple[Reference, ...]:
    """The references whose whole scene can be compared."""
    return tuple(r for r in references if r.reach is Reach.SCENE)


def demonstrations_of(references: Sequence[Reference]) -> int:
    """How many demonstrations some references come from; one may have several fitting steps."""
    return len({r.demonstration for r in references})


@dataclass(frozen=True, slots=True)
class ScoreParts:
    """The paper's score (Eqs. 1-3) and its parts; None where a part is switched off."""

    score: float
    node: float | None
    edge: float | None
    structure: float | None


class Change(Enum):
    """Kinds of difference between an expected and an observed graph."""

    MISSING_OBJECT = "missing object"
    EXTRA_OBJECT = "extra object"
    STATE = "state"
    MISSING_RELATION = "missing relation"
    EXTRA_RELATION = "extra relation"


@dataclass(frozen=True, slots=True, order=True)
class Discrepancy:
    """One readable difference: what was expected, what was observed."""

    change: Change = field(compare=False)
    subject: str  # the observed node id, or the expected one for what is missing
    expected: str
    observed: str
    text: str


class Specificity(Enum):
    """Of which demonstrations a precondition is mined, the narrowest first."""

    TASK = "this task"  # and the same kinds of things
    CATEGORY = "any task"  # the same kinds of things
    PART = "any kind"  # any task, and every kind of thing that plays the same part


@dataclass(frozen=True, slots=True)
class Support:
    """In how many demonstrations at one level a literal held, and in how many it was observed."""

    level: Specificity
    true: int
    seen: int


@dataclass(frozen=True, slots=True)
class Precondition:
    """A lifted literal that held in the demonstrations before a skill.

    `literal` uses the skill's variables (and category names for other things). `support` of `total`
    demonstrations had it true; the others had it unobserved or false. `weight` is the probability
    that it is a need and no habit. `kept` is the level that support and weight are of; `levels` has
    the support at each. A demonstration counts once, however often and on whatever things it used
    the skill. `elsewhere` counts those in which it held at other times for things of these kinds,
    and those in which it did not, once for each kind: without the second nothing ever varied.
    `by_hand`: a person says so. `expected_by`: the language model that says so; nobody showed it.
    """

    skill: str
    literal: Literal
    support: int
    total: int
    weight: float = 1.0
    kept: Specificity = Specificity.CATEGORY
    levels: tuple[Support, ...] = ()
    elsewhere: tuple[int, int] = (0, 0)
    by_hand: bool = False
    expected_by: str = ""


@dataclass(frozen=True, slots=True)
class Violation:
    """A mined precondition that does not hold now, ground on the observed graph.

    `ahead` counts the steps of the plan until the one that it is a precondition of; `undoable` is
    False where the plan, if nothing is done, does something because of it that cannot be undone.
    """

    precondition: Precondition
    literal: Literal  # ground
    truth: Truth  # FALSE or UNOBSERVED
    ahead: int = 0
    undoable: bool = True


@dataclass(frozen=True, slots=True)
class Verdict:
    """A detector's answer at one boundary.

    Raises:
        InputError: a decision that is none, a score that is no number: what a plug-in answers is
            not believed before it was looked at.
    """

    decision: Decision
    detector: str
    score: float | None  # None: no reference to compare with
    threshold: float
    calibration: Calibration
    parts: ScoreParts | None = None
    nearest: Reference | None = None
    matches: tuple[tuple[str, str], ...] = ()  # (observed id, expected id in the nearest)
    discrepancies: tuple[Discrepancy, ...] = ()
    references: int = 0  # demonstrations that there was something to compare with of
    note: str = ""
    lacking: tuple[Literal, ...] = ()  # facts that should hold and do not, where it knows any
    p_value: float | None = None  # how rare a score this low is in good runs; None: not calibrated
    expected_by: str = ""  # the language model that this rests on, and no demonstration
    exchanges: tuple[Exchange, ...] = ()  # with a language model, about what should hold here

    def __post_init__(self) -> None:
        if not isinstance(self.decision, Decision):
            raise InputError(
                f"a verdict decides {' or '.join(d.value for d in Decision)}, not {self.decision!r}"
            )
        _check_number("threshold", self.threshold)
        if self.score is not None:
            _check_number("score", self.score)

    def _repr_html_(self) -> str:
        return html_of(self)

    @property
    def judged(self) -> bool:
        """Whether anything was compared or checked; without a reference nothing is."""
        return self.score is not None or self.calibration is not Calibration.UNCALIBRATED


def _check_number(what: str, number: object) -> None:
    if not isinstance(number, Real) or math.isnan(number):
        raise InputError(f"the {what} of a verdict is a number, not {number!r}")


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Why the scene does not fit, and what must change.

    `must_change` are ground literals that should hold and do not; `must_stay` hold and should be
    kept. Without both `must_change` and `advice` nothing was found that must change. Where what is
    left of the plan was checked, `step` is its step that would be refused, None where all would
    run, and `refusal` says what is lacking; without a refusal `step` was tried. Where the evidence
    is demonstrations, the fact that weighs most held in the first number of `support` of the
    second.
    """

    cause: str
    must_change: tuple[Literal, ...]
    must_stay: tuple[Literal, ...] = ()
    culprits: tuple[str, ...] = ()  # ids of the objects that the cause speaks about
    producer: str = ""
    step: Subtask | None = None
    refusal: str = ""
    support: tuple[int, int] | None = None
    why: str = ""  # how the cause leads to a failure, where somebody says so
    advice: str = ""  # what to do about it, in words
    exchanges: tuple[Exchange, ...] = ()  # with a language model, in their order

    def _repr_html_(self) -> str:
        return html_of(self)

    @property
    def found(self) -> bool:
        """Whether something was found that must change, be it in words alone."""
        return bool(self.must_change or self.advice)


class ReplanOutcome(Enum):
    """How a replanning attempt ended; the cases are told apart on purpose."""

    SOLVED = "solved"
    NOTHING_TO_CHANGE = "nothing to change"
    UNSOLVABLE = "unsolvable"  # proven on the observed state, with nothing left out
    NOT_FOUND = "not found"  # the search was cut short or left something out; nothing is proven
    TIMEOUT = "timeout"
    REJECTED = "rejected"  # a plan was made and the validator refused it
    UNSUPPORTED = "unsupported"  # the goal cannot be expressed for this engine


@dataclass(frozen=True, slots=True)
class PlanCheck:
    """The validator's answer: does the plan run on the observed state and reach the goal?

    `step` is the index of the first step that cannot run (None if all run), `reason` the condition
    it lacks in words, `lacking` the same as literals. `unmet` are goal literals false at the end.
    """

    ok: bool
    step: int | None = None
    reason: str = ""
    lacking: tuple[Literal, ...] = ()
    unmet: tuple[Literal, ...] = ()
    assumed: tuple[Literal, ...] = ()  # unobserved facts that the plan relies on
    plan: Plan | None = None  # the plan as it was checked: every argument an instance


@dataclass(frozen=True, slots=True)
class Replan:
    """A replanning attempt and its plan for the rest of the task."""

    outcome: ReplanOutcome
    plan: Plan | None = None
    check: PlanCheck | None = None
    producer: str = ""
    expanded: int = 0  # search nodes
    seconds: float = 0.0
    note: str = ""
    looking_for: tuple[str, ...] = ()  # the plan goes where these may be
    exchanges: tuple[Exchange, ...] = ()  # with a language model, in their order
