"""Schemas of answers, and answers read into types: whatever does not fit is a reason in words.

Called by whoever asks a language model. An answer is checked against the domain and the scene, and
nothing of it is ever called by its name. The fields of a schema stand in the order in which they
are to be thought of, since endpoints have them written in that order.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from forestall.domain.checks import check_literal
from forestall.domain.model import Domain
from forestall.domain.truth import truth
from forestall.errors import ForestallError
from forestall.llm.forms import Unfit, list_of, object_of, read_answer, text_of
from forestall.llm.words import changeable
from forestall.reading.fields import Field
from forestall.types.facts import Literal, Truth
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask

MOST_FACTS, MOST_STEPS = 12, 60
_LONGEST = 400

Said = dict[int, tuple[tuple[Literal, ...], str]]
"""Number of a step → facts that should hold before it, over its skill's parameters; and why."""


def diagnosis_schema(things: Collection[str], steps: Collection[int] = ()) -> str:
    """The schema of an explanation; what it is because of is one of the things at hand.

    With some steps it also names the one that it is about.
    """
    among = {"type": "string", "enum": sorted(things)} if things else {"type": "string"}
    step = {"step": {"type": "integer", "enum": sorted(steps)}} if steps else {}
    return json.dumps(
        object_of(
            **step,
            cause=text_of("what is wrong, one sentence"),
            why=text_of("how that makes the step fail, one sentence"),
            because_of=list_of(among),
            must_change=list_of(text_of("a fact that must become true")),
            must_stay=list_of(text_of("a fact that must stay true")),
            advice=text_of("what to do, one sentence"),
        ),
    )


def verified_schema() -> str:
    """The schema of whether a step did what it is for."""
    return json.dumps(object_of(why=text_of("one sentence"), done={"type": "boolean"}))


def verified(answer: str) -> tuple[bool, str]:
    """Whether a step did what it is for, and why.

    Raises:
        Unfit: the answer cannot be read.
    """
    return read_answer(answer, lambda field: (field["done"].flag(), line(field["why"].text())))


def plan_schema(skills: Collection[str], things: Collection[str]) -> str:
    """The schema of a plan: its skills and things are the ones at hand."""
    step = object_of(
        skill={"type": "string", "enum": sorted(skills)},
        args=list_of({"type": "string", "enum": sorted(things)}),
    )
    return json.dumps(object_of(idea=text_of("one sentence"), steps=list_of(step)))


def expectations_schema(numbers: Collection[int]) -> str:
    """The schema of what should hold before some steps of a plan, by their numbers."""
    step = object_of(
        step={"type": "integer", "enum": sorted(numbers)},
        must_hold=list_of(text_of("a fact")),
        why=text_of("one sentence"),
    )
    return json.dumps(object_of(steps=list_of(step)))


def explanation_schema() -> str:
    """The schema of one sentence for people."""
    return json.dumps(object_of(explanation=text_of("one sentence")))


def sentence_of(answer: str) -> str:
    """The sentence.

    Raises:
        Unfit: there is none.
    """
    text = read_answer(answer, lambda field: line(field["explanation"].text()))
    if not text:
        raise Unfit("the explanation is empty")
    return text


@dataclass(frozen=True, slots=True)
class Explained:
    """What a model says of a scene that does not fit; `dropped` are facts that mean nothing."""

    cause: str
    why: str
    because_of: tuple[str, ...]
    must_change: tuple[Literal, ...]
    must_stay: tuple[Literal, ...]
    advice: str
    dropped: tuple[str, ...]


def explanation(answer: str, graph: SceneGraph, domain: Domain) -> Explained:
    """Read an explanation; facts that the domain or the scene does not know are dropped.

    Raises:
        Unfit: it is none, or says nothing.
    """
    return read_answer(answer, lambda field: _explained(field, graph, domain))


def located(
    answer: str, numbers: Collection[int], graph: SceneGraph, domain: Domain
) -> tuple[int, Explained]:
    """Read an explanation that names the step of a run that it is about, by its number.

    Raises:
        Unfit: it is none, says nothing, or there is no such step.
    """

    def read(field: Field) -> tuple[int, Explained]:
        number = field["step"].whole()
        if number not in numbers:
            raise Unfit(f"there is no step {number}: the run has {len(numbers)}")
        return number, _explained(field, graph, domain)

    return read_answer(answer, read)


def _explained(field: Field, graph: SceneGraph, domain: Domain) -> Explained:
    cause, why, advice = (line(field[k].text()) for k in ("cause", "why", "advice"))
    if not cause and not advice:
        raise Unfit("neither a cause nor an advice is given")
    dropped: list[str] = []
    change, stay = (
        _facts(field[k], graph, domain, wanted, dropped)
        for k, wanted in (("must_change", Truth.FALSE), ("must_stay", Truth.TRUE))
    )
    because = field["because_of"].at_most(MOST_FACTS, Field.text)
    known = tuple(dict.fromkeys(n for n in because if graph.get(n) is not None))
    stay = tuple(x for x in stay if x not in change)
    return Explained(cause, why, known, change, stay, advice, tuple(dropped))


def _facts(
    field: Field, graph: SceneGraph, domain: Domain, wanted: Truth, dropped: list[str]
) -> tuple[Literal, ...]:
    found: dict[Literal, None] = {}
    for text in field.at_most(MOST_FACTS, Field.text):
        try:
            found[known_fact(text, graph, domain, wanted)] = None
        except ForestallError as error:
            dropped.append(line(f"{text!r}: {error}"))
    return tuple(found)


