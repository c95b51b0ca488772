"""Where somebody has looked, and what is said of a thing that was not there.

Called by strategies, which see, and by the replanner, which looks elsewhere; calls `truth`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from forestall.domain.model import LOCATED, Domain
from forestall.domain.truth import is_shut
from forestall.types.facts import Literal, Truth, category_of
from forestall.types.graph import SceneGraph, Seen
from forestall.types.plan import Subtask


def in_sight(category: str, domain: Domain) -> bool:
    """Whether it has many things in or on it by nature, and nothing must be opened to see them."""
    is_a, roles = domain.is_a, domain.roles
    if is_a(category, roles.ground) or domain.encloses(category):
        return False
    return is_a(category, roles.crowded) or is_a(category, roles.support)


def looked_into(graph: SceneGraph, domain: Domain) -> frozenset[str]:
    """Places that can be shut and whose inside is in sight."""
    return frozenset(
        n.id
        for n in graph.nodes
        if n.seen is Seen.VISIBLE and n.id not in graph.hidden and domain.encloses(n.category)
        and is_shut(domain, n.category, dict(n.states)) is Truth.FALSE
    )  # fmt: skip


def looked_over(graph: SceneGraph, done: Subtask, domain: Domain) -> frozenset[str]:
    """Places in sight and not shut at which the robot stands: those of the step it did last.

    A kind of place in a step tells none; what was put there tells which it is.
    """
    here = [name for name in done.args if graph.get(name) is not None]
    for name in here:  # grows: what each of them is in or on
        here += [p for p in graph.parents(name, domain.containing) if p not in here]
    found = (graph.get(name) for name in here)
    return frozenset(
        n.id for n in found if n is not None and n.seen is Seen.VISIBLE and n.id not in graph.hidden
    )


def not_there(name: str, places: Iterable[str], domain: Domain) -> tuple[Literal, ...]:
    """That a thing is in none of some places."""
    return tuple(
        Literal(relation, (name, place), "false")
        for place in sorted(places)
        if (relation := domain.offers(place)) is not None
    )


def searched(name: str, facts: Sequence[Literal], domain: Domain) -> tuple[str, ...]:
    """The places in which a thing is not, by what `not_there` gave."""
    return tuple(
        x.args[1]
        for x in facts
        if x.value == "false" and x.predicate in domain.containing and x.args[0] == name
    )


def is_there(graph: SceneGraph, name: str) -> bool:
    """Whether some thing of a name or of a category is located, or in view."""
    return any(
        n.box_m is not None or n.seen is Seen.VISIBLE
        for n in graph.nodes
        if name in (n.id, n.category)
    )


def made_of_what_is_there(names: Iterable[str], graph: SceneGraph, domain: Domain) -> set[str]:
    """Those of some things that a skill makes of something whose place is known."""
    there = {c for n in graph.nodes if is_there(graph, n.id) for c in domain.becomes(n.category)}
    return {n for n in names if category_of(domain.canonical(n)) in there}


def made_of(names: Iterable[str], graph: SceneGraph, domain: Domain) -> tuple[str, ...]:
    """Of what skills make those of some things that nobody has seen yet; by name."""
    unmade = {category_of(domain.canonical(n)) for n in names if not graph.matches(n)}
    return tuple(sorted(c for c in domain.categories if domain.becomes(c) & unmade))


def missing(facts: Iterable[Literal], graph: SceneGraph, domain: Domain) -> tuple[Literal, ...]:
    """What is to be in some state or place and is nowhere to be seen, as facts that it is located.

    Hands are felt, and what a skill makes of other things need not be there yet.
    """
    made = {kind for c in domain.categories for kind in domain.becomes(c)}
    names = (a for x in facts if x.value != "false" for a in x.args)
    return tuple(
        Literal(LOCATED, (name,))
        for name in dict.fromkeys(names)
        if name not in domain.robot.hands
        and category_of(domain.canonical(name)) not in made
        and not is_there(graph, name)
    )
