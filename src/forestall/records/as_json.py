"""Domain types → plain JSON data; called by `record.py` only, knows no files.

The keys are described in `docs/record-format.md`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from enum import Enum
from pathlib import PurePath
from typing import Any

import numpy as np

from forestall.records.derived import (
    Alarm,
    Mark,
    alarms,
    moments,
    provenance_of,
    reasoning_s,
    replans,
)
from forestall.types.episode import BoundaryRecord, EpisodeRecord, Event, ExecutedRecord
from forestall.types.observation import Observation
from forestall.types.plan import Subtask
from forestall.types.task import Goal
from forestall.types.verdict import Diagnosis, PlanCheck, Reference, Replan, Verdict

KIND = "episode"
RECORD_FORMAT = 1


def record_json(
    record: EpisodeRecord, *, page: str | None, images: Mapping[int, str]
) -> dict[str, Any]:
    """Everything of a run as plain data for JSON.

    Args:
        record: the finished run.
        page: where its page is, None where none was written.
        images: position in `record.boundaries` → where its picture is.

    Returns:
        Only dict, list, str, int, float, bool and None; a number that is not finite is None.
    """
    perception = provenance_of(record, "perception")
    reasoning = reasoning_s(record.compute_s)
    data = {
        "kind": KIND,
        "format": RECORD_FORMAT,
        "complete": True,
        "task": record.task.name,
        "title": record.task.title,
        "goal": goal_json(record.task.goal),
        "scenario": record.scenario,
        "strategy": record.strategy,
        "seed": record.seed,
        "success": record.success,
        "weak_success": record.weak_success,
        "failures": record.failures,
        "alarms": [alarm_json(a) for a in alarms(record)],
        "replans": replans(record),
        "initial_plan": record.initial_plan.texts(),
        "executed": [executed_json(e) for e in record.executed],
        "end": record.end,
        "simulated_s": record.simulated_s,
        "compute_s": dict(record.compute_s),
        "computed_s": sum(seconds for _, seconds in record.compute_s),
        "reasoning_s": reasoning,
        "total_s": record.simulated_s + reasoning,
        "perception": {"segmenter": None, "state_estimator": None, **perception},
        "memory": dict(record.provenance).get("memory"),
        "versions": provenance_of(record, "versions"),
        "provenance": dict(record.provenance),
        "page": page,
        "events": [event_json(e) for e in record.events],
        "boundaries": _boundaries(record, images),
        "final": None if record.final is None else record.final.to_json(features=False),
    }
    return {key: plain(value) for key, value in data.items()}


def _boundaries(record: EpisodeRecord, images: Mapping[int, str]) -> list[dict[str, Any]]:
    return [
        boundary_json(
            m.boundary,
            position=m.position,
            image=images.get(m.position),
            mark=m.mark,
            before=m.before,
            after=m.after,
        )
        for m in sorted(
            (m for m in moments(record) if m.position is not None), key=lambda m: m.position or 0
        )
        if m.boundary is not None and m.position is not None
    ]


def boundary_json(
    boundary: BoundaryRecord,
    *,
    position: int,
    image: str | None,
    mark: Mark | None,
    before: Iterable[Subtask],
    after: Iterable[Subtask] | None,
) -> dict[str, Any]:
    """One boundary; `before` is the rest of the plan when it came, `after` what replaced it."""
    b = boundary
    return {
        "position": position,
        "index": b.index,
        "when": b.when,
        "subtask": str(b.subtask),
        "mark": mark,
        "time_s": b.time_s,
        "looks": b.looks,
        "image": image,
        "observation": None if b.observation is None else _observation(b.observation),
        "graph": b.graph.to_json(features=False),
        "scoped": b.scoped.to_json(features=False),
        "verdict": None if b.verdict is None else _verdict(b.verdict),
        "diagnosis": None if b.diagnosis is None else _diagnosis(b.diagnosis),
        "replan": None if b.replan is None else _replan(b.replan),
        "why": b.why,
        "plan_before": [str(s) for s in before],
        "plan_after": None if after is None else [str(s) for s in after],
        "seconds": dict(b.seconds),
        "watched": [_watched(v) for v in b.watched],
    }


def alarm_json(alarm: Alarm) -> dict[str, Any]:
    """One alarm."""
    return {
        "position": alarm.position,
        "index": alarm.index,
        "when": alarm.when,
        "subtask": str(alarm.subtask),
        "score": alarm.score,
        "threshold": alarm.threshold,
        "cause": alarm.cause,
        "must_change": alarm.must_change,
        "culprits": alarm.culprits,
        "replanned": alarm.replanned,
        "outcome": alarm.outcome,
    }


def executed_json(executed: ExecutedRecord) -> dict[str, Any]:
    """One executed subtask with its outcome."""
    return {
        "index": executed.index,
        "subtask": str(executed.subtask),
        "status": executed.outcome.status,
        "reason": executed.outcome.reason,
        "duration_s": executed.outcome.duration_s,
    }


def event_json(event: Event) -> dict[str, Any]:
    """One event of the world (the scorer's view)."""
    return {
        "time_s": event.time_s,
        "kind": event.kind,
        "objects": event.objects,
        "text": event.text,
    }


def goal_json(goal: Goal) -> dict[str, Any]:
    """The goal condition, literals in their text form."""
    return {
        "text": goal.text,
        "variables": dict(goal.variables),
        "literals": [str(x) for x in goal.literals],
        "never": [str(x) for x in goal.never],
        "weak": [str(x) for x in goal.weak],
    }


def _observation(observation: Observation) -> dict[str, Any]:
    return {
        "time_s": observation.time_s,
        "holding": observation.gripper.holding,
        "robot_position_world_m": observation.robot_position_world_m,
        "cameras": [
            {
                "width": f.intrinsics.width,
                "height": f.intrinsics.height,
                "fx": f.intrinsics.fx,
                "fy": f.intrinsics.fy,
                "cx": f.intrinsics.cx,
                "cy": f.intrinsics.cy,
                "camera_to_world": f.camera_to_world.tolist(),
            }
            for f in observation.frames
        ],
    }


def _verdict(verdict: Verdict) -> dict[str, Any]:
    parts = verdict.parts
    return {
        "decision": verdict.decision,
        "detector": verdict.detector,
        "score": verdict.score,
        "threshold": verdict.threshold,
        "calibration": verdict.calibration,
        "parts": None
        if parts is None
        else {
            "score": parts.score,
            "node": parts.node,
            "edge": parts.edge,
            "structure": parts.structure,
        },
        "references": verdict.references,
        "nearest": None if verdict.nearest is None else _reference(verdict.nearest),
        "matches": verdict.matches,
        "discrepancies": [
            {
                "change": d.change,
                "subject": d.subject,
                "expected": d.expected,
                "observed": d.observed,
                "text": d.text,
            }
            for d in verdict.discrepancies
        ],
        "note": verdict.note,
    }


def _watched(verdict: Verdict) -> dict[str, Any]:
    """What a further detector said, without what it said it by."""
    return {
        "detector": verdict.detector,
        "decision": verdict.decision,
        "score": verdict.score,
        "threshold": verdict.threshold,
        "note": verdict.note,
    }


def _reference(reference: Reference) -> dict[str, Any]:
    return {
        "demonstration": reference.demonstration,
        "task": reference.task,
        "index": reference.index,
        "subtask": str(reference.subtask),
        "similarity": reference.similarity,
        "graph": reference.graph.to_json(features=False),
        "later": [str(s) for s in reference.later],
    }


def _diagnosis(diagnosis: Diagnosis) -> dict[str, Any]:
    return {
        "cause": diagnosis.cause,
        "must_change": [str(x) for x in diagnosis.must_change],
        "must_stay": [str(x) for x in diagnosis.must_stay],
        "culprits": diagnosis.culprits,
        "producer": diagnosis.producer,
    }


def _replan(replan: Replan) -> dict[str, Any]:
    return {
        "outcome": replan.outcome,
        "plan": None if replan.plan is None else replan.plan.texts(),
        "check": None if replan.check is None else _check(replan.check),
        "producer": replan.producer,
        "expanded": replan.expanded,
        "seconds": replan.seconds,
        "note": replan.note,
    }


def _check(check: PlanCheck) -> dict[str, Any]:
    return {
        "ok": check.ok,
        "step": check.step,
        "reason": check.reason,
        "lacking": [str(x) for x in check.lacking],
        "unmet": [str(x) for x in check.unmet],
        "assumed": [str(x) for x in check.assumed],
    }


def plain(value: Any) -> Any:
    """Anything that may stand in a record as JSON data; unknown objects by their text."""
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, Enum):
        return plain(value.value)
    if isinstance(value, np.generic | np.ndarray):
        return plain(value.tolist())
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(plain(k)): plain(v) for k, v in value.items()}
    if isinstance(value, set | frozenset):
        return sorted((plain(v) for v in value), key=str)
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    return value.as_posix() if isinstance(value, PurePath) else str(value)
