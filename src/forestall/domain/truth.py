"""The one truth of a scene graph: true, false, or unobserved, for every literal of a domain.

Called by perception's scope, mining, diagnosis, detection and the monitor; calls `evaluate`.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Mapping

from forestall.domain.evaluate import evaluate, literal_truth
from forestall.domain.formula import Formula
from forestall.domain.model import FACING, LOCATED, Domain
from forestall.domain.schema import PredicateKind
from forestall.domain.view import FALSE, TRUE, UNKNOWN, UNOBSERVED
from forestall.types.facts import Literal, Truth, category_of, is_instance
from forestall.types.graph import ObjectNode, SceneGraph, Seen

_TRUTH = {FALSE: Truth.FALSE, UNOBSERVED: Truth.UNOBSERVED, TRUE: Truth.TRUE}
_RECENT = 64


class GraphView:
    """A scene graph as something that knows facts (implements `view.View`).

    - What is outside every view is unobserved, never false: a thing, and what it has to others.
    - The inside of a container that no view reached may hold anything that is not in sight.
    - Of what is in sight and has no place (no depth) it is not known what it is in, on or beside.
    """

    def __init__(self, graph: SceneGraph, domain: Domain) -> None:
        self.graph, self.domain = graph, domain
        self._nodes = {n.id: n for n in graph.nodes}
        self._places: dict[str, list[str]] = {}
        self._at: dict[tuple[str, int, str], list[str]] = {}
        containing = set(domain.containing)
        for r in graph.relations:
            self._at.setdefault((r.predicate, 0, r.object), []).append(r.subject)
            self._at.setdefault((r.predicate, 1, r.subject), []).append(r.object)
            if r.predicate in containing:
                self._places.setdefault(r.subject, []).append(r.object)
        self._present = {(r.predicate, r.subject, r.object) for r in graph.relations}
        self._containing = containing
        self._tied = {r.subject for r in graph.relations}
        self._kinds: dict[str, list[str]] = {}

    def node(self, name: str) -> ObjectNode | None:
        """The node of a name."""
        return self._nodes.get(name)

    def things(self) -> Iterable[str]:
        """Every node but the hands."""
        hands = self.domain.robot.hands
        return [n for n in self._nodes if n not in hands]

    def category(self, name: str) -> str:
        """The category of a node, that of its name for what has none."""
        node = self._nodes.get(name)
        return self.domain.canonical(category_of(name) if node is None else node.category)

    def of_kind(self, kind: str) -> Iterable[str]:
        """Nodes that count as a tag, a category or an attribute holder."""
        found = self._kinds.get(kind)
        if found is None:
            domain = self.domain
            found = [n for n in self._nodes if kind in domain.kinds(self.category(n))]
            self._kinds[kind] = found
        return found

    def fact(self, predicate: str, args: tuple[str, ...]) -> int:
        """Truth of a relation, a history or a built-in fact."""
        if predicate == LOCATED:
            node = self._nodes.get(args[0])
            return TRUE if node is not None and node.box_m is not None else FALSE
        if predicate == FACING:
            return UNOBSERVED
        if self.domain.predicates[predicate].kind is PredicateKind.HISTORY:
            return UNOBSERVED
        if len(args) != 2:
            return UNOBSERVED
        subject, target = args
        if (predicate, subject, target) in self._present:
            return TRUE
        if subject not in self._nodes or target not in self._nodes:
            return UNOBSERVED
        if target in self.domain.robot.hands:
            return FALSE  # a robot knows what it holds
        if self._placeless(subject) or self._placeless(target):
            return UNOBSERVED
        containing = predicate in self._containing
        if self._unseen(target) and not (containing and subject in self._places):
            return UNOBSERVED
        if self._unseen(subject) and not containing:
            return UNOBSERVED
        if containing and target in self.graph.hidden:
            return UNOBSERVED if self._may_be_hidden(subject) else FALSE
        return FALSE

    def _unseen(self, name: str) -> bool:
        """Whether a thing is known and no view can reach it: what it has to others is not seen."""
        node = self._nodes.get(name)
        return node is not None and node.seen is Seen.UNOBSERVED

    def _placeless(self, name: str) -> bool:
        """Whether a thing is seen where nothing tells how far away it is."""
        if name not in self.graph.hidden or name in self._tied:
            return False
        node = self._nodes[name]
        fixed = self.domain.is_a(node.category, self.domain.roles.fixture)
        return node.box_m is None and node.seen is Seen.VISIBLE and not fixed

    def _may_be_hidden(self, name: str) -> bool:
        node = self._nodes[name]
        if name in self._places or self.domain.is_a(node.category, self.domain.roles.fixture):
            return False
        return node.seen is not Seen.VISIBLE or node.box_m is None

    def value(self, name: str, attribute: str) -> str | None:
        """The observed value of an attribute."""
        node = self._nodes.get(name)
        return None if node is None else node.state(attribute)

    def unsure(self, name: str, attribute: str) -> bool:
        """Whether a missing value is one that nobody saw."""
        if name not in self._nodes:
            return True
        known = self.domain.find(self.category(name))
        return known is None or attribute in known.attributes

    def related(self, predicate: str, position: int, args: tuple[str, ...]) -> Iterable[str]:
        """What may stand at a position so that a relation is not false."""
        other = args[1 - position]
        found = list(self._at.get((predicate, position, other), ()))
        if self._unseen(other) and not (position == 1 and predicate in self._containing):
            found.append(UNKNOWN)
        if predicate in self._containing:
            if position == 0 and other in self.graph.hidden:
                found += [n for n in self.things() if n not in found and self._may_be_hidden(n)]
                found.append(UNKNOWN)
            elif position == 1 and other in self._nodes and self._may_be_hidden(other):
                found += [h for h in self.graph.hidden if h not in found]
        return found

    def with_value(self, attribute: str, value: str) -> Iterable[str]:
        """Things whose attribute may have a value."""
        return [n for n in self.things() if self.value(n, attribute) in (None, value)]

    def truth(self, literal: Literal) -> Truth:
        """The truth of a literal; a category name means "some instance of it".

        For a negative literal it means "no instance": false where one makes the fact true.
        """
        ground = [literal]
        for position, name in enumerate(literal.args):
            if name in self._nodes or is_instance(name) or name in self.domain.robot.hands:
                continue
            category = self.domain.canonical(name)
            ids = [n for n in self._nodes if self.category(n) == category]
            ground = [
                Literal(g.predicate, (*g.args[:position], i, *g.args[position + 1 :]), g.value)
                for g in ground
                for i in ids
            ]
        values = [literal_truth(g, self, {}) for g in ground]
        if literal.value == "false":
            return _TRUTH[min(values, default=TRUE)]
        return _TRUTH[max(values, default=UNOBSERVED)]


_recent: OrderedDict[tuple[int, int], GraphView] = OrderedDict()


def view(graph: SceneGraph, domain: Domain) -> GraphView:
    """The view of a graph; the last few are kept, since one graph is asked many questions."""
    key = (id(graph), id(domain))
    found = _recent.get(key)
    if found is None or found.graph is not graph or found.domain is not domain:
        found = GraphView(graph, domain)
        _recent[key] = found
        while len(_recent) > _RECENT:
            _recent.popitem(last=False)
    return found


def truth(graph: SceneGraph, literal: Literal, domain: Domain) -> Truth:
    """The three-valued truth of a literal on a graph."""
    return view(graph, domain).truth(literal)


def is_shut(domain: Domain, category: str, states: Mapping[str, str | None]) -> Truth:
    """Whether a thing with these states keeps its contents from hand and eye."""
    shut = domain.roles.shut
    if shut is None or not domain.is_a(category, domain.roles.encloses):
        return Truth.FALSE
    told = category, tuple(states.items())
    known: dict[object, Truth] = domain.__dict__.setdefault("_shut", {})
    if told not in known:
        alone = SceneGraph((ObjectNode("it", category, told[1]),))
        known[told] = GraphView(alone, domain).truth(Literal(shut, ("it",)))
    return known[told]


def formula_truth(graph: SceneGraph, formula: Formula, domain: Domain) -> Truth:
    """The three-valued truth of a closed formula on a graph."""
    return _TRUTH[evaluate(formula, view(graph, domain), {})]


__all__ = ["GraphView", "formula_truth", "is_shut", "truth", "view"]
