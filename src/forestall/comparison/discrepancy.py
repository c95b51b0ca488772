"""The readable difference of an observed and an expected graph under a matching.

Called by score and batch; calls nothing. A sentence says only what the two graphs know: where an
inside could not be seen, it says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from forestall.comparison.options import CountedConfig
from forestall.domain.model import Domain
from forestall.domain.spoken import told
from forestall.domain.truth import truth
from forestall.types.facts import Literal, Truth
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.verdict import Change, Discrepancy

_ORDER = {
    Change.STATE: 0,
    Change.EXTRA_RELATION: 1,
    Change.MISSING_RELATION: 2,
    Change.EXTRA_OBJECT: 3,
    Change.MISSING_OBJECT: 4,
}


@dataclass(frozen=True, slots=True)
class _Pairing:
    """Which expected node stands for which observed one; `supports` are compared as one thing."""

    expected_of: Mapping[str, str]
    observed_of: Mapping[str, str]
    supports: frozenset[str]  # categories


def differences(
    observed: SceneGraph,
    expected: SceneGraph,
    matches: Sequence[tuple[str, str]],
    config: CountedConfig,
    domain: Domain,
) -> tuple[Discrepancy, ...]:
    """What keeps the graphs apart; what concerns the subtask's arguments comes first.

    Args:
        observed: the graph of the scene.
        expected: the graph of a demonstration.
        matches: (observed id, expected id).
        config: which relations, states and categories count.
        domain: what the relations are, and the words for them.
    """
    changed = _changed_pairs(observed, expected, matches, config)
    pairs = [*matches, *changed]
    merged = config.generic_supports and config.merge_supports
    pairing = _Pairing(
        dict(pairs), {e: o for o, e in pairs}, frozenset(config.supports if merged else ())
    )
    found = [d for o, e in pairs for d in _states(observed, expected, o, e, config, domain)]
    found += _extra_objects(observed, expected, pairing)
    found += _missing_objects(observed, expected, pairing)
    found += _extra_relations(observed, expected, pairing, config, domain)
    found += _missing_relations(observed, expected, pairing, config, domain)
    arguments = () if observed.subtask is None else observed.subtask.args

    def key(d: Discrepancy) -> tuple[bool, int, str, str, str]:
        concerned = any(a in (d.subject, *d.text.split()) for a in arguments)
        what = d.expected if d.change is Change.MISSING_RELATION else d.observed
        return (not concerned, _ORDER[d.change], d.subject, what, d.text)

    return tuple(sorted(found, key=key))


def _changed_pairs(
    observed: SceneGraph,
    expected: SceneGraph,
    matches: Sequence[tuple[str, str]],
    config: CountedConfig,
) -> list[tuple[str, str]]:
    """Unmatched nodes of one category are the same thing in another state; same ids first."""
    merged = config.supports if config.generic_supports and config.merge_supports else ()
    taken_o, taken_e = {o for o, _ in matches}, {e for _, e in matches}
    roles_o = {} if observed.subtask is None else dict(enumerate(observed.subtask.args))
    roles_e = {} if expected.subtask is None else dict(enumerate(expected.subtask.args))
    alike = {o: roles_e[i] for i, o in roles_o.items() if i in roles_e}
    free = [n for n in expected.nodes if n.id not in taken_e and n.category not in merged]
    pairs: list[tuple[str, str]] = []
    for node in observed.nodes:
        if node.id in taken_o or node.category in merged:
            continue
        same = [e for e in free if e.category == node.category]
        if same:
            chosen = min(same, key=lambda e: (alike.get(node.id) != e.id, e.id != node.id, e.id))
            if node.category in config.instance_categories and chosen.id != node.id:
                continue
            free.remove(chosen)
            pairs.append((node.id, chosen.id))
    return pairs


def _node(graph: SceneGraph, node_id: str) -> ObjectNode:
    node = graph.get(node_id)
    assert node is not None, node_id
    return node


def _states(
    observed: SceneGraph,
    expected: SceneGraph,
    o: str,
    e: str,
    config: CountedConfig,
    domain: Domain,
) -> list[Discrepancy]:
    shown = {a: v for a, v in _node(expected, e).states if v is not None}
    found = []
    for attribute, value in _node(observed, o).states:
        wanted = shown.get(attribute)
        if attribute in config.ignored_attributes or value is None or wanted is None:
            continue
        if wanted == value:
            continue
        says, said = domain.say(attribute, value), domain.say(attribute, wanted)
        text = f"{o} is {says}; the demonstration shows it {said}"
        was, now = f"{attribute}={wanted}", f"{attribute}={value}"
        found.append(Discrepancy(Change.STATE, o, was, now, text))
    return found


def _extra_objects(
    observed: SceneGraph, expected: SceneGraph, pairing: _Pairing
) -> list[Discrepancy]:
    found = []
    for n in observed.nodes:
        if n.id in pairing.expected_of or n.category in pairing.supports:
            continue
        known = len(expected.of_category(n.category))
        text = f"no {n.category}" if known == 0 else f"only {known} of {n.category}"
        found.append(
            Discrepancy(
                Change.EXTRA_OBJECT, n.id, "", n.id, f"{n.id} is here; the demonstration has {text}"
            )
        )
    return found


def _missing_objects(
    observed: SceneGraph, expected: SceneGraph, pairing: _Pairing
) -> list[Discrepancy]:
    found = []
    for n in expected.nodes:
        if n.id in pairing.observed_of or n.category in pairing.supports:
            continue
        known = len(observed.of_category(n.category))
        what = f"no {n.category}" if known == 0 else f"only {known} of {n.category}"
        found.append(
            Discrepancy(
                Change.MISSING_OBJECT,
                n.id,
                n.id,
                "",
                f"{what} was seen here; the demonstration has {n.id}",
            )
        )
    return found


def _place(graph: SceneGraph, node_id: str, names: Mapping[str, str], pairing: _Pairing) -> str:
    """The name under which a node of one graph is looked for in the other; "" for none."""
    if _node(graph, node_id).category in pairing.supports:
        return "*"
    return names.get(node_id, "")


def _key(graph: SceneGraph, node_id: str, pairing: _Pairing) -> str:
    return "*" if _node(graph, node_id).category in pairing.supports else node_id


def _links(graph: SceneGraph, pairing: _Pairing, config: CountedConfig) -> list[Relation]:
    return [
        r
        for r in graph.relations
        if r.predicate in config.predicates
        and not _key(graph, r.subject, pairing) == _key(graph, r.object, pairing) == "*"
    ]


def _extra_relations(
    observed: SceneGraph,
    expected: SceneGraph,
    pairing: _Pairing,
    config: CountedConfig,
    domain: Domain,
) -> list[Discrepancy]:
    wanted = {
        (_key(expected, r.subject, pairing), r.predicate, _key(expected, r.object, pairing))
        for r in _links(expected, pairing, config)
    }
    found = []
    for r in _links(observed, pairing, config):
        subject = _place(observed, r.subject, pairing.expected_of, pairing)
        target = _place(observed, r.object, pairing.expected_of, pairing)
        if (subject, r.predicate, target) in wanted:
            continue
        there = _what_was_there(expected, r, target, domain)
        text = f"{_sentence(r, domain)}; {there}"
        found.append(Discrepancy(Change.EXTRA_RELATION, r.subject, there, str(r), text))
    return found


def _what_was_there(expected: SceneGraph, relation: Relation, target: str, domain: Domain) -> str:
    """What the demonstration says about the place that a relation names."""
    if target in ("", "*"):
        return "the demonstration does not have it there"
    if relation.predicate in domain.containing and target in expected.hidden:
        return "what was there in the demonstration could not be seen"
    here = sorted(
        r.subject
        for r in expected.relations
        if r.object == target and r.predicate == relation.predicate
    )
    if relation.predicate == domain.roles.blocking:
        blocked = "nothing blocks it"
        return f"in the demonstration {', '.join(here) + ' blocks it' if here else blocked}"
    return f"the demonstration shows {', '.join(here) or 'nothing'} there"


def _missing_relations(
    observed: SceneGraph,
    expected: SceneGraph,
    pairing: _Pairing,
    config: CountedConfig,
    domain: Domain,
) -> list[Discrepancy]:
    present = {
        (_key(observed, r.subject, pairing), r.predicate, _key(observed, r.object, pairing))
        for r in _links(observed, pairing, config)
    }
    found = []
    for r in _links(expected, pairing, config):
        subject = _place(expected, r.subject, pairing.observed_of, pairing)
        target = _place(expected, r.object, pairing.observed_of, pairing)
        if (subject, r.predicate, target) in present:
            continue
        here = Relation(
            subject if subject not in ("", "*") else r.subject,
            r.predicate,
            target if target not in ("", "*") else r.object,
        )
        text, known = _what_is_here(observed, here, domain)
        found.append(Discrepancy(Change.MISSING_RELATION, here.subject, str(here), known, text))
    return found


def _what_is_here(observed: SceneGraph, expected: Relation, domain: Domain) -> tuple[str, str]:
    literal = Literal(expected.predicate, (expected.subject, expected.object))
    if observed.get(expected.subject) is None:
        return f"in the demonstration {_sentence(expected, domain)}", "not seen"
    if truth(observed, literal, domain) is Truth.UNOBSERVED:
        return (
            f"whether {_sentence(expected, domain)} could not be seen; the demonstration has it so",
            "unobserved",
        )
    telling = (*domain.containing, domain.roles.holding)
    places = [
        r for r in observed.relations if r.subject == expected.subject and r.predicate in telling
    ]
    now = f" ({', '.join(_sentence(r, domain) for r in places)})" if places else ""
    return (
        f"{_sentence(expected, domain, holds=False)}{now}; the demonstration has it so",
        ", ".join(map(str, places)),
    )


def _sentence(relation: Relation, domain: Domain, holds: bool = True) -> str:
    literal = Literal(relation.predicate, (relation.subject, relation.object))
    return told(literal, domain, holds)
