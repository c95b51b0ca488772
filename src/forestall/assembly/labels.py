"""The words that a memory, a domain and a label itself have, so that a slip of the pen is found.

Called by `forestall demos label`; a new word is kept, one that is nearly an old one is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches

from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.types.demonstration import Demonstration
from forestall.types.facts import GRIPPER, Literal, category_of
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask

_HOW_NEAR = 0.6
_NEW = "; say --new where it is another word"


@dataclass(slots=True)
class KnownWords:
    """What has been said of things so far.

    Args:
        skills: name → how many arguments.
        relations: names.
        attributes: name → its values.
        things: ids and categories.
    """

    skills: dict[str, int] = field(default_factory=dict)
    relations: set[str] = field(default_factory=set)
    attributes: dict[str, set[str]] = field(default_factory=dict)
    things: set[str] = field(default_factory=lambda: {GRIPPER})

    def add_demonstrations(self, demonstrations: Iterable[Demonstration]) -> None:
        """Know the words of a memory."""
        for d in demonstrations:
            for step in d.steps:
                self.skills.setdefault(step.subtask.skill, len(step.subtask.args))
                self.add_graph(step.whole)
            if d.final is not None:
                self.add_graph(d.final)

    def add_graph(self, graph: SceneGraph) -> None:
        """Know the words of a scene."""
        self.relations |= {r.predicate for r in graph.relations}
        for node in graph.nodes:
            self.things |= {node.id, node.category}
            for attribute, value in node.states:
                self.attributes.setdefault(attribute, set()).update([value] if value else [])

    def add_domain(self, domain: Domain) -> None:
        """Know the words of a domain."""
        self.skills |= {s.name: len(s.parameters) for s in domain.skills.values()}
        self.relations |= domain.relations.keys()
        for attribute in domain.attributes.values():
            self.attributes.setdefault(attribute.name, set()).update(attribute.values)
        aliases = (a for c in domain.categories.values() for a in c.aliases)
        self.things |= {*domain.categories, *aliases, *domain.robot.hands}


def check_label(
    subtask: Subtask, facts: Sequence[Literal], known: KnownWords, *, new: bool = False
) -> None:
    """See that a label says what its words can mean.

    Args:
        subtask: before which it stands.
        facts: that should hold.
        known: words that were used before.
        new: whether words that are nearly known ones are new ones.

    Raises:
        InputError: a state without its value, a relation written as a state or the other way
            round, another number of arguments, or a word that is nearly a known one.
    """
    for fact in facts:
        _check_form(fact, known)
    arity = known.skills.get(subtask.skill)
    if arity is not None and arity != len(subtask.args):
        raise InputError(
            f"{subtask}: {subtask.skill} has {arity} argument(s), not {len(subtask.args)}"
        )
    if new:
        return
    _near("skill", subtask.skill, known.skills)
    for name in subtask.args:
        _near_thing(name, known.things)
    things = known.things | {x for a in subtask.args for x in (a, category_of(a))}
    for fact in facts:
        if fact.is_state:
            _near("attribute", fact.predicate, known.attributes)
            values = known.attributes.get(fact.predicate, set())
            _near(f"value of {fact.predicate}", fact.value, values)
        else:
            _near("relation", fact.predicate, known.relations)
        for name in fact.args:
            _near_thing(name, things)


def _check_form(fact: Literal, known: KnownWords) -> None:
    """A state has a value and one thing, a relation has two things and none."""
    name, args = fact.predicate, ", ".join(fact.args)
    if fact.is_state and name in known.relations:
        raise InputError(
            f"'{fact}' is written as a state, and {name} is a relation: write "
            f"{name}({fact.args[0]}, {fact.value})"
        )
    if fact.is_state and len(fact.args) != 1:
        raise InputError(f"'{fact}' gives a state to {len(fact.args)} things: write one for each")
    if fact.is_state or fact.value == "false":
        return
    if name in known.attributes:
        several = [f"{name}({args})={v}" for v in sorted(known.attributes[name])]
        write = " or ".join(several) or f"{name}(thing)=value"
        raise InputError(f"'{name}({args})' says no value: write {write}")
    if len(fact.args) == 1:
        meant = [f"{a}({args})={name}" for a, v in sorted(known.attributes.items()) if name in v]
        write = f"did you mean {' or '.join(meant)}?" if meant else "write attribute(thing)=value"
        raise InputError(f"'{name}({args})' is neither a state nor a relation: {write}")


def _near_thing(name: str, things: Iterable[str]) -> None:
    """A new thing of a known category is none to ask about."""
    several = set(things)
    if name not in several and category_of(name) not in several:
        _near("thing", name, several)


def _near(kind: str, name: str, known: Iterable[str]) -> None:
    several = sorted(known)
    if name not in several and get_close_matches(name, several, 1, _HOW_NEAR):
        raise InputError(f"{UnknownNameError(kind, name, several)}{_NEW}")
