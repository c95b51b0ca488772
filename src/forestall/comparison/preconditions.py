"""Preconditions mined from demonstrations: what held before a skill, and what of it does not now.

Called by the reasoner (through the functions that it is given); calls lifting. The simplest form of
mining: a literal that held in every retrieved demonstration and was false in none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from forestall.comparison.lifting import Kind, evaluate, kind_of, lift
from forestall.domain.model import Domain
from forestall.errors import InputError
from forestall.types.facts import Literal, Truth, category_of
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.verdict import Precondition, Reference, Violation

__all__ = ["MiningConfig", "lift", "mine", "violations"]


@dataclass(frozen=True, slots=True)
class MiningConfig:
    """How much evidence a precondition needs.

    Args:
        minimum_support: demonstrations in which the literal must have held; all of them, where
            there are fewer. One is enough to raise an alarm, whose cause says that it is one.
        contextual_support: the same for a literal about what is not an argument of the subtask.
    """

    minimum_support: int = 2
    contextual_support: int = 3

    def __post_init__(self) -> None:
        if self.minimum_support < 1 or self.contextual_support < 1:
            raise InputError("a precondition needs the support of at least one demonstration")


def mine(
    references: Sequence[Reference],
    domain: Domain,
    config: MiningConfig | None = None,
    *,
    subtask: Subtask | None = None,
    task: str | None = None,
) -> tuple[Precondition, ...]:
    """Literals that held in all references of a skill with the same kinds of arguments.

    Where fewer than `minimum_support` demonstrations have the same kinds of arguments, all
    references of the skill are used, but only for literals that follow from the skill itself.
    Literals of the material are mined from the task at hand alone:
    that a thing was clean before one task says nothing about moving it out of the way. So are
    literals about what is no argument of the subtask; their support must come from one step.
    What was not observed in a demonstration counts neither for nor against a literal.

    Args:
        references: as retrieved, best first.
        domain: categories and how they hold things.
        config: how much evidence is needed.
        subtask: the subtask at hand; that of the best reference by default.
        task: name of the task at hand; that of the best reference by default.

    Returns:
        Preconditions, the best supported first; `support` and `total` count demonstrations, also
        where several steps of one were retrieved.
    """
    config = config or MiningConfig()
    if not references:
        return ()
    subtask = subtask or references[0].subtask
    task = task if task is not None else references[0].task
    skill = [r for r in references if domain.family(r.subtask) == domain.family(subtask)]
    kinds = _kinds(subtask, domain)
    same = [r for r in skill if _kinds(r.subtask, domain) == kinds]
    alike = len(_runs(same)) >= min(config.minimum_support, len(_runs(skill)))
    group = same if alike else skill
    step = next((r.index for r in group if r.task == task), None)
    candidates: set[Literal] = set()
    for r in group:
        candidates |= lift(r.graph, r.subtask, domain)
    found = []
    for literal in sorted(candidates):
        kind = kind_of(literal, domain, domain.skills.get(subtask.skill))
        if not alike and kind is not Kind.SKILL:
            continue
        asked = group if kind is Kind.SKILL else [r for r in group if r.task == task]
        truths = [evaluate(literal, r.graph, r.subtask, domain) for r in asked]
        if Truth.FALSE in truths:
            continue
        true = [r for t, r in zip(truths, asked, strict=True) if t is Truth.TRUE]
        counted = [r for r in true if kind is not Kind.CONTEXT or r.index == step]
        needed = min(config.minimum_support, len(_runs(asked)))
        if kind is Kind.CONTEXT:
            needed = config.contextual_support
        if true and len(_runs(counted)) >= needed:
            support, total = len(_runs(true)), len(_runs(asked))
            found.append(Precondition(subtask.skill, literal, support, total, support / total))
    return tuple(sorted(found, key=lambda p: (-p.weight, p.literal)))


def violations(
    preconditions: Sequence[Precondition], graph: SceneGraph, subtask: Subtask, domain: Domain
) -> tuple[Violation, ...]:
    """Preconditions that are false or unobserved in a graph, false ones first.

    Preconditions of other skills are passed over. The literal of a violation has the subtask's
    arguments in the place of the variables.
    """
    found = []
    for p in preconditions:
        if domain.family(Subtask(p.skill, ())) != domain.family(subtask):
            continue
        truth = evaluate(p.literal, graph, subtask, domain)
        if truth is not Truth.TRUE:
            found.append(Violation(p, p.literal.bind(domain.bound(subtask)), truth))
    return tuple(
        sorted(
            found,
            key=lambda v: (v.truth is not Truth.FALSE, -v.precondition.weight, v.literal),
        )
    )


def _runs(references: Sequence[Reference]) -> set[str]:
    return {r.demonstration for r in references}


def _kinds(subtask: Subtask, domain: Domain) -> tuple[str, ...]:
    return tuple(category_of(domain.canonical(a)) for a in subtask.args)
