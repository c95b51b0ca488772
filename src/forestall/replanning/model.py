"""Replanning by a language model (paper, "replanning module").

Called by the strategies; calls a `LanguageModel`, the validator, and another replanner where no
answer can be taken. Whatever the model says, a plan leaves here only if the validator accepted it
on the observed graph.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from forestall.deadline import Deadline
from forestall.domain.model import Domain
from forestall.llm import words
from forestall.llm.answers import plan_schema, steps
from forestall.llm.asking import answered
from forestall.llm.forms import Unfit
from forestall.llm.prompts import rendered
from forestall.planning.execute import products
from forestall.planning.refused import denial, is_refused, unexplained
from forestall.planning.state import State
from forestall.planning.validate import as_checked, observed, run, unsupported
from forestall.seams.judging import PlanValidator, Replanner
from forestall.seams.language import LanguageModel
from forestall.types.exchange import Exchange, Request
from forestall.types.facts import Literal
from forestall.types.plan import Plan, same_step
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Diagnosis, PlanCheck, Replan, ReplanOutcome

_SHARE = 0.6
"""Of the time that there is, so that some is left for whoever plans otherwise."""


@dataclass(slots=True)
class _Attempts:
    """What was asked, and the last plan that was refused."""

    started_s: float
    exchanges: list[Exchange] = field(default_factory=list)
    rejected: tuple[Plan, PlanCheck] | None = None

    @property
    def reason(self) -> str:
        return self.exchanges[-1].problem if self.exchanges else "it was not asked"


class ModelReplanner:
    """Implements `Replanner`.

    Args:
        model: that is asked.
        validator: accepts or refuses every plan.
        domain: what is planned in.
        otherwise: plans where no answer was accepted; None: nobody does, and the attempt has
            failed.
        attempts: answers that are asked for, each with the validator's reason against the last.
    """

    name = "model"

    def __init__(
        self,
        model: LanguageModel,
        validator: PlanValidator,
        domain: Domain,
        otherwise: Replanner | None = None,
        *,
        attempts: int = 3,
    ) -> None:
        self._model, self._validator, self._domain = model, validator, domain
        self._otherwise, self._attempts = otherwise, attempts

    def replan(
        self, context: BoundaryContext, diagnosis: Diagnosis, deadline: Deadline | None = None
    ) -> Replan:
        """Ask for the corrected plan until one is accepted, a bounded number of times."""
        attempts = _Attempts(time.perf_counter())
        if not diagnosis.found:
            note = diagnosis.cause
            return self._ended(attempts, ReplanOutcome.NOTHING_TO_CHANGE, note)
        whole = deadline or Deadline()
        limit = whole.within(_SHARE * whole.left()) if whole.left() < float("inf") else whole
        state = observed(context.graph, self._domain)
        skills, things = self._skills(), self._things(context)
        goal = context.plan.goal or context.task.goal.text

        def read(answer: str) -> tuple[tuple[Plan, PlanCheck], str]:
            plan = Plan(steps(answer, skills, things, self._domain), goal)
            return self._accepted(plan, context, diagnosis, state, attempts), ""

        request = self.request(context, diagnosis)
        accepted, asked = answered(self._model, request, read, self._attempts, limit)
        attempts.exchanges.extend(asked)
        if accepted is None:
            return self._without(attempts, context, diagnosis, whole)
        return self._ended(attempts, ReplanOutcome.SOLVED, "", *accepted)

    def request(self, context: BoundaryContext, diagnosis: Diagnosis) -> Request:
        """What is asked at a boundary."""
        domain, graph = self._domain, context.graph
        state = observed(graph, domain)
        near = self._near(context, diagnosis)
        messages = rendered(
            "replanning",
            goal=context.task.goal.text,
            cause=diagnosis.cause,
            advice=diagnosis.advice,
            change=[words.fact(x) for x in diagnosis.must_change],
            stay=[words.fact(x) for x in _worth_telling(diagnosis, domain)],
            never=[words.fact(_plain(x)) for x in context.task.goal.never],
            refused=[words.step(s) for s in context.refused if s not in context.vain],
            vain=[words.step(s) for s in context.refused if s in context.vain],
            rest="; ".join(map(words.step, context.remaining())) or _done(context),
            holding=", ".join(words.name(h) for _, h in state.in_hands()) or "nothing",
            at=words.name(_stands(context, domain) or "an unknown place"),
            observed=words.scene(graph, domain, near),
            places=words.places(graph, domain, self._to_move(context, diagnosis)),
            skills=words.brief_skills(domain, graph, near),
        )
        schema = plan_schema(self._skills(), self._things(context))
        return Request("replanning", messages, schema)

    def _skills(self) -> tuple[str, ...]:
        return self._domain.robot.skills or tuple(self._domain.skills)

    def _things(self, context: BoundaryContext) -> frozenset[str]:
        """Names that a step may use: what is there or can be made, and what the plan speaks of.

        Of places of which any will do the category is a name, too.
        """
        domain = self._domain
        here = [n for n in context.graph.nodes if n.id not in domain.robot.hands]
        names = {n.id for n in here} | {a for s in context.remaining() for a in s.args}
        names |= _makeable(observed(context.graph, domain))
        return frozenset(names | {n.category for n in here if domain.is_open_support(n.category)})

    def _near(self, context: BoundaryContext, diagnosis: Diagnosis) -> frozenset[str]:
        """Things that are told with all that is known of them."""
        graph, names = context.graph, set(diagnosis.culprits)
        names |= {n.id for n in context.scoped.nodes}
        names |= {a for s in context.remaining() for a in s.args}
        names |= {a for x in diagnosis.must_change for a in x.args}
        names |= {h for _, h in observed(graph, self._domain).in_hands()}
        found = set()
        for name in names:
            matches = graph.matches(name)
            found |= set(matches) if len(matches) <= 2 else {matches[0]}
        return frozenset(found)

    def _to_move(self, context: BoundaryContext, diagnosis: Diagnosis) -> set[str]:
        """What the robot holds, and what stands in the way."""
        held = {h for _, h in observed(context.graph, self._domain).in_hands()}
        return held | {c for c in diagnosis.culprits if context.graph.get(c) is not None}

    def _accepted(
        self,
        plan: Plan,
        context: BoundaryContext,
        diagnosis: Diagnosis,
        state: State,
        attempts: _Attempts,
    ) -> tuple[Plan, PlanCheck]:
        """The plan as it was checked.

        Raises:
            Unfit: it is refused; with the exact reason.
        """
        check = self._validator.check(plan, context.graph, context.task.goal)
        reason = "" if check.ok else check.reason
        if check.step is not None and check.step < len(plan):
            reason = f"step {check.step + 1}, {plan.subtasks[check.step]}: {reason}"
        if check.ok:
            refused = unexplained(state, context.refused)
            denied = is_refused((check.plan or plan).subtasks, refused)
            if denied is not None:
                reason = denial(denied, context.vain)
        if not reason:
            reason = _ends_otherwise(plan, context) or _not_brought_about(plan, diagnosis, state)
        if reason:
            attempts.rejected = (plan, replace(check, ok=False, reason=reason))
            raise Unfit(reason)
        return as_checked(plan, check, state), check

    def _without(
        self, attempts: _Attempts, context: BoundaryContext, diagnosis: Diagnosis, left: Deadline
    ) -> Replan:
        """No answer was accepted: whoever plans otherwise, or nobody."""
        count = sum(e.answer is not None for e in attempts.exchanges)
        said = f"no plan of the language model was accepted in {count} answers"
        note = f"{said if count else 'the language model gave no plan'}: {attempts.reason}"
        if self._otherwise is None:
            outcome = ReplanOutcome.REJECTED if attempts.rejected else ReplanOutcome.NOT_FOUND
            return self._ended(attempts, outcome, note, *(attempts.rejected or (None, None)))
        if not diagnosis.must_change:  # advice alone tells a planner nothing: what fails does
            rest = Plan(context.remaining(), context.plan.goal)
            check = self._validator.check(rest, context.graph, context.task.goal)
            diagnosis = replace(diagnosis, must_change=check.lacking or check.unmet)
        found = _within(self._otherwise, context, diagnosis, left)
        note = "; ".join(x for x in (note, found.note) if x)
        return replace(found, note=note, exchanges=tuple(attempts.exchanges))

    def _ended(
        self,
        attempts: _Attempts,
        outcome: ReplanOutcome,
        note: str,
        plan: Plan | None = None,
        check: PlanCheck | None = None,
    ) -> Replan:
        return Replan(
            outcome,
            plan,
            check,
            self.name,
            seconds=time.perf_counter() - attempts.started_s,
            note=note,
            exchanges=tuple(attempts.exchanges),
        )


def _makeable(state: State) -> set[str]:
    """What skills can make of what is there: the kinds, and the instances by the next numbers."""
    domain, found = state.domain, set()
    for make in (m for skill in domain.skills.values() for m in skill.makes):
        for source, kind in domain.statics.get(make.by, ()):
            said = make.count
            each = said if isinstance(said, int) else domain.number(source, str(said)) or 1
            count = each * len(state.of_kind(source))
            found |= {*products(state, kind, count), *((kind,) if count else ())}
    return found


def _within(
    replanner: Replanner, context: BoundaryContext, diagnosis: Diagnosis, left: Deadline
) -> Replan:
    from inspect import signature

    if "deadline" in signature(replanner.replan).parameters:
        found: Replan = replanner.replan(context, diagnosis, deadline=left)  # type: ignore[call-arg]
        return found
    return replanner.replan(context, diagnosis)


def _ends_otherwise(plan: Plan, context: BoundaryContext) -> str:
    """Why a plan without a goal to be measured by is none: it must still do what was left."""
    if context.task.goal.literals:
        return ""
    left = context.remaining()
    end = plan.subtasks[max(0, len(plan) - len(left)) :]
    same = len(end) == len(left) and all(map(same_step, end, left))
    return "" if same else f"it must end with what was left: {'; '.join(map(str, left))}"


def _not_brought_about(plan: Plan, diagnosis: Diagnosis, state: State) -> str:
    """Why a plan does not do what the diagnosis asks for, "" where it does at some time."""
    open_facts = {
        x for x in diagnosis.must_change if not unsupported((x,), state.domain)
    }  # fmt: skip
    if not open_facts:
        return ""
    trace = run(state, plan.subtasks)
    missing = [
        x for x in diagnosis.must_change
        if x in open_facts and not any(s.holds(x) for s in trace.states)
    ]  # fmt: skip
    return f"it never brings about {', '.join(map(str, missing))}" if missing else ""


def _worth_telling(diagnosis: Diagnosis, domain: Domain) -> Sequence[Literal]:
    """Of what must stay the few that a short prompt has room for: how things lie."""
    moved = set(domain.containing)
    return [x for x in diagnosis.must_stay if x.predicate in moved and x.value == "true"][:3]


def _plain(fact: Literal) -> Literal:
    """A fact of a goal without the marks of its variables."""
    return Literal(fact.predicate, tuple(a.removeprefix("?") for a in fact.args), fact.value)


def _done(context: BoundaryContext) -> str:
    """The plan where nothing of it is left."""
    return f"done: {'; '.join(map(words.step, context.plan.subtasks)) or 'nothing'}"


def _stands(context: BoundaryContext, domain: Domain) -> str | None:
    """Where the robot is by name: the last place that it worked at, as far as it is still there."""
    hands = set(domain.robot.hands)
    held = {r.subject for r in context.graph.relations if r.object in hands}
    for done, _ in reversed(context.executed):
        if done.args and done.args[-1] not in held and done.skill in domain.skills:
            return done.args[-1]
    return None
