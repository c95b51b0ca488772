"""What somebody else wrote or recorded: households, runs, plans."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol

from forestall.domain.model import Domain
from forestall.types.foreign import ForeignPlan, ForeignRun
from forestall.types.recorded import RecordedRun, Unread


class Foreign(Protocol):
    """A household that somebody else wrote, with runs of it; its options are its own."""

    name: str
    hands: tuple[str, ...]
    """Node ids of the hands in its scenes."""
    geometry: tuple[str, ...]
    """Relations that only say where things happen to be: left out where there is no domain."""
    exact: bool
    """Whether its scenes are what is so, and not what somebody saw."""

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