def known_fact(text: str, graph: SceneGraph, domain: Domain, wanted: Truth) -> Literal:
    """A fact about things of a scene that a plan can bring about, or keep.

    Raises:
        Unfit: it means nothing here, holds already, or does not hold.
    """
    parsed = Literal.parse(text)
    args = []
    for given in parsed.args:
        meant = domain.canonical(given)
        if meant in domain.robot.hands:
            args.append(meant)
            continue
        matches = graph.matches(meant)
        if not matches:
            raise Unfit(f"there is no {meant} here")
        args.append(matches[0] if len(matches) == 1 else meant)
    fact = Literal(parsed.predicate, tuple(args), parsed.value)
    check_literal(domain, "the answer", fact)
    if fact.predicate not in changeable(domain):
        raise Unfit(f"no plan brings about {fact.predicate}")
    now = truth(graph, fact, domain)
    if wanted is Truth.FALSE and now is Truth.TRUE:
        raise Unfit("it holds already")
    if wanted is Truth.TRUE and now is not Truth.TRUE:
        raise Unfit("it is not seen to hold")
    return fact


def expectations(
    answer: str, asked: Mapping[int, Subtask], domain: Domain
) -> tuple[Said, tuple[str, ...]]:
    """Read what should hold before steps: number → facts over the skill's parameters, and why.

    Facts that mean nothing are left out, and so are steps that nobody asked about; the second
    value says which and why.

    Raises:
        Unfit: the answer cannot be read.
    """
    dropped: list[str] = []

    def read(field: Field) -> Said:
        found: Said = {}
        for entry in field["steps"].at_most(MOST_STEPS, lambda item: item):
            number, why = entry["step"].whole(), line(entry["why"].text())
            texts = entry["must_hold"].at_most(MOST_FACTS, Field.text)
            if number not in asked or number in found:
                dropped.extend(f"{t!r}: nobody asked about step {number}" for t in map(line, texts))
                continue
            facts: dict[tuple[str, tuple[str, ...]], Literal] = {}
            for text in texts:
                try:
                    fact = expected_fact(text, asked[number], domain)
                    if facts.setdefault((fact.predicate, fact.args), fact) != fact:
                        raise Unfit("it contradicts another one")
                except ForestallError as error:
                    dropped.append(line(f"{text!r}: {error}"))
            found[number] = (tuple(facts.values()), why)
        return found

    return read_answer(answer, read), tuple(dropped)


def expected_fact(text: str, step: Subtask, domain: Domain) -> Literal:
    """A fact about a step's own things as one over its skill's parameters.

    Raises:
        ForestallError: it means nothing in the domain, is about something else, or no plan brings
            it about.
    """
    parsed = Literal.parse(text)
    bound, names = domain.bound(step), dict[str, list[str]]()
    for parameter, name in bound.items():
        names.setdefault(domain.canonical(name), []).append(parameter)
    args = []
    for given in parsed.args:
        meant = domain.canonical(given)
        known = given in bound or meant in domain.robot.hands
        parameters = [given] if known else names.get(meant, [])
        if len(parameters) != 1:
            why = f"is no thing of {step}" if not parameters else f"stands twice in {step}"
            raise Unfit(f"{given} {why}")
        args.append(parameters[0])
    fact = Literal(parsed.predicate, tuple(args), parsed.value)
    check_literal(domain, "the answer", fact)
    if fact.predicate not in changeable(domain):
        raise Unfit(f"no plan brings about {fact.predicate}")
    kinds = [domain.find(bound[a]) for a in args if a in bound]
    if fact.predicate in domain.attributes and not any(
        kind is not None and fact.predicate in kind.attributes for kind in kinds
    ):
        raise Unfit(f"{fact.predicate} is nothing that such a thing has")
    return fact


def steps(
    answer: str, skills: Collection[str], things: Collection[str], domain: Domain
) -> tuple[Subtask, ...]:
    """Read a plan's steps.

    Raises:
        Unfit: the first step that names a skill or a thing that is not at hand, by its number.
    """

    def read(field: Field) -> tuple[Subtask, ...]:
        found = field["steps"].at_most(MOST_STEPS, _step)
        for number, step in enumerate(found, 1):
            _check(number, step, skills, things, domain)
        return found

    return read_answer(answer, read)


def _step(field: Field) -> Subtask:
    return Subtask(field["skill"].text(), field["args"].at_most(MOST_FACTS, Field.text))


def _check(
    number: int,
    step: Subtask,
    skills: Collection[str],
    things: Collection[str],
    domain: Domain,
) -> None:
    if step.skill not in skills:
        raise Unfit(f"step {number}: there is no skill {_short(step.skill)}: {_some(skills)}")
    for name in step.args:
        if name not in things:
            raise Unfit(f"step {number}, {step.skill}: there is no thing {_short(name)}")
    try:
        domain.check(step)
    except ForestallError as error:
        raise Unfit(f"step {number}: {error}") from error


def _short(text: str) -> str:
    return repr(line(text)[:60])


def _some(names: Collection[str]) -> str:
    return "the skills are " + ", ".join(sorted(names))


def line(text: str, most: int = _LONGEST) -> str:
    """A model's text on one line that can be shown, cut where it is long."""
    shown = "".join(c if c.isprintable() else " " for c in text)
    told = " ".join(shown.split())
    return told if len(told) <= most else f"{told[: most - 1]}…"


def because(reasons: Sequence[str]) -> str:
    """What of an answer was left out, in one sentence; "" where nothing was."""
    return f"left out: {'; '.join(reasons)}" if reasons else ""
