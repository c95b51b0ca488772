"""Whether a scene fits, why not, what instead, and where a run may be interrupted for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from forestall.domain.model import Domain
from forestall.types.demonstration import Demonstration
from forestall.types.episode import SkillOutcome
from forestall.types.exchange import Exchange
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer
from forestall.types.story import Located, Tried, Verified
from forestall.types.task import Goal
from forestall.types.verdict import Diagnosis, PlanCheck, Precondition, Reference, Replan, Verdict


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
