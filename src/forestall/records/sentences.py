"""What a decision says to the owner of the robot: what is, why it would fail, what will be done.

Called by the monitor for every moment that is not simply "go on"; calls `domain/spoken.py` and
`repairs.py`. Pure functions over what is recorded: nothing is judged here, and what was not seen is
said to be so.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from forestall.domain.model import LOCATED, Domain
from forestall.domain.spoken import Spoken, listed, sentence
from forestall.records.ahead import ahead, alike, instance_of, known_truth, needing
from forestall.records.repairs import will_do
from forestall.types.decision import Hold, MonitorDecision, Outcome
from forestall.types.facts import Literal, Truth, category_of
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext, StrategyAnswer, When
from forestall.types.verdict import Change, Decision, Diagnosis, Discrepancy, Verdict

_MOST = 2
"""How many facts a sentence tells."""

_UNSEEN = re.compile(r"^not (?:observed|located)(?: here, but in the demonstrations)?: ")
_HELD_IN = re.compile(r" \(held in \d+ of \d+(?: demonstrations?)?\)")


def in_sentences(
    context: BoundaryContext, decision: MonitorDecision, answer: StrategyAnswer, domain: Domain
) -> str:
    """What a decision says in sentences, empty where a step goes on and nobody objects.

    Args:
        context: what was known.
        decision: what the monitor made of it.
        answer: what the strategy said.
        domain: whose words are used.
    """
    spoken, verdict = Spoken(domain, context.graph), decision.verdict
    alarm = verdict is not None and verdict.decision is Decision.REPLAN
    if decision.outcome is Outcome.PROCEED and not alarm:
        return ""
    if decision.outcome is Outcome.LOOK:
        moment = _moment(context, spoken)
        if answer.suspected is not None:
            what = sentence(_what_is(context, answer.suspected, decision, domain, spoken))
            return f"{what} To be sure of that I look again {moment}."
        return sentence(f"{_unseen(spoken, decision)}, so I look again {moment}")
    if decision.outcome is Outcome.NOT_JUDGED:
        end = "I go on" if decision.may_start else "I do not go on by myself"
        return f"{sentence(_unseen(spoken, decision))} {sentence(end)}"
    said = [spoken.text(decision.why)]
    if decision.diagnosis is not None:
        said = [_what_is(context, decision.diagnosis, decision, domain, spoken)]
    said.append(_ends(context, decision, domain, spoken))
    if alarm and verdict is not None:
        said.append(_judges(verdict, answer.watched))
    return " ".join(sentence(s) for s in said if s)


# --- what is, and why the plan would fail by it ---------------------------------------------------


def _what_is(
    context: BoundaryContext,
    diagnosis: Diagnosis,
    decision: MonitorDecision,
    domain: Domain,
    spoken: Spoken,
) -> str:
    bound = [_bound(x, context) for x in diagnosis.must_change]
    if diagnosis.refusal and diagnosis.step is not None:
        return _refused(context, diagnosis, bound, domain, spoken)
    if diagnosis.step is not None:
        return spoken.text(diagnosis.cause)
    if not bound and diagnosis.advice:
        return spoken.text(diagnosis.cause)
    if not bound:
        return _unexplained(decision.verdict, diagnosis, spoken)
    if all(x.predicate == LOCATED for x in bound):
        return f"I do not know where {listed([spoken.the(x.args[0]) for x in bound], 'or')} is"
    if diagnosis.refusal:
        return _in_the_end(context, bound, domain, spoken)
    if diagnosis.support is None:
        return spoken.text(diagnosis.cause)
    return _unlike_before(context, diagnosis, bound, domain, spoken)


def _unexplained(verdict: Verdict | None, diagnosis: Diagnosis, spoken: Spoken) -> str:
    """Something differs from the demonstrations, and nothing says what of it matters."""
    differ = [] if verdict is None else [_difference(d, spoken) for d in verdict.discrepancies]
    if not differ:
        return spoken.text(diagnosis.cause)
    more = len(differ) - _MOST
    told = listed([*differ[:_MOST], *_counted(more)])
    return f"this is not as in the demonstrations, and I cannot tell what must change: {told}"


def _counted(more: int) -> list[str]:
    return [] if more < 1 else ["one more thing" if more == 1 else f"{more} more things"]


def _difference(found: Discrepancy, spoken: Spoken) -> str:
    attribute, _, value = found.observed.partition("=")
    if found.change is Change.STATE and value:
        return spoken.fact(Literal(attribute, (found.subject,), value))
    return spoken.text(found.text.partition(";")[0])


def _refused(
    context: BoundaryContext,
    diagnosis: Diagnosis,
    lacking: Sequence[Literal],
    domain: Domain,
    spoken: Spoken,
) -> str:
    """A step of what is left cannot run: its own sentence, or the role of what it lacks."""
    step, fact = diagnosis.step, lacking[0] if lacking else None
    assert step is not None
    told = spoken.text(diagnosis.refusal.partition(":")[0])
    left = ahead(context, domain)
    later = bool(left) and not alike(step, left[0])
    if fact is not None and _is_now(context, fact, later, domain):
        if _has_role(fact, domain):
            told = now(context, fact, domain, spoken, step.args)
        cannot = f"{told}, so {_cannot(context, step, told, fact, domain, spoken)}"
        if diagnosis.support is None:
            return cannot
        return f"{cannot}; {_was(fact, domain, spoken)} {in_demonstrations(*diagnosis.support)}"
    if later:
        told = f"if I go on, it comes to this: {told}"
    return f"{told}, so {_cannot(context, step, told, None, domain, spoken)}"


def _is_now(context: BoundaryContext, fact: Literal, later: bool, domain: Domain) -> bool:
    """Whether what a step lacks is lacking already, and does not only come to that."""
    if known_truth(context, fact, domain) is Truth.TRUE:
        return False
    known = not fact.args or bool(context.graph.matches(fact.args[0]))
    return known or not later or fact.predicate == LOCATED


def _unlike_before(
    context: BoundaryContext,
    diagnosis: Diagnosis,
    lacking: Sequence[Literal],
    domain: Domain,
    spoken: Spoken,
) -> str:
    """What held in the demonstrations does not now; what follows by the domain, if it says so."""
    fact, support = lacking[0], diagnosis.support
    assert support is not None
    steps = ahead(context, domain)
    step = needing(context, fact, steps, domain)
    hand = (domain.roles.holding, domain.roles.hand_empty)
    others = [x for x in lacking[1:] if x.predicate not in hand or fact.predicate not in hand]
    beside = () if step is None else step.args
    facts = [now(context, x, domain, spoken, beside) for x in (fact, *others[: _MOST - 1])]
    told = listed(list(dict.fromkeys(f for f in facts if f)))
    was = f"{_was(fact, domain, spoken)} {in_demonstrations(*support)}"
    if step is not None:
        return f"{told}, so {_cannot(context, step, told, fact, domain, spoken)}; {was}"
    risk = "if I go on"
    if steps and fact.args and _concerns(steps[0], fact) and _at_hand(context, steps[0]):
        risk = f"when I {_step(steps[0], told, fact, spoken)}"
    return f"{told}; {was}, so it may go wrong {risk}"


def _concerns(step: Subtask, fact: Literal) -> bool:
    return any(a in (fact.args[0], category_of(fact.args[0])) for a in step.args)


def _at_hand(context: BoundaryContext, step: Subtask) -> bool:
    return context.when is When.BEFORE and step == context.subtask


def _in_the_end(
    context: BoundaryContext, unmet: Sequence[Literal], domain: Domain, spoken: Spoken
) -> str:
    """All steps would run, and the goal would be missed or something be spoiled on the way."""
    goal = context.task.goal
    banned = {_sort(_bound(x, context)) for x in goal.never}
    banned -= {_sort(_bound(x, context)) for x in goal.literals}
    harm = [x for x in unmet if _sort(x) in banned]
    missed = [x for x in unmet if x not in harm]
    false = [x for x in missed if known_truth(context, x, domain) is Truth.FALSE]
    told = list(dict.fromkeys(now(context, x, domain, spoken) for x in false))[:_MOST]
    it = {false[0].args[0]: "it"} if len(told) == 1 and false[0].args else {}
    ends = []
    for fact in missed[:_MOST]:
        end = spoken.would(fact, False, it)
        still = fact.value == "false" and fact in false
        ends.append(end.replace(" be ", " still be ", 1) if still else end)
    for fact in {x.predicate: x for x in reversed(harm)}.values():
        alike = [x for x in harm if x.predicate == fact.predicate and x.args]
        names = it if len(alike) < 2 else {fact.args[0]: spoken.all_of([x.args[0] for x in alike])}
        ends.append(spoken.would(fact, True, names))
    if len(missed) > _MOST:
        ends.append(f"{len(missed) - _MOST} more of the goal would be missed")
    first = f"{sentence(listed(told))} " if told else ""
    return f"{first}With the plan as it is, {listed(ends)}"


def now(
    context: BoundaryContext,
    fact: Literal,
    domain: Domain,
    spoken: Spoken,
    beside: Sequence[str] = (),
) -> str:
    """What is the case where a fact should hold that does not: "there is a bowl in the microwave".

    Args:
        context: what is known.
        fact: ground.
        domain: roles.
        spoken: words.
        beside: things that the same sentence speaks of.
    """
    graph, roles, wanted = context.graph, domain.roles, fact.value == "true"
    name = instance_of(fact.args[0], context) if fact.args else ""
    if fact.is_state:
        node = graph.get(name)
        value = None if node is None else node.state(fact.predicate)
        if value is None:
            return f"I could not see whether {spoken.fact(fact)}"
        return spoken.fact(Literal(fact.predicate, (name,), value))
    if fact.predicate == roles.holding and wanted:
        held = graph.in_hands(fact.args[1:])
        if not held:
            return spoken.fact(fact, False)
        return f"I am holding {spoken.the(held[0])} and not {spoken.the(name)}"
    held = graph.in_hands(domain.robot.hands)
    if fact.predicate == roles.hand_empty and held and wanted:
        return f"I am holding {' and '.join(map(spoken.the, held))}"
    if fact.predicate == roles.vacant and wanted:
        return _contents(context, name, domain, spoken, beside)
    if fact.predicate == roles.unblocked and wanted and roles.blocking is not None:
        front = [r for r in graph.relations if r.predicate == roles.blocking and r.object == name]
        if front:
            return spoken.fact(Literal(roles.blocking, (front[0].subject, name)))
    if fact.predicate in domain.containing and wanted:
        parents = graph.parents(name, domain.containing)
        at = (r for r in graph.relations if r.subject == name and r.object in parents)
        relation = next(at, None)
        if relation is not None:
            there = spoken.place(relation.predicate, relation.object)
            meant = spoken.place(fact.predicate, fact.args[-1])
            return f"{spoken.the(name)} is {there} and not {meant}"
    return spoken.fact(fact, False)


def _contents(
    context: BoundaryContext, name: str, domain: Domain, spoken: Spoken, beside: Sequence[str]
) -> str:
    inside = context.graph.contents(name, domain.containing)
    at = [r.predicate for r in context.graph.relations if r.object == name and r.subject in inside]
    if not inside:
        return f"{spoken.the(name)} is not empty"
    verb = "is" if len(inside) == 1 else "are"
    return f"there {verb} {spoken.several(inside, beside)} {spoken.place(at[0], name)}"


def _cannot(
    context: BoundaryContext,
    step: Subtask,
    told: str,
    fact: Literal | None,
    domain: Domain,
    spoken: Spoken,
) -> str:
    """That a step will not run, now or later."""
    left = ahead(context, domain)
    later = "" if not left or alike(step, left[0]) else " later"
    return f"I cannot{later} {_step(step, told, fact, spoken)}"


def _step(step: Subtask, told: str, fact: Literal | None, spoken: Spoken) -> str:
    """A step, in which what was just spoken of is "it" where nothing else can be meant."""
    name = fact.args[0] if fact is not None and fact.args else ""
    it = " and not " not in told and spoken.the(name) in told if name else False
    called = {a: "it" for a in step.args if a in (name, category_of(name))} if it else {}
    return spoken.step(step, called)


# --- evidence, judges, and what follows -----------------------------------------------------------


def in_demonstrations(support: int, total: int) -> str:
    """In how many demonstrations something held; thin evidence is called so."""
    if total == 1:
        return "in the only demonstration there is"
    many = f"all {total}" if support == total else f"{support} of {total}"
    return f"in {many} demonstrations"


def _was(fact: Literal, domain: Domain, spoken: Spoken) -> str:
    """What the demonstrations had instead."""
    roles, wanted = domain.roles, fact.value == "true"
    if fact.is_state:
        return f"it was {domain.say(fact.predicate, fact.value).replace('_', ' ')}"
    if fact.predicate == roles.holding and wanted:
        return f"I was holding {spoken.the(fact.args[0])}"
    said = {
        roles.hand_empty: "my hand was empty",
        roles.vacant: "it was empty",
        roles.unblocked: "nothing was in its way",
        roles.accessible: "I could get at it",
        LOCATED: "I knew where it was",
    }
    return said.get(fact.predicate, "that was otherwise") if wanted else "that was otherwise"


_CALLED = {
    "scene graph": "comparison with demonstrations",
    "preconditions": "needs known from demonstrations",
    "skill status": "robot itself",
}
"""Judges whose own names say little to an owner."""


def _judges(verdict: Verdict, watched: Sequence[Verdict]) -> str:
    """Who raised the alarm, and whether the others agree."""
    others = [v for v in watched if v.detector != verdict.detector and v.judged]

    def named(decision: Decision) -> list[str]:
        return [f"by the {_judge(v)}" for v in others if v.decision is decision]

    by = [f"by the {_judge(verdict)}", *named(Decision.REPLAN)]
    unsure = [x.removeprefix("by ") for x in named(Decision.LOOK_AGAIN)]
    said = f"the alarm is raised {listed(by)}"
    said += f", not {listed(named(Decision.PROCEED), 'or')}" if named(Decision.PROCEED) else ""
    return said + (f"; too little was seen for {listed(unsure)}" if unsure else "")


def _judge(verdict: Verdict) -> str:
    if verdict.expected_by:
        return f"needs that the language model {verdict.expected_by} expects"
    plain = verdict.detector.replace("_", " ").replace("-", " ")
    return _CALLED.get(plain, plain)


def _ends(
    context: BoundaryContext, decision: MonitorDecision, domain: Domain, spoken: Spoken
) -> str:
    """What will be done."""
    replan = decision.replan
    sought = () if replan is None else replan.looking_for
    if decision.outcome is Outcome.REPLAN and decision.plan is not None:
        return will_do(context, decision.plan, sought, domain, spoken)
    if decision.hold is Hold.REPLAN_LIMIT and replan is not None and replan.plan is not None:
        help_ = will_do(context, replan.plan, sought, domain, spoken)
        return f"this would help: {help_}. I do not go on by myself"
    if decision.outcome is Outcome.PROCEED:
        return "I go on all the same"
    why = "" if decision.diagnosis is None else spoken.text(decision.why)
    if decision.hold is Hold.STOPPED:
        return "I found nothing that mends this, so I stop here"
    if decision.hold is Hold.ALARM and why.startswith("tried "):
        return f"I {why}, so I do not go on by myself"
    if decision.hold is Hold.TOO_MANY and why:
        return f"{sentence(why)} I do not go on by myself"
    return "I do not go on by myself"


def _unseen(spoken: Spoken, decision: MonitorDecision) -> str:
    """What was not seen, or why else nothing can be said."""
    note = "" if decision.verdict is None else decision.verdict.note
    for why in (decision.why, note):
        if _UNSEEN.match(why):
            left = _HELD_IN.sub("", _UNSEEN.sub("", why))
            facts = [x for x in re.split(r", (?![^(]*\))", left) if x]
            told = [f"whether {spoken.text(x)}" if "(" in x else spoken.the(x) for x in facts]
            return f"I could not see {listed(told)}"
    return spoken.text(decision.why or note) or "I could not see enough"


def _moment(context: BoundaryContext, spoken: Spoken) -> str:
    told = spoken.step(context.subtask)
    return f"before I {told}" if context.when is When.BEFORE else "before I go on"


def _sort(fact: Literal) -> tuple[str, ...]:
    return (fact.predicate, fact.value, *map(category_of, fact.args))


def _bound(fact: Literal, context: BoundaryContext) -> Literal:
    """Variables of the goal are told as the kinds that they stand for."""
    return fact.bind(dict(context.task.goal.variables))


def _has_role(fact: Literal, domain: Domain) -> bool:
    r = domain.roles
    roles = (r.vacant, r.holding, r.hand_empty, r.unblocked, r.accessible, LOCATED)
    return fact.predicate in roles and fact.value == "true"
