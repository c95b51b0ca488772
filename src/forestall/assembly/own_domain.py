"""The domain of demonstrations when nobody names one: one with their skills, or a learnt one.

Called by `checking`, `mined` and the command line.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from forestall.assembly.corrections import beside_all, needing
from forestall.config import DEFAULT_DOMAIN
from forestall.domain.load import shipped, shipped_names
from forestall.domain.model import Domain
from forestall.learning.learn import learn
from forestall.types.demonstration import Demonstration


@dataclass(frozen=True, slots=True)
class OwnDomain:
    """A domain, and where it comes from.

    Args:
        domain: that all demonstrations fit.
        learnt: whether it was learnt from them.
        limits: what it therefore cannot know, a sentence each.
    """

    domain: Domain
    learnt: bool = False
    limits: tuple[str, ...] = ()


def domain_of_demonstrations(
    demonstrations: Sequence[Demonstration], memory: str | None = None
) -> OwnDomain:
    """The shipped domain with every skill that was shown, the default first; else a learnt one.

    Args:
        demonstrations: that are compared with.
        memory: their file; what a person corrected beside it is no need of a learnt domain.

    Raises:
        InputError: nothing can be learnt from them, or the corrections do not fit.
    """
    for name in (DEFAULT_DOMAIN, *(n for n in shipped_names() if n != DEFAULT_DOMAIN)):
        domain = shipped(name)
        if all(fits(d, domain) for d in demonstrations):
            return OwnDomain(domain)
    found = learn(demonstrations)
    memories = () if memory is None else (memory,)
    return OwnDomain(corrected(found.domain, memories), True, found.limits)


def corrected(domain: Domain, memories: Iterable[str | Path]) -> Domain:
    """A learnt domain, whose needs are mined themselves, with the corrections beside memories.

    Raises:
        FileFormatError: see `corrections.read_corrections`.
    """
    found = beside_all(memories, domain)
    return domain if found is None else needing(domain, found)


def fits(demonstration: Demonstration, domain: Domain) -> bool:
    """Whether a domain has the skills of a demonstration, with as many arguments."""
    skills = domain.skills
    return all(
        s.subtask.skill in skills and len(s.subtask.args) == len(skills[s.subtask.skill].parameters)
        for s in demonstration.steps
    )
