"""Start scenes of symbolic worlds: what a task needs, drawn by seed, as a scene graph.

Called by `symbolic_world`; calls the domain. There is one fixture of every category, a few of those
that only numbers tell apart, and as many more as the needs name; a further thing or another state
of one thing moves nothing else.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from zlib import crc32

import numpy as np

from forestall.domain.evaluate import evaluate
from forestall.domain.model import Domain
from forestall.domain.truth import GraphView
from forestall.domain.view import TRUE
from forestall.errors import InputError
from forestall.types.facts import by_number, is_instance
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.scene import SceneNeeds

NUMBERED = 4
"""How many there are of fixtures that only numbers tell apart."""


def start_scene(domain: Domain, needs: SceneNeeds, seed: int) -> SceneGraph:
    """The scene of a seed, without geometry.

    Raises:
        InputError: a thing is wanted at a place that is not there or does not take it.
    """
    drawn = _Scene(domain, needs, seed)
    for need in needs.objects:
        drawn.add(need.id, need.category, need.states)
    for need in needs.objects:
        drawn.put(need.id, need.places)
        if need.in_front_of is not None:
            drawn.block(need.id, need.in_front_of)
    drawn.strew()
    return SceneGraph(tuple(drawn.nodes.values()), tuple(drawn.relations))


def relation_at(domain: Domain, thing: str, place: str) -> str:
    """The relation in which a thing is at a place: by what predicates are about, else by skills.

    Raises:
        InputError: no relation of the domain says that it is there.
    """
    fitting = [r for r in domain.containing if _about(domain, r, (thing, place))]
    if not fitting:
        raise InputError(f"no relation of {domain.name} says that {thing} is at {place}")
    view = GraphView(SceneGraph((_node(domain, thing), _node(domain, place))), domain)
    for skill in domain.skills.values() if len(fitting) > 1 else ():
        others = [p.name for p in skill.parameters if p.name != skill.hand]
        for effect in skill.effects:
            for fact in effect.facts:
                put = fact.predicate in fitting and fact.args[0] == skill.hand
                if put and fact.args[1] in others:
                    names = {fact.args[0]: thing, fact.args[1]: place}
                    if evaluate(effect.condition, view, names) == TRUE:
                        return fact.predicate
    return fitting[0]


class _Scene:
    """What has been drawn so far."""

    def __init__(self, domain: Domain, needs: SceneNeeds, seed: int) -> None:
        self.domain, self.needs, self.seed = domain, needs, seed
        self.nodes: dict[str, ObjectNode] = {}
        self.relations: list[Relation] = []
        self._vary = dict(needs.vary)
        states: dict[str, dict[str, str]] = {}
        for name, attribute, value in needs.fixtures:
            states.setdefault(name, {})[attribute] = value
        named = [p for o in needs.objects for p in o.places if is_instance(p)]
        fixtures = set(states)
        for kind in domain.tagged(domain.roles.fixture):
            count = NUMBERED if domain.is_a(kind, domain.roles.numbered) else 1
            fixtures |= {f"{kind}-{i}" for i in range(1, count + 1)}
        fixtures |= {n for n in named if domain.is_a(n, domain.roles.fixture)}
        for name in sorted(fixtures, key=by_number):
            self.add(name, domain[name].name, tuple(states.get(name, {}).items()))

    def add(self, name: str, category: str, states: Iterable[tuple[str, str]] = ()) -> None:
        values = self.domain.default_states(category) | dict(states)
        self.nodes[name] = ObjectNode(name, category, tuple(values.items()))

    def put(self, name: str, places: Sequence[str]) -> None:
        domain, category = self.domain, self.nodes[name].category
        options = [n for p in places for n in self._named(p)] if places else self._supports()
        taken = [p for p in options if self._takes(p, category)]
        if not taken:
            wanted = f"at {' or '.join(places)}" if places else "on a support"
            raise InputError(f"{name} is wanted {wanted}, where nothing takes it")
        place = taken[int(self._rng(name, "furniture").integers(len(taken)))]
        self.relations.append(Relation(name, relation_at(domain, category, place), place))

    def block(self, front: str, behind: str) -> None:
        blocking = self.domain.roles.blocking
        if blocking is None:
            raise InputError(f"nothing blocks anything in {self.domain.name}")
        self.relations += [Relation(front, blocking, n) for n in self._named(behind)]

    def strew(self) -> None:
        """Things that nobody asked for, on the supports where things are put out of the way."""
        low, high = self.needs.clutter
        rng = self._rng("clutter", "clutter")
        count = int(rng.integers(low, high + 1)) + self.needs.more_clutter
        asked = self.needs.undisturbed or self.needs
        wanted = {o.category for needs in (asked, self.needs) for o in needs.objects}
        wanted |= {made for c in self.domain.categories for made in self.domain.becomes(c)}
        free = [c for c in self.domain.tagged(self.domain.roles.movable) if c not in wanted]
        for i in rng.permutation(len(free))[:count]:
            if any(self._takes(p, free[i]) for p in self._supports()):
                self.add(f"{free[i]}-1", free[i])
                self.put(f"{free[i]}-1", ())

    def _supports(self) -> list[str]:
        roles = self.domain.roles
        for tag in (*roles.rest, roles.support):
            found = [n for n, o in self.nodes.items() if self.domain.is_a(o.category, tag)]
            if found:
                return sorted(found, key=by_number)
        return []

    def _named(self, name: str) -> list[str]:
        if name in self.nodes:
            return [name]
        category = self.domain.canonical(name)
        return sorted((n for n, o in self.nodes.items() if o.category == category), key=by_number)

    def _takes(self, place: str, category: str) -> bool:
        accepts = self.domain.roles.accepts
        return accepts is None or self.domain.static(accepts, place, category)

    def _rng(self, what: str, axis: str) -> np.random.Generator:
        layout = self._vary.get("layout", 0) if axis == "furniture" else 0
        key = [self.seed, crc32(what.encode()), self._vary.get(axis, 0), layout]
        return np.random.default_rng(key)


def _about(domain: Domain, relation: str, names: tuple[str, str]) -> bool:
    parameters = domain.predicates[relation].parameters
    return all(domain.is_a(n, p.kind) for n, p in zip(names, parameters, strict=True))


def _node(domain: Domain, name: str) -> ObjectNode:
    return ObjectNode(name, domain[name].name, tuple(domain.default_states(name).items()))
