"""`forestall compare` and `forestall check`: graphs and observations of the user's own."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forestall.cli.flags import Json, RunFlags, Settings
from forestall.cli.listing import say
from forestall.config import DEFAULT_DOMAIN

if TYPE_CHECKING:
    from forestall.assembly.checking import Judgement, Judgements
    from forestall.types.decision import MonitorDecision
    from forestall.types.verdict import Replan, Verdict


def compare(
    observed: Path, expected: Path, /, *, domain: str = DEFAULT_DOMAIN, as_json: Json = False
) -> int:
    """Compare two scene graphs: the paper's score, its parts, and the readable difference.

    Args:
        observed: scene graph of what is (JSON).
        expected: scene graph of what a demonstration showed (JSON).
        domain: of both graphs, by name or file.
        as_json: print JSON.
    """
    from forestall.assembly.stored import read_graph
    from forestall.comparison.score import ScoreConfig
    from forestall.comparison.score import compare as compare_graphs
    from forestall.domain.load import load_domain
    from forestall.embeddings.hashed import HashedTextEncoder

    result = compare_graphs(
        read_graph(observed),
        read_graph(expected),
        ScoreConfig(),
        HashedTextEncoder(),
        load_domain(domain),
    )
    parts = result.parts
    if as_json:
        print(
            json.dumps(
                {
                    "score": parts.score,
                    "node": parts.node,
                    "edge": parts.edge,
                    "structure": parts.structure,
                    "matches": [list(m) for m in result.matches],
                    "discrepancies": [
                        {"change": d.change.value, "subject": d.subject, "text": d.text}
                        for d in result.discrepancies
                    ],
                },
                indent=2,
            )
        )
        return 0
    say(f"score {parts.score:.3f}")
    for name, value in (("node", parts.node), ("edge", parts.edge), ("structure", parts.structure)):
        say(f"  {name:10s} {'off' if value is None else f'{value:.3f}'}")
    for d in result.discrepancies:
        say(f"  {d.change.value}: {d.text}")
    return 0


def check(
    *scenes: Path,
    subtask: str | None = None,
    plan: str | None = None,
    task: str | None = None,
    page: Path | None = None,
    explain: Path | None = None,
    memory: Path | None = None,
    domain: str | None = None,
    detector: str | None = None,
    threshold: float | None = None,
    states: str | None = None,
    config: Path | None = None,
    settings: Settings = None,
    as_json: Json = False,
) -> int:
    """Judge stored observations or scene graphs of your own, each before a subtask.

    Exit code 0: every one may proceed; 1: an alarm, with its cause and, where one is found, a
    corrected plan that was checked; 2: the input is not valid; 4: one could not be judged (no
    demonstration to compare with, or something that is needed was not seen).

    Args:
        scenes: observation folders (docs/observation-format.md), scene graphs (.json), or folders
            that hold numbered ones; judged in this order.
        subtask: what is about to start, e.g. "put_in(Plate, Microwave)". Without it the scenes are
            judged before the subtasks of the plan, one after the other.
        plan: "STEP; STEP", or a file with one step a line; the task's by default.
        task: the task's name or file, so that its own demonstrations are preferred and what it asks
            of things is judged; by default the one that all demonstrations of the memory are of.
        page: an HTML file to write about it.
        explain: a picture to write of what was understood: masks with their names, the scene from
            above; also of what is refused.
        memory: a demonstration file; the ready-made one of the task by default.
        domain: what everything is read in: a name, or a file (.toml, .pddl); by default the task's,
            else one that has the skills of the memory, else one that is learnt from it.
        detector: what judges: preconditions (by default), scene-graph, objects, caption, image.
        threshold: alarm below this score of what judges.
        states: given (as the folder says), or read off its pictures: learned, clip.
        config: a TOML file with a table for each kind of part; flags come over it.
        settings: one option of a part; --detector.threshold 0.85 is short for
            --set detector.threshold=0.85. Several values of one option stand between commas, and
            a part without a flag is named the same way: --strategy.name plan-check.
        as_json: print JSON.
    """
    from forestall.assembly.checking import Question, judge_stored
    from forestall.assembly.configuration import Given, run_config
    from forestall.assembly.demonstrations import memory_path
    from forestall.assembly.make import needs_memory
    from forestall.cli.demos import memory_of
    from forestall.errors import InputError
    from forestall.kinds import STATES
    from forestall.report.page import write_page

    given = RunFlags(
        detector=detector,
        threshold=threshold,
        states=states,
        memory=memory,
        domain=domain,
        config=config,
        settings=settings,
    ).given()
    remembering = Given(tuple(part for part in given.parts if part[0] != STATES.name))
    wanted = run_config(task or "", given=remembering)
    if explain is not None:
        from forestall.assembly.explaining import explain_stored

        own = wanted.load_domain() if task is None else wanted.load().domain
        for place in explain_stored(scenes, explain, own):
            print(place, file=sys.stderr)
    demonstrations, path = None, None
    if needs_memory(wanted):
        if task is None and memory_path(wanted) is None:
            raise InputError(
                "give --memory FILE, or --task NAME to compare with its ready-made memory"
            )
        demonstrations, path = memory_of(wanted, as_json)
    question = Question(subtask, plan, task)
    found = judge_stored(scenes, question, demonstrations, given, path, page is not None)
    if page is not None:
        write_page(found.record, page)
    if path is not None:
        _tell_stale(Path(path), domain)
    if found.limits:
        print(
            f"forestall: the domain is learnt from {path}; what it cannot know: "
            "'forestall domain learn'",
            file=sys.stderr,
        )
    if task is None and found.record.task.name:
        print(
            f"forestall: judged as the task {found.record.task.name}, the only one of {path}; "
            "--task names another",
            file=sys.stderr,
        )
    if found.eyes:
        print(f"forestall: {found.eyes}", file=sys.stderr)
    if as_json:
        print(json.dumps(_judgements_json(found, path, page), indent=2))
    else:
        _tell(found, page)
    return _code(found)


def _tell_stale(memory: Path, domain: str | None) -> None:
    """Say which corrections beside a memory change nothing any more."""
    from forestall.assembly.corrections import beside
    from forestall.assembly.mined import remembered
    from forestall.cli.preconditions import given_domain, tell_stale

    if beside(memory).is_file():
        tell_stale(remembered(memory, given_domain(domain)))


def _code(found: Judgements) -> int:
    if any(j.alarm for j in found.each):
        return 1
    return 0 if all(j.judged for j in found.each) else 4


def _judgements_json(found: Judgements, memory: str | None, page: Path | None) -> dict[str, Any]:
    record = found.record
    return {
        "outcome": found.outcome.value,
        "task": record.task.name or None,
        "domain": record.task.domain,
        "plan": record.initial_plan.texts(),
        "memory": memory,
        "limits": list(found.limits),
        "other_eyes": found.eyes or None,
        "page": None if page is None else str(page),
        "scenes": [_judgement_json(j) for j in found.each],
    }


def _judgement_json(judgement: Judgement) -> dict[str, Any]:
    decision, record = judgement.decision, judgement.record
    verdict, diagnosis, replan = decision.verdict, decision.diagnosis, decision.replan
    return {
        "scene": str(judgement.path),
        "subtask": str(record.subtask),
        "outcome": decision.outcome.value,
        "why": decision.why,
        "sentence": decision.sentence,
        "hold": None if decision.hold is None else decision.hold.value,
        "look_at": [list(point) for point in decision.look_at],
        "verdict": None if verdict is None else _verdict_json(verdict),
        "cause": None if diagnosis is None else diagnosis.cause,
        "must_change": [] if diagnosis is None else [str(f) for f in diagnosis.must_change],
        "culprits": [] if diagnosis is None else list(diagnosis.culprits),
        "replan": None if replan is None else _replan_json(replan),
        "graph": record.scoped.to_json(),
        "compute_s": sum(seconds for _, seconds in decision.seconds),
    }


def _verdict_json(verdict: Verdict) -> dict[str, Any]:
    nearest = verdict.nearest
    return {
        "decision": verdict.decision.value,
        "detector": verdict.detector,
        "score": verdict.score,
        "threshold": verdict.threshold,
        "calibration": verdict.calibration.value,
        "references": verdict.references,
        "nearest": None
        if nearest is None
        else {
            "demonstration": nearest.demonstration,
            "task": nearest.task,
            "subtask": str(nearest.subtask),
        },
        "discrepancies": [d.text for d in verdict.discrepancies],
        "note": verdict.note,
    }


def _replan_json(replan: Replan) -> dict[str, Any]:
    from forestall.records.derived import new_plan

    plan = new_plan(replan)
    return {
        "outcome": replan.outcome.value,
        "plan": None if plan is None else plan.texts(),
        "assumed": _assumed(replan),
        "note": replan.note,
    }


def _assumed(replan: Replan) -> list[str]:
    return [] if replan.check is None else [str(fact) for fact in replan.check.assumed]


def _tell(found: Judgements, page: Path | None) -> None:
    several = len(found.each) > 1
    for judgement in found.each:
        decision, record = judgement.decision, judgement.record
        where = f"{judgement.path}: " if several else ""
        say(f"{where}{decision.outcome.value}: before {record.subtask}")
        for line in _lines(decision):
            say(f"  {line}")
    if several:
        alarms = sum(j.alarm for j in found.each)
        unclear = sum(not j.judged for j in found.each)
        say(f"{len(found.each)} scenes: {alarms} with an alarm, {unclear} not judged")
    if page is not None:
        say(page)


def _lines(decision: MonitorDecision) -> Iterator[str]:
    """What is said of one scene, below its first line."""
    verdict, diagnosis, replan = decision.verdict, decision.diagnosis, decision.replan
    if decision.sentence:
        yield decision.sentence
    if verdict is not None:
        score = "none" if verdict.score is None else f"{verdict.score:.3f}"
        threshold, count = f"{verdict.threshold:.2f}", verdict.references
        yield f"score {score}, threshold {threshold}, {count} references"
    cause = "" if diagnosis is None else diagnosis.cause
    said = [decision.why, "" if verdict is None else verdict.note]
    yield from dict.fromkeys(text for text in said if text and text != cause)
    if verdict is not None:
        yield from (f"{d.change.value}: {d.text}" for d in verdict.discrepancies)
    if diagnosis is not None:
        yield f"cause: {diagnosis.cause}"
        yield from (f"must change: {fact}" for fact in diagnosis.must_change)
    if decision.plan is not None:
        yield "corrected plan, checked on what is seen:"
        yield from (f"  {n}. {step}" for n, step in enumerate(decision.plan, 1))
        if replan is not None and _assumed(replan):
            yield f"which relies on what was not seen: {', '.join(_assumed(replan))}"
