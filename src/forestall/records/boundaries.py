"""What happened ⇄ plain data: boundaries, observations by reference, executed subtasks, events.

Called by `codec.py` and by the recorder; calls `verdicts.py`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from forestall.reading.fields import Field
from forestall.reading.files import is_inside
from forestall.records.derived import Mark
from forestall.records.verdicts import (
    diagnosis_from,
    diagnosis_json,
    graph,
    replan_from,
    replan_json,
    subtask,
    verdict_from,
    verdict_json,
)
from forestall.types.decision import Outcome
from forestall.types.episode import (
    BoundaryRecord,
    Event,
    ExecutedRecord,
    SkillOutcome,
    SkillStatus,
    StoredFrame,
    StoredObservation,
)
from forestall.types.observation import GripperState, Intrinsics, Observation
from forestall.types.plan import Subtask
from forestall.types.runtime import When


def by_reference(
    observation: Observation, pictures: Sequence[str | None] | None = None
) -> StoredObservation:
    """An observation without its arrays.

    Args:
        observation: as seen.
        pictures: where the picture of each frame was stored; None where none was.
    """
    places = pictures or [None] * len(observation.frames)
    return StoredObservation(
        frames=tuple(
            StoredFrame(f.intrinsics, tuple(map(tuple, f.camera_to_world.tolist())), place)
            for f, place in zip(observation.frames, places, strict=True)
        ),
        gripper=observation.gripper,
        time_s=observation.time_s,
        robot_position_world_m=observation.robot_position_world_m,
    )


def boundary_json(
    boundary: BoundaryRecord,
    *,
    position: int,
    mark: Mark | None,
    before: Iterable[Subtask],
    after: Iterable[Subtask] | None,
) -> dict[str, Any]:
    """One boundary, and what follows from the run around it.

    Args:
        boundary: pictures of an observation that is not stored are left out.
        position: in the record.
        mark: what came of it, None while that is open.
        before: the rest of the plan when it came.
        after: what replaced that, None where it stayed.
    """
    b, seen = boundary, boundary.observation
    if isinstance(seen, Observation):
        seen = by_reference(seen)
    return {
        "position": position,
        "index": b.index,
        "when": b.when,
        "subtask": str(b.subtask),
        "outcome": b.outcome,
        "mark": mark,
        "time_s": b.time_s,
        "looks": b.looks,
        "image": None if seen is None or not seen.frames else seen.frames[-1].picture,
        "observation": None if seen is None else _observation_json(seen),
        "graph": b.graph.to_json(),
        "scoped": b.scoped.to_json(),
        "verdict": None if b.verdict is None else verdict_json(b.verdict),
        "diagnosis": None if b.diagnosis is None else diagnosis_json(b.diagnosis),
        "replan": None if b.replan is None else replan_json(b.replan),
        "why": b.why,
        "sentence": b.sentence,
        "plan_before": [str(s) for s in before],
        "plan_after": None if after is None else [str(s) for s in after],
        "seconds": dict(b.seconds),
        "compute_s": dict(b.compute_s),
        "watched": [verdict_json(v) for v in b.watched],
    }


def boundary_from(field: Field) -> BoundaryRecord:
    """Read what `boundary_json` wrote."""
    return BoundaryRecord(
        index=field["index"].whole(),
        subtask=subtask(field["subtask"]),
        graph=graph(field["graph"]),
        scoped=graph(field["scoped"]),
        observation=field.maybe("observation", _observation_from),
        looks=field["looks"].whole(),
        verdict=field.maybe("verdict", verdict_from),
        diagnosis=field.maybe("diagnosis", diagnosis_from),
        replan=field.maybe("replan", replan_from),
        why=field["why"].text(),
        seconds=field["seconds"].pairs(Field.number),
        time_s=field["time_s"].number(),
        when=field["when"].member(When),
        watched=field["watched"].tuple_of(verdict_from),
        outcome=field.maybe("outcome", lambda f: f.member(Outcome)),
        compute_s=field["compute_s"].pairs(Field.number),
        sentence=field.optional("sentence", Field.text) or "",
    )


def _observation_json(observation: StoredObservation) -> dict[str, Any]:
    gripper = observation.gripper
    return {
        "time_s": observation.time_s,
        "holding": gripper.holding,
        "hand_world_m": gripper.position_world_m,
        "released": gripper.released,
        "released_world_m": gripper.released_world_m,
        **({} if gripper.width_m is None else {"width_m": gripper.width_m}),
        "robot_position_world_m": observation.robot_position_world_m,
        "cameras": [
            {
                "width": f.intrinsics.width,
                "height": f.intrinsics.height,
                "fx": f.intrinsics.fx,
                "fy": f.intrinsics.fy,
                "cx": f.intrinsics.cx,
                "cy": f.intrinsics.cy,
                "camera_to_world": f.camera_to_world,
                "picture": f.picture,
            }
            for f in observation.frames
        ],
    }


def _observation_from(field: Field) -> StoredObservation:
    return StoredObservation(
        frames=field["cameras"].tuple_of(_frame),
        gripper=GripperState(
            holding=field.maybe("holding", Field.text),
            position_world_m=field["hand_world_m"].vector(),
            released=field.maybe("released", Field.text),
            released_world_m=field.maybe("released_world_m", Field.vector),
            width_m=field["width_m"].number() if "width_m" in field.value else None,
        ),
        time_s=field["time_s"].number(),
        robot_position_world_m=field["robot_position_world_m"].vector(),
    )


def _frame(field: Field) -> StoredFrame:
    pose = field["camera_to_world"].tuple_of(lambda row: row.tuple_of(Field.number))
    if len(pose) != 4 or any(len(row) != 4 for row in pose):
        field["camera_to_world"].fail("a (4, 4) matrix")
    return StoredFrame(
        Intrinsics(
            field["width"].whole(),
            field["height"].whole(),
            *(field[name].number() for name in ("fx", "fy", "cx", "cy")),
        ),
        pose,
        field.maybe("picture", _inside_the_folder),
    )


def _inside_the_folder(field: Field) -> str:
    if not is_inside(field.text()):
        field.fail("a path inside the folder of the record")
    return field.text()


def executed_json(executed: ExecutedRecord) -> dict[str, Any]:
    """One executed subtask with its outcome."""
    return {
        "index": executed.index,
        "subtask": str(executed.subtask),
        "status": executed.outcome.status,
        "reason": executed.outcome.reason,
        "duration_s": executed.outcome.duration_s,
        "hand_world_m": executed.outcome.hand_world_m,
    }


def executed_from(field: Field) -> ExecutedRecord:
    """Read what `executed_json` wrote."""
    outcome = SkillOutcome(
        status=field["status"].member(SkillStatus),
        duration_s=field["duration_s"].number(),
        reason=field["reason"].text(),
        hand_world_m=field.maybe("hand_world_m", Field.vector),
    )
    return ExecutedRecord(subtask(field["subtask"]), outcome, field["index"].whole())


def event_json(event: Event) -> dict[str, Any]:
    """One event of the world (the scorer's view)."""
    return {
        "time_s": event.time_s,
        "kind": event.kind,
        "objects": event.objects,
        "text": event.text,
    }


def event_from(field: Field) -> Event:
    """Read what `event_json` wrote."""
    return Event(
        time_s=field["time_s"].number(),
        kind=field["kind"].text(),
        objects=field["objects"].tuple_of(Field.text),
        text=field["text"].text(),
    )
