"""`forestall plan check`: does a plan by anybody run on a scene and reach its goal?"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from forestall.cli.flags import Json, Settings

if TYPE_CHECKING:
    from forestall.assembly.plan_checking import CheckedPlan


Steps = Annotated[str, Parameter(allow_leading_hyphen=True)]

plan = App(name="plan", help="Check plans by anybody.")


@plan.command
def check(
    steps: Steps,
    scene: Path,
    /,
    *,
    task: str | None = None,
    goal: str | None = None,
    domain: str | None = None,
    states: str | None = None,
    config: Path | None = None,
    settings: Settings = None,
    as_json: Json = False,
) -> int:
    """Say whether a plan runs on a scene and reaches its goal; nothing is executed.

    Exit code 0: it does; 1: a step would be refused, a goal stays unmet, or something would be
    spoilt; 2: the input is not valid; 4: it hangs on something that nobody observed.

    Args:
        steps: the plan: a file with one step a line or a JSON list of steps, "-" for standard
            input, or the steps themselves, "skill(Thing); skill(Thing, Place)".
        scene: a scene graph (JSON, docs/observation-format.md), whole or in the short form
            (docs/your-robot.md); the folder of an observation, with --domain or --task; or a run's
            folder or record, of which the last boundary counts.
        task: a name or a file, whose goal the plan is to reach.
        goal: instead of a task, "fact; fact; never fact"; of a run its own by default, else only
            whether the plan runs is judged.
        domain: what everything is read in: a name, or a file (.toml, .pddl).
        states: of an observation: given (as the folder says), or read off its pictures: learned,
            clip.
        config: a TOML file with a table for each kind of part; flags come over it.
        settings: one option of a part; --perceiver.feature text is short for
            --set perceiver.feature=text.
        as_json: print JSON.
    """
    from forestall.assembly.plan_checking import PlanQuestion, check_plan
    from forestall.cli.flags import SeeingFlags
    from forestall.planning.rehearse import PlanOutcome

    given = SeeingFlags(domain=domain, states=states, config=config, settings=settings).given()
    found = check_plan(PlanQuestion(steps, scene, task, goal), given)
    if as_json:
        print(json.dumps(_json(found), indent=2))
    else:
        _tell(found)
    codes = {PlanOutcome.RUNS: 0, PlanOutcome.FAILS: 1, PlanOutcome.OPEN: 4}
    return codes[found.rehearsal.outcome]


def _rows(found: CheckedPlan) -> Iterator[tuple[str, str, str, str]]:
    """Step, what its names mean, status, why."""
    rehearsal = found.rehearsal
    trace, refusal = rehearsal.trace, rehearsal.trace.refusal
    for index, step in enumerate(rehearsal.plan):
        if index < len(trace.meant):
            spoils = [s.sentence for s in rehearsal.spoils if s.step == index and not s.excused]
            status = "spoils" if spoils else "ok"
            yield str(step), str(trace.meant[index]), status, "; ".join(spoils)
        elif index == trace.step and refusal is not None:
            yield str(step), "", "refused", refusal.reason
        else:
            yield str(step), "", "not reached", ""


def _json(found: CheckedPlan) -> dict[str, Any]:
    rehearsal, check = found.rehearsal, found.rehearsal.check
    refusal = rehearsal.trace.refusal
    return {
        "outcome": rehearsal.outcome.value,
        "domain": found.domain.name,
        "goal": [str(x) for x in found.goal.literals],
        "never": [str(x) for x in found.goal.never],
        "steps": [
            {"step": number, "subtask": step, "meant": meant or None, "status": status, "why": why}
            for number, (step, meant, status, why) in enumerate(_rows(found), 1)
        ],
        "refusal": None
        if refusal is None or check.step is None
        else {
            "step": check.step + 1,
            "reason": refusal.reason,
            "lacking": [str(x) for x in refusal.lacking],
        },
        "spoils": [
            {
                "step": None if s.step is None else s.step + 1,
                "rule": s.what,
                "sentence": s.sentence,
                "excused": s.excused or None,
            }
            for s in rehearsal.spoils
        ],
        "unmet": [str(x) for x in check.unmet],
        "assumed": [str(x) for x in check.assumed],
        "unobserved": [str(x) for x in rehearsal.unobserved],
    }


def _tell(found: CheckedPlan) -> None:
    from forestall.cli.listing import print_table, say
    from forestall.planning.rehearse import PlanOutcome

    rehearsal, check = found.rehearsal, found.rehearsal.check
    rows: list[tuple[str, ...]] = [(str(n), *row) for n, row in enumerate(_rows(found), 1)]
    print_table(("", "step", "means", "", "why"), rows)
    for spoilt in rehearsal.spoils:
        when = "as the robot leaves" if spoilt.step is None else f"by step {spoilt.step + 1}"
        excuse = f" (no fault of the plan: {spoilt.excused})" if spoilt.excused else ""
        say(f"{when}: {spoilt.sentence}{excuse}")
    for fact in check.unmet:
        say(f"goal not met: {fact}")
    if check.assumed:
        say(f"nobody saw, and is taken to be: {', '.join(map(str, check.assumed))}")
    if rehearsal.outcome is PlanOutcome.OPEN:
        say(f"not judged: it hangs on what nobody saw: {', '.join(map(str, rehearsal.unobserved))}")
    elif rehearsal.outcome is PlanOutcome.RUNS:
        reached = " and reaches its goal" if found.goal.literals else "; no goal was asked for"
        say(f"runs{reached}")
    elif check.step is not None:
        say(f"does not run: step {check.step + 1} is refused: {check.reason}")
    else:
        say(f"does not do: {check.reason or 'something is spoilt that must not be'}")
