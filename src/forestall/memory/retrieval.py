"""Context-aware reference retrieval (paper, Sec. 3): which demonstrated steps are like this one.

Called by strategies at each boundary; calls the text encoder. Exact search in one matrix. Steps of
the same words come first: their whole scene can be compared. After them come steps of the same
skill on other things that play the same part, of any task, which say what the skill needs and
nothing else (`Reach.ROLE`).
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from forestall.domain.model import Domain
from forestall.errors import InputError, MemoryFileError
from forestall.seams.judging import DemonstrationStore
from forestall.seams.perceiving import TextEncoder
from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.facts import category_of
from forestall.types.plan import Subtask
from forestall.types.verdict import Reach, Reference

_NUMBER = re.compile(r"-\d+\b")


@dataclass(frozen=True, slots=True)
class RetrievalConfig:
    """Which stored steps count as references.

    Args:
        k: how many references at most; None: every step above the floor, so that among many equal
            texts the scene decides and no demonstration is stored in vain.
        floor: smallest similarity of the subtask texts. With hashed words the ten tasks' subtasks
            score 1.0 for the same words, 0.87 at most for other things handled alike, 0.55 to
            0.75 for the same skill on another object. A scene without the object at hand cannot
            come near the detector's threshold, so such steps are no references by default.
        per_demonstration: how many steps of one demonstration at most. Two, so that a subtask that
            occurs twice in a task is not taken for its other occurrence without a contradiction.
        same_task_bonus: added to a similarity for ranking when the step is of the same task.
        same_skill: whether only steps of the same skill count (those of one family are one).
        roles: how many steps of the same skill on other things at most, one of a demonstration;
            those come first that share most of what the things are good for.
    """

    k: int | None = None
    floor: float = 0.9
    per_demonstration: int = 2
    same_task_bonus: float = 0.05
    same_skill: bool = True
    roles: int = 4

    def __post_init__(self) -> None:
        if (self.k is not None and self.k < 1) or self.per_demonstration < 1:
            raise InputError("k and per_demonstration are at least 1")
        if self.roles < 0:
            raise InputError("roles is at least 0")


@dataclass(frozen=True, slots=True)
class _Entry:
    demonstration: Demonstration
    position: int  # in demonstration.steps
    step: DemonstrationStep


def subtask_words(subtask: Subtask, domain: Domain) -> str:
    """The text that is compared: the subtask's words without instance numbers.

    All numbers are stripped: a mug is a mug in every kitchen, and what was learnt in front of one
    burner serves in front of another. Skills of one family have one verb.
    """
    return _NUMBER.sub("", domain.text(subtask))


class EmbeddingRetriever:
    """References by similarity of the subtask texts (implements `Retriever`).

    Args:
        demonstrations: a store, or the demonstrations themselves.
        encoder: embeds subtask texts.
        domain: the words and families of skills.
        config: how many references, and how similar.

    Raises:
        MemoryFileError: there are no demonstrations.
    """

    def __init__(
        self,
        demonstrations: DemonstrationStore | Sequence[Demonstration],
        encoder: TextEncoder,
        domain: Domain,
        config: RetrievalConfig | None = None,
    ) -> None:
        loaded = demonstrations if isinstance(demonstrations, Sequence) else demonstrations.all()
        self._encoder = encoder
        self._domain = domain
        self._config = config or RetrievalConfig()
        self._entries = [
            _Entry(d, i, s)
            for d in sorted(loaded, key=lambda d: d.id)
            for i, s in enumerate(d.steps)
        ]
        if not self._entries:
            raise MemoryFileError(
                "the memory holds no demonstrations: add some with 'forestall demos add'"
            )
        words = [subtask_words(e.step.subtask, domain) for e in self._entries]
        texts = list(dict.fromkeys(words))
        place = {text: i for i, text in enumerate(texts)}
        self._texts = encoder.encode(texts)
        self._text = np.array([place[w] for w in words])
        self._tasks = np.array([e.demonstration.task for e in self._entries])
        self._indices = np.array([e.step.index for e in self._entries])
        self._skills = np.array([domain.family(e.step.subtask) for e in self._entries])
        self._sorts: dict[str, dict[tuple[tuple[str, ...], str], list[_Entry]]] = defaultdict(dict)
        for e in self._entries:
            sort = (_kinds(e.step.subtask.args, domain), e.demonstration.task)
            self._sorts[domain.family(e.step.subtask)].setdefault(sort, []).append(e)
        self._made: dict[tuple[int, float], Reference] = {}

    def retrieve(self, subtask: Subtask, task: str, done: int) -> Sequence[Reference]:
        """References for a subtask, best first; none above the floor and no role: an empty list.

        Ranked by similarity with the bonus of the same task; among equals the step whose position
        in its demonstration is closest to `done` comes first, then demonstration and position.
        """
        found = self._scenes(subtask, task, done)
        return [*found, *self._roles(subtask, task, {r.demonstration for r in found})]

    def _scenes(self, subtask: Subtask, task: str, done: int) -> list[Reference]:
        config = self._config
        alike = self._texts @ self._encoder.encode([subtask_words(subtask, self._domain)])[0]
        similarity = np.minimum(np.round(alike.astype(np.float64), 6), 1.0)[self._text]
        allowed = similarity >= config.floor
        if config.same_skill:
            allowed &= self._skills == self._domain.family(subtask)
        near = np.flatnonzero(allowed)
        rank = similarity[near] + config.same_task_bonus * (self._tasks[near] == task)
        gap = np.abs(self._indices[near] - done)
        found: list[Reference] = []
        used: dict[int, int] = {}
        for i in near[np.lexsort((near, gap, -rank))].tolist():
            owner = id(self._entries[i].demonstration)
            if used.get(owner, 0) >= config.per_demonstration:
                continue
            used[owner] = used.get(owner, 0) + 1
            found.append(self._reference(i, float(similarity[i])))
            if len(found) == config.k:
                break
        return found

    def _reference(self, place: int, similarity: float) -> Reference:
        """Made once: at every look of every boundary many are handed out."""
        found = self._made.get((place, similarity))
        if found is None:
            found = self._made[place, similarity] = _reference(self._entries[place], similarity)
        return found

    def _roles(self, subtask: Subtask, task: str, but: set[str]) -> list[Reference]:
        """Steps of the same skill on other things, best first, a few of every sort.

        What they share is the mean over the arguments of how many tags and attributes both have.
        """
        if not self._config.roles:
            return []
        own = _kinds(subtask.args, self._domain)
        groups = [
            (self._shared(own, kinds), elsewhere == task, elsewhere, kinds, entries)
            for (kinds, elsewhere), entries in self._sorts.get(
                self._domain.family(subtask), {}
            ).items()
            if len(kinds) == len(own)
        ]
        ranked = sorted(groups, key=lambda g: (-g[0], *g[1:4]))
        found: list[Reference] = []
        used = set(but)
        for of_each in range(self._config.roles):  # many of one sort say no more than one
            for shared, _, _, _, entries in ranked:
                if of_each < len(entries) and entries[of_each].demonstration.id not in used:
                    used.add(entries[of_each].demonstration.id)
                    reference = _reference(entries[of_each], round(shared, 6))
                    found.append(replace(reference, reach=Reach.ROLE))
                    if len(found) == self._config.roles:
                        return found
        return found

    def _shared(self, own: tuple[str, ...], other: tuple[str, ...]) -> float:
        parts = [self._alike(a, b) for a, b in zip(own, other, strict=True)]
        return sum(parts) / len(parts) if parts else 1.0

    def _alike(self, one: str, other: str) -> float:
        if one == other:
            return 1.0
        first, second = self._domain.kinds(one) - {one}, self._domain.kinds(other) - {other}
        return len(first & second) / max(len(first | second), 1)


def _kinds(args: Sequence[str], domain: Domain) -> tuple[str, ...]:
    return tuple(category_of(domain.canonical(a)) for a in args)


def _reference(entry: _Entry, similarity: float) -> Reference:
    demonstration = entry.demonstration
    return Reference(
        demonstration=demonstration.id,
        task=demonstration.task,
        index=entry.step.index,
        subtask=entry.step.subtask,
        similarity=similarity,
        graph=entry.step.graph,
        later=tuple(s.subtask for s in demonstration.steps[entry.position :]),
        view=entry.step.view,
        after=demonstration.after(entry.position),
    )
