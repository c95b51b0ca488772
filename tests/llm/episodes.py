"""Whole runs in the symbolic household, with a scripted server in the place of a model.

The same in the kitchen takes minutes a run: its pictures are drawn, and four demonstrations first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.language import said_llm
from forestall.assembly.make import prepare, run_episode
from forestall.assembly.recording import RecordingJob, record_one
from forestall.config import DEMONSTRATION_SEEDS
from forestall.types.demonstration import Demonstration
from forestall.types.episode import EpisodeRecord
from forestall.types.plan import Plan
from forestall.types.verdict import Diagnosis
from llm.server import Reply, Script, Scripted, purpose_of, said, serving

SYMBOLIC = Given.named({"world": "symbolic", "perceiver": "given-graph"})
SEED = 10_003


@cache
def memory(task: str, kitchen: bool = False) -> Sequence[Demonstration]:
    """Four demonstrations, recorded once for all tests."""
    seeds = (DEMONSTRATION_SEEDS + 10 * k for k in range(4))
    world = Given() if kitchen else SYMBOLIC
    return [record_one(RecordingJob(task, seed, world)) for seed in seeds]


def played(task: str, scenario: str | None, llm: str | None = None, **parts: Any) -> EpisodeRecord:
    """One run; `llm` as the flag says it, `kitchen=True` in the kitchen."""
    kitchen = bool(parts.pop("kitchen", False))
    given = Given.named(parts).over(said_llm(llm)).over(Given() if kitchen else SYMBOLIC)
    config = run_config(task, scenario, seed=SEED, given=given)
    return run_episode(prepare(config), memory(task, kitchen))


ALONE = {"reasoner.otherwise": "none", "replanner.otherwise": "none"}
"""Nobody stands behind the model."""


def good_answers(record: EpisodeRecord) -> dict[str, list[Any]]:
    """What a good model answers in turn, of a run in which the planner did it; by purpose."""
    answers: dict[str, list[Any]] = {"reasoning": [], "replanning": []}
    for boundary in record.boundaries:
        diagnosis, replan = boundary.diagnosis, boundary.replan
        if diagnosis is not None and diagnosis.producer == "preconditions":
            answers["reasoning"].append(explanation(diagnosis))
        if replan is not None and replan.plan is not None:
            answers["replanning"].append(steps(replan.plan))
    return answers


def good_script(record: EpisodeRecord) -> Script:
    """The same as a script."""
    answers = good_answers(record)

    def script(body: dict[str, Any]) -> Reply:
        left = answers[purpose_of(body)]
        return said(left.pop(0) if len(left) > 1 else left[0])

    return script


@contextmanager
def good_model(
    task: str, scenario: str, kitchen: bool = False
) -> Iterator[tuple[Scripted, EpisodeRecord]]:
    """A server with good answers for a scenario, and the planner's own run."""
    record = played(task, scenario, kitchen=kitchen)
    with serving(good_script(record)) as server:
        yield server, record


def explanation(diagnosis: Diagnosis) -> dict[str, Any]:
    return {
        "cause": diagnosis.cause,
        "why": "the step would fail",
        "because_of": list(diagnosis.culprits)[:12],
        "must_change": list(map(str, diagnosis.must_change))[:12],
        "must_stay": list(map(str, diagnosis.must_stay))[:12],
        "advice": "put that right first" if diagnosis.must_change else "",
    }


def steps(plan: Plan) -> dict[str, Any]:
    return {"idea": "", "steps": [{"skill": s.skill, "args": list(s.args)} for s in plan]}
