"""Scenes, steps and skills in a few words for a prompt; whatever is not plain is quoted.

Called by the prompts of `diagnosis` and `replanning`; calls the domain. Names and texts come from
scenes and files of others: a plain name stands as it is, everything else is a JSON string on one
line, cut where it is long.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Sequence

from forestall.domain.formula import TRUE, And, Formula, Not, Some, show
from forestall.domain.model import FACING, LOCATED, Domain
from forestall.domain.schema import Skill
from forestall.domain.truth import is_shut
from forestall.types.episode import SkillStatus
from forestall.types.facts import GRIPPER, Literal, Truth, category_of
from forestall.types.graph import ObjectNode, SceneGraph, Seen
from forestall.types.plan import Subtask
from forestall.types.story import Tried

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,39}")
_LONGEST, _LONGEST_NAME = 400, 80


def quoted(text: str, most: int = _LONGEST) -> str:
    """A text of others as a JSON string on one line."""
    shown = "".join(c if c.isprintable() else " " for c in str(text))
    return json.dumps(shown if len(shown) <= most else shown[: most - 1] + "…", ensure_ascii=False)


def name(text: str) -> str:
    """A name: as it is where it is plain, else quoted."""
    return text if _PLAIN.fullmatch(text) else quoted(text, _LONGEST_NAME)


def step(subtask: Subtask) -> str:
    """A step as it is written in a plan."""
    return f"{name(subtask.skill)}({', '.join(map(name, subtask.args))})"


def fact(literal: Literal) -> str:
    """A fact as it is written in a file."""
    return str(Literal(name(literal.predicate), tuple(map(name, literal.args)), literal.value))


def scene(graph: SceneGraph, domain: Domain, among: Collection[str] | None = None) -> list[str]:
    """A line for each thing: name, states that are known, and how it is related to others.

    Args:
        graph: the scene.
        domain: whose relations and hands these are.
        among: only these things; all by default.
    """
    lines = []
    for node in graph.nodes:
        if node.id in domain.robot.hands or node.id == GRIPPER:
            continue
        if among is not None and node.id not in among:
            continue
        known = [name(v) for _, v in node.states if v is not None]
        if node.category != category_of(node.id):
            known.insert(0, name(node.category))
        related = [
            f"{r.predicate} {name(r.object)}" for r in graph.relations if r.subject == node.id
        ]
        if node.id in graph.hidden:
            known.append("inside unseen")
        if node.seen is Seen.UNOBSERVED:
            known.append("not in sight")
        lines.append(f"{name(node.id)}: {', '.join((*known, *related)) or 'here'}")
    return lines


def places(graph: SceneGraph, domain: Domain, things: Collection[str], most: int = 4) -> list[str]:
    """What goes where: for places that take the same things a line, with what is paired to them."""
    role = domain.roles.accepts
    if role is None:
        return []
    groups: dict[tuple[str, ...], list[str]] = {}
    for node in graph.nodes:
        takes = tuple(
            t for t in sorted(things)
            if t != node.id and domain.static(role, node.category, category_of(t))
        )  # fmt: skip
        if takes:
            groups.setdefault(takes, []).append(_place(node, graph, domain))
    lines = []
    for takes, found in groups.items():
        more = "" if len(found) <= most else ", ..."
        lines.append(f"room for {', '.join(map(name, takes))}: {', '.join(found[:most])}{more}")
    return lines


def _place(node: ObjectNode, graph: SceneGraph, domain: Domain) -> str:
    shut = is_shut(domain, node.category, dict(node.states)) is Truth.TRUE
    number = node.id.rpartition("-")[2]
    paired = [
        n.id for n in graph.nodes
        if n.category in domain.paired(node.id) and n.id.rpartition("-")[2] == number
    ]  # fmt: skip
    told = name(node.id) + (" (shut)" if shut else "")
    return told + "".join(f" with {name(p)}" for p in paired)


def executed(steps: Sequence[tuple[Subtask, SkillStatus]], most: int = 12) -> str:
    """What was done, the newest last; how it ended is said where it did not succeed."""
    told = [
        step(s) if status is SkillStatus.SUCCEEDED else f"{step(s)} {status.value}"
        for s, status in steps[-most:]
    ]
    return "; ".join(told) or "nothing"


def told_steps(events: Sequence[Tried], domain: Domain) -> list[str]:
    """A run in words, a line for each step: how it ended, and what was seen to be new after it.

    REFLECT's event-based summary: a scene is told where it has changed (its key frames).
    """
    known: set[str] = set()
    lines = []
    for event in events:
        seen = [] if event.seen is None else scene(event.seen, domain)
        new = [line for line in seen if line not in known]
        known |= set(new)
        how = "" if event.status is SkillStatus.SUCCEEDED else f" {event.status.value}"
        after = f" | {'; '.join(new)}" if new else ""
        lines.append(f"{event.number}. {step(event.subtask)}{how}{after}")
    return lines


def vocabulary(graph: SceneGraph, domain: Domain) -> str:
    """The facts that can be said about the things of a scene: attributes with values, predicates.

    "torque=loose|tight, on(A, B), ready(A)".
    """
    return vocabulary_of({n.category for n in graph.nodes}, domain)


def vocabulary_of(kinds: Collection[str], domain: Domain) -> str:
    """The same about things of some kinds."""
    attributes = [
        a for a in domain.attributes
        if any(a in domain[k].attributes for k in kinds if domain.find(k) is not None)
    ]  # fmt: skip
    states = [f"{a}(A)={'|'.join(domain.attributes[a].values)}" for a in attributes]
    letters = "ABCDEF"
    known = [p for p in (*domain.relations.values(), *domain.derived.values()) if p.name in
             changeable(domain)]  # fmt: skip
    facts = [f"{p.name}({', '.join(letters[: len(p.parameters)])})" for p in known]
    return ", ".join((*states, *facts))


def changeable(domain: Domain) -> frozenset[str]:
    """Predicates that a plan can bring about: attributes, what skills move, what follows of it."""
    moved = domain.moved & domain.relations.keys()
    return frozenset((*domain.attributes, *moved, *domain.derived))


def brief_skills(domain: Domain, graph: SceneGraph, near: Collection[str]) -> list[str]:
    """A line for each skill of use here: what it needs and does, in facts, as far as that is short.

    A skill is of use where something near is marked as its needs ask. Conditional effects, needs
    that do not fit a line and what every skill needs are left out or said once: whoever plans by
    these lines is told by the validator what else a step lacks.
    """
    able = domain.robot.skills or tuple(domain.skills)
    skills = [s for n in able if _of_use(s := domain.skills[n], domain, near)]
    needs = {s.name: [t for n in s.needs for t in _short(n.formula, domain, graph)] for s in skills}
    plain = {s.name: [_any(t, s) for t in needs[s.name]] for s in skills if not s.drives}
    common = [t for t in dict.fromkeys(t for own in plain.values() for t in own)
              if len(plain) > 2 and all(t in own for own in plain.values())]  # fmt: skip
    lines: dict[str, list[str]] = {}
    for s in skills:
        left = [t for t in needs[s.name] if _any(t, s) not in common]
        need = f" needs {', '.join(dict.fromkeys(left))}" if left else ""
        does = _does(s, domain)
        text = f"({', '.join(s.roles)}){need}" + (f" -> {does}" if does else "")
        lines.setdefault(text, []).append(s.name)
    told = ["/".join(names) + text for text, names in lines.items()]
    return [*told, f"all but driving need {', '.join(common)}"] if common else told


def _of_use(skill: Skill, domain: Domain, near: Collection[str]) -> bool:
    """Whether for each of its arguments something near is marked as its needs ask."""
    for parameter in skill.parameters:
        kinds = {parameter.kind} - {None}
        for need in skill.needs:
            f = need.formula
            if (
                isinstance(f, Literal)
                and f.args == (parameter.name,)
                and f.value == "true"
                and f.predicate not in domain.predicates
                and domain.known_kind(f.predicate)
            ):
                kinds.add(f.predicate)
        if kinds and not any(all(domain.is_a(n, k) for k in kinds) for n in near):
            return False
    return True


def _any(text: str, skill: Skill) -> str:
    """A need with the skill's own names taken out, to find what all skills need."""
    for parameter in (*skill.parameters, *(c.variable for c in skill.choices)):
        text = re.sub(rf"\b{parameter.name[1:]}\b", "it", text)
    return text


