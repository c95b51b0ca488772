"""Several judges that are heard together: what they say in common, and what they say must change.

Built by the composition root for `proactive`. Every verdict is kept; which of them decides is a
rule of its own: what each judge is worth can be told apart from how they are put together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import Enum

from forestall.domain.model import Domain
from forestall.strategies.intervention import PLAN_CHECK, checked, would_not_work
from forestall.strategies.judges import Judge
from forestall.strategies.plan_check import told
from forestall.strategies.relied import relied_on_now
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Decision, Diagnosis, PlanCheck, Verdict


class Agree(Enum):
    """How many of the judges an alarm takes."""

    ANY = "any"
    ALL = "all"


class Panel:
    """Judges in their order, the plan check after them where it is one.

    - `any`: one alarm is an alarm; whoever has not seen enough asks for a look first;
    - `all`: an alarm is one where every judge that has judged raises it, so that one that lets the
      step pass decides.

    A judge that had nothing to compare with has no voice.

    Args:
        judges: detectors.
        checks_plan: whether the plan check is one of them.
        agree: how many it takes.
    """

    def __init__(
        self, judges: Sequence[Judge], checks_plan: bool = False, agree: Agree = Agree.ANY
    ) -> None:
        self._judges, self.checks_plan, self._agree = tuple(judges), checks_plan, agree

    def hear(
        self, context: BoundaryContext, check: PlanCheck | None, domain: Domain
    ) -> tuple[Verdict, ...]:
        """What each judge says; `check` is of the rest of the plan, None where none is asked."""
        said = [judge.judge(context) for judge in self._judges]
        if check is not None:
            said.append(plan_verdict(context, check, domain))
        return tuple(said)

    def decide(self, said: Sequence[Verdict]) -> Verdict:
        """The verdict that speaks for all."""
        voices = [v for v in said if v.judged]
        alarms = [v for v in voices if v.decision in (Decision.REPLAN, Decision.STOP)]
        unsure = [v for v in voices if v.decision is Decision.LOOK_AGAIN]
        fine = [v for v in voices if v.decision is Decision.PROCEED]
        if self._agree is Agree.ALL and fine:
            return fine[0]
        checks = [v for v in alarms if v.detector == PLAN_CHECK]
        return (*unsure[:1], *checks, *alarms, *fine, *said)[0]

    def once_more(self, said: Sequence[Verdict]) -> Verdict:
        """The same where nobody can look again: who has not seen enough stands behind an alarm."""
        heard = self.decide(said)
        if heard.decision is not Decision.LOOK_AGAIN:
            return heard
        surer = [v for v in said if v.decision is not Decision.LOOK_AGAIN]
        again = self.decide(surer) if surer else heard
        return again if again.decision is Decision.REPLAN else heard


def plan_verdict(context: BoundaryContext, check: PlanCheck, domain: Domain) -> Verdict:
    """What a check of the rest of the plan says: fine, an alarm, or that something was not seen."""
    verdict = checked(PLAN_CHECK, check.ok, told(check))
    if not check.ok:
        verdict = replace(verdict, lacking=check.lacking or check.unmet)
        return replace(verdict, decision=Decision.LOOK_AGAIN) if context.may_look else verdict
    unseen = [str(x) for x in relied_on_now(check, context, domain)]
    lost = [n for n in context.subtask.args if not context.graph.matches(n)]
    if not lost and not unseen:
        return verdict
    note = f"not observed: {', '.join(lost or unseen)}"
    return replace(verdict, decision=Decision.LOOK_AGAIN, note=note)


def together(check: PlanCheck | None, compared: Diagnosis | None) -> Diagnosis:
    """One diagnosis of what the plan check and the demonstrations say must change.

    The plan check comes first, since it names the step that would fail. Where both speak of the
    same fact, it has the evidence of the demonstrations.
    """
    refused = None if check is None or check.ok else would_not_work(check)
    found = [d for d in (refused, compared) if d is not None]
    first = next((d for d in found if d.must_change), found[0])
    if compared is not None and first is not compared:
        first = replace(
            first, why=compared.why, advice=compared.advice, exchanges=compared.exchanges
        )
    if refused is None or compared is None or not compared.must_change:
        return first
    change = tuple(dict.fromkeys((*refused.must_change, *compared.must_change)))
    same = compared.must_change[0] in refused.must_change[:1]
    return replace(
        first,
        must_change=change,
        must_stay=tuple(x for x in compared.must_stay if x not in change),
        culprits=tuple(dict.fromkeys((*refused.culprits, *compared.culprits))),
        support=compared.support if same or first is compared else None,
    )
