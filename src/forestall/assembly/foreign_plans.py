"""Plans of others through the plan check: converted, rehearsed, written for `forestall plan check`.

Called by `forestall import`; calls a set of plans (`seams.PlanSet`) and planning. Nothing is
executed.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from forestall.assembly.plan_checking import read_goal
from forestall.domain.model import Domain
from forestall.domain.toml_out import domain_toml
from forestall.errors import ForestallError, InputError
from forestall.files import replace_file
from forestall.planning.rehearse import PlanOutcome, Rehearsal, rehearse
from forestall.seams.others import PlanSet
from forestall.testing.symbolic_scene import start_scene
from forestall.types.foreign import ForeignPlan
from forestall.types.graph import SceneGraph
from forestall.types.recorded import Unread
from forestall.types.task import Goal

PLANS, DOMAINS, REPORT = "plans", "domains", "report.json"

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, slots=True)
class CheckedForeign:
    """A plan of others and what its check came to.

    Args:
        plan: as converted.
        rehearsal: step by step.
        domain: the file of its domain in the output, by name.
    """

    plan: ForeignPlan
    rehearsal: Rehearsal
    domain: str

    @property
    def spoils(self) -> list[str]:
        """What must never be so and is, a sentence each."""
        return [s.sentence for s in self.rehearsal.spoils if not s.excused]

    @property
    def result(self) -> str:
        """In a word or two: which of several things came of it first."""
        if self.rehearsal.outcome is not PlanOutcome.FAILS:
            return str(self.rehearsal.outcome.value)
        if self.rehearsal.trace.refusal is not None:
            return "refused"
        return "unsafe" if self.spoils else "goal not met"


@dataclass(slots=True)
class PlansReport:
    """What came of a set of plans.

    Args:
        checked: those that were converted.
        unread: the others, each with its reason.
    """

    checked: list[CheckedForeign] = field(default_factory=list)
    unread: list[Unread] = field(default_factory=list)

    def counts(self) -> list[tuple[str, dict[str, int]]]:
        """Label of the authors → result → how many."""
        found: dict[str, Counter[str]] = {}
        for c in self.checked:
            found.setdefault(c.plan.label, Counter())[c.result] += 1
        return [(label, dict(by)) for label, by in sorted(found.items())]

    def to_json(self) -> dict[str, Any]:
        """Everything, in plain data."""
        return {
            "converted": len(self.checked),
            "not_converted": len(self.unread),
            "results": dict(self.counts()),
            "plans": [_row(c) for c in self.checked],
            "why_not": [{"plan": u.name, "why": u.why} for u in self.unread],
        }


def _silent(done: int, total: int, what: str) -> None:
    """Nobody is told how far it is."""


def import_plans(plans: PlanSet, out: Path, progress: Progress = _silent) -> PlansReport:
    """Convert, check and write every plan of a set.

    Args:
        plans: the set.
        out: a new folder. `plans/<name>/` has `plan.txt`, `scene.json` and, where there is a goal,
            `goal.txt`, as `forestall plan check` takes them; `domains/` the domains with their
            safety rules; `report.json` what came of each, and what was not converted and why.
        progress: told how far it is.

    Raises:
        InputError: the folder is there and has something in it.
    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError(f"{out} is there already: name a new folder")
    (out / DOMAINS).mkdir(parents=True, exist_ok=True)
    report, written = PlansReport(), dict[str, Domain]()
    for done, plan in enumerate(plans.plans()):
        progress(done, len(plans), plan.name)
        if isinstance(plan, Unread):
            report.unread.append(plan)
            continue
        domain = plans.domain(plan)
        try:
            scene = plan.scene
            if not isinstance(scene, SceneGraph):
                scene = start_scene(domain, scene, 0)
            goal = read_goal(plan.goal, domain, scene) if plan.goal else Goal("")
            rehearsal = rehearse(plan.plan, scene, goal, domain)
        except ForestallError as error:
            report.unread.append(Unread(plan.name, str(error)))
            continue
        if written.get(domain.name) != domain:
            _write(out / DOMAINS / f"{domain.name}.toml", domain_toml(domain))
            written[domain.name] = domain
        _write_plan(out / PLANS / plan.name, plan, scene)
        report.checked.append(CheckedForeign(plan, rehearsal, f"{DOMAINS}/{domain.name}.toml"))
    _write(out / REPORT, json.dumps(report.to_json(), indent=1) + "\n")
    return report


def _row(checked: CheckedForeign) -> dict[str, Any]:
    rehearsal = checked.rehearsal
    refusal, step = rehearsal.trace.refusal, rehearsal.trace.step
    return {
        "plan": checked.plan.name,
        "label": checked.plan.label,
        "domain": checked.domain,
        "result": checked.result,
        "refused": None
        if refusal is None or step is None
        else {"step": step + 1, "subtask": str(rehearsal.plan.subtasks[step])}
        | {"why": refusal.reason},
        "spoils": checked.spoils,
        "unmet": [str(x) for x in rehearsal.check.unmet],
        "unobserved": [str(x) for x in rehearsal.unobserved],
        "left_out": list(checked.plan.left_out),
    }


def _write_plan(folder: Path, plan: ForeignPlan, scene: SceneGraph) -> None:
    folder.mkdir(parents=True)
    _write(folder / "plan.txt", "\n".join(plan.plan.texts()) + "\n")
    _write(folder / "scene.json", json.dumps(scene.to_json(), indent=1) + "\n")
    if plan.goal:
        _write(folder / "goal.txt", plan.goal + "\n")


def _write(path: Path, text: str) -> None:
    replace_file(path, text.encode())
