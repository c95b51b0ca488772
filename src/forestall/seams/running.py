"""Around a run: what parts borrow, who listens, and who scores it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, TypeVar, runtime_checkable

from forestall.domain.model import Domain
from forestall.seams.acting import OracleView
from forestall.types.demonstration import Demonstration
from forestall.types.episode import BoundaryRecord, EpisodeRecord, ExecutedRecord
from forestall.types.kind import Kind
from forestall.types.observation import Observation
from forestall.types.runtime import BoundaryContext
from forestall.types.task import Goal

T = TypeVar("T")


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