def _does(skill: Skill, domain: Domain) -> str:
    if skill.drives:
        return f"robot at {skill.roles[-1]}"
    always = [e for e in skill.effects if not e.variables and e.condition == TRUE]
    facts = [f for e in always for f in e.facts]
    if facts and len(skill.roles) == 1 and all(f.is_state for f in facts):
        return ", ".join(f"{f.predicate}={f.value}" for f in facts)  # of what it is done to
    if facts:
        return ", ".join(dict.fromkeys(map(_said, facts)))
    known = {p.name for p in skill.parameters}
    return " or ".join(
        dict.fromkeys(
            _said(f)
            for e in skill.effects
            for f in e.facts
            if f.predicate in domain.containing and known.issuperset(f.args)
        )
    )


def _short(formula: Formula, domain: Domain, graph: SceneGraph) -> list[str]:
    """A need in facts, [] where it does not fit a line; of some kind of thing those at hand."""
    if isinstance(formula, And):
        return [t for p in formula.parts for t in _short(p, domain, graph)]
    inner = formula.part if isinstance(formula, Not) else formula
    if isinstance(inner, Literal):
        plain = inner.predicate in changeable(domain) and inner.predicate not in (LOCATED, FACING)
        return [show(formula).replace("?", "")] if plain else []
    if not isinstance(inner, Some) or not isinstance(inner.part, Literal):
        return []
    if inner is not formula:
        return ["no" + show(inner).replace("?", "").removeprefix("some")]
    only = inner.variables[0]
    fitting = [n.id for n in graph.nodes if only.kind and only.kind in domain.kinds(n.category)]
    if len(inner.variables) == 1 and len(fitting) == 1:
        return [fact(inner.part.bind({only.name: fitting[0]})).replace("?", "")]
    return [show(inner).replace("?", "")]


def _said(literal: Literal) -> str:
    return str(literal).replace("?", "")
