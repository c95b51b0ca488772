"""EpisodeRecord ⇄ plain data for JSON, both ways; knows no files.

Called by the recorder, the reader and the command line; calls `boundaries.py` and `verdicts.py`.
The keys are described in `docs/record-format.md`. What follows from the rest (alarms, marks, the
plans before and after, sums) is written for readers of the file and is not read back.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from forestall.domain.load import shipped, shipped_names
from forestall.errors import FileFormatError, InputError
from forestall.reading.fields import Field
from forestall.records.boundaries import (
    boundary_from,
    boundary_json,
    event_from,
    event_json,
    executed_from,
    executed_json,
)
from forestall.records.derived import (
    Alarm,
    alarms,
    moments,
    new_plan,
    provenance_of,
    reasoning_s,
    replans,
)
from forestall.records.plain import plain
from forestall.records.verdicts import graph, literal, plan
from forestall.types.episode import EpisodeEnd, EpisodeRecord, Trouble, TroubleKind
from forestall.types.plan import Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.types.task import Goal, Task

KIND = "episode"
RECORD_FORMAT = 3
_NOTED = ("kind", "format", "task", "end", "boundaries", "executed")
_MOST_CHANGES = 8  # of scene needs that tell what they were before a change


def record_to_json(record: EpisodeRecord, *, page: str | None = None) -> dict[str, Any]:
    """Everything of a run as plain data for JSON.

    Args:
        record: pictures of observations that are not stored are left out.
        page: where its page is, None where none was written.

    Returns:
        Only dict, list, str, int, float, bool and None; a number that is not finite is None.
    """
    reasoning = reasoning_s(record.compute_s)
    complete = record.end is not EpisodeEnd.UNFINISHED
    data = {
        "kind": KIND,
        "format": RECORD_FORMAT,
        "complete": complete,
        **head_json(record),
        "success": record.success,
        "weak_success": record.weak_success,
        "failures": record.failures,
        "alarms": [alarm_json(a) for a in alarms(record)],
        "replans": replans(record),
        "executed": [executed_json(e) for e in record.executed],
        "end": record.end if complete else None,
        "trouble": None if record.trouble is None else _trouble_json(record.trouble),
        "notes": record.notes,
        "simulated_s": record.simulated_s,
        "compute_s": dict(record.compute_s),
        "computed_s": sum(seconds for _, seconds in record.compute_s),
        "reasoning_s": reasoning,
        "total_s": record.simulated_s + reasoning,
        "perception": {
            "segmenter": None,
            "state_estimator": None,
            **provenance_of(record, "perception"),
        },
        "memory": dict(record.provenance).get("memory"),
        "versions": provenance_of(record, "versions"),
        "page": page,
        "events": [event_json(e) for e in record.events],
        "harmed": record.harmed,
        "boundaries": _boundaries(record),
        "final": None if record.final is None else record.final.to_json(),
    }
    return {key: plain(value) for key, value in data.items()}


def record_from_json(data: Any) -> EpisodeRecord:
    """Read what `record_to_json` made.

    Raises:
        FileFormatError: not a record, another format version, or a broken value, with its place.
    """
    field = Field(data)
    check_header(data)
    missing = [key for key in _NOTED if key not in data]
    if missing:
        raise FileFormatError(f"the record lacks {', '.join(missing)}")
    end = field.maybe("end", lambda f: f.member(EpisodeEnd))
    record = EpisodeRecord(
        task=_task(field),
        scenario=field.maybe("scenario", Field.text),
        strategy=field["strategy"].text(),
        seed=field["seed"].whole(),
        initial_plan=plan(field["initial_plan"], field["initial_plan_goal"]),
        boundaries=field["boundaries"].tuple_of(boundary_from),
        executed=field["executed"].tuple_of(executed_from),
        end=EpisodeEnd.UNFINISHED if end is None else end,
        success=field.maybe("success", Field.flag),
        weak_success=field.maybe("weak_success", Field.flag),
        failures=field["failures"].tuple_of(Field.text),
        events=field["events"].tuple_of(event_from),
        harmed=field["harmed"].tuple_of(_harm),
        simulated_s=field["simulated_s"].number(),
        compute_s=field["compute_s"].pairs(Field.number),
        final=field.maybe("final", graph),
        provenance=field["provenance"].pairs(lambda f: f.value),
        trouble=field.maybe("trouble", _trouble) if field.find("trouble") else None,
        notes=field["notes"].tuple_of(Field.text) if field.find("notes") else (),
    )
    _check_skills(record, field)
    return record


def _check_skills(record: EpisodeRecord, field: Field) -> None:
    """See that plans that were followed fit the domain, where it is a shipped one.

    A file of one's own may call its domain like a shipped one: where the plan of the task or what
    was executed does not fit, this is no domain to check against.
    """

    def check(step: Field) -> None:
        step.parsed(lambda text: domain.check(Subtask.parse(text)))

    if record.task.domain not in shipped_names():
        return
    domain = shipped(record.task.domain)
    try:
        domain.check_plan(record.task.plan)
        for done in record.executed:
            domain.check(done.subtask)
    except InputError:
        return
    field["initial_plan"].tuple_of(check)
    for place, boundary in zip(field["boundaries"].items(), record.boundaries, strict=True):
        check(place["subtask"])
        if new_plan(boundary.replan) is not None:
            place["replan"]["plan"].tuple_of(check)


def check_header(data: Any) -> None:
    """See that this is a record that can be read.

    Raises:
        FileFormatError: it is none, or of another format version.
    """
    if not isinstance(data, Mapping) or data.get("kind") != KIND:
        raise FileFormatError("it is not the record of a run")
    if data.get("format") != RECORD_FORMAT:
        raise FileFormatError(
            f"it has record format {data.get('format')!r}: this version reads {RECORD_FORMAT}; "
            "run the episode again"
        )


def head_json(record: EpisodeRecord) -> dict[str, Any]:
    """What is known of a run before it begins."""
    task = record.task
    return {
        "task": task.name,
        "title": task.title,
        "domain": task.domain,
        "goal": _goal_json(task.goal),
        "task_plan": task.plan.texts(),
        "task_plan_goal": task.plan.goal,
        "scene": _needs_json(task.scene),
        "scenario": record.scenario,
        "strategy": record.strategy,
        "seed": record.seed,
        "initial_plan": record.initial_plan.texts(),
        "initial_plan_goal": record.initial_plan.goal,
        "provenance": dict(record.provenance),
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
        "sentence": alarm.sentence,
        "must_change": alarm.must_change,
        "culprits": alarm.culprits,
        "replanned": alarm.replanned,
        "outcome": alarm.outcome,
    }


def _trouble_json(trouble: Trouble) -> dict[str, Any]:
    return {
        "kind": trouble.kind,
        "part": trouble.part,
        "text": trouble.text,
        "trace": trouble.trace,
    }


def _trouble(field: Field) -> Trouble:
    return Trouble(
        kind=field["kind"].member(TroubleKind),
        part=field["part"].text(),
        text=field["text"].text(),
        trace=field["trace"].text(),
    )


def _boundaries(record: EpisodeRecord) -> list[dict[str, Any]]:
    return [
        boundary_json(m.boundary, position=m.position, mark=m.mark, before=m.before, after=m.after)
        for m in sorted(moments(record), key=lambda m: m.position or 0)
        if m.boundary is not None and m.position is not None
    ]


def _task(field: Field) -> Task:
    goal = field["goal"]
    return Task(
        name=field["task"].text(),
        title=field["title"].text(),
        goal=Goal(
            text=goal["text"].text(),
            variables=goal["variables"].pairs(Field.text),
            literals=goal["literals"].tuple_of(literal),
            never=goal["never"].tuple_of(literal),
            weak=goal["weak"].tuple_of(literal),
        ),
        plan=plan(field["task_plan"], field["task_plan_goal"]),
        scene=_needs(field["scene"]),
        domain=field["domain"].text(),
    )


def _goal_json(goal: Goal) -> dict[str, Any]:
    return {
        "text": goal.text,
        "variables": dict(goal.variables),
        "literals": [str(x) for x in goal.literals],
        "never": [str(x) for x in goal.never],
        "weak": [str(x) for x in goal.weak],
    }


def _needs_json(needs: SceneNeeds) -> dict[str, Any]:
    return {
        "room": needs.room,
        "objects": [
            {
                "id": o.id,
                "category": o.category,
                "places": o.places,
                "states": dict(o.states),
                "in_front_of": o.in_front_of,
            }
            for o in needs.objects
        ],
        "fixtures": needs.fixtures,
        "clutter": needs.clutter,
        "vary": dict(needs.vary),
        "more_clutter": needs.more_clutter,
        "undisturbed": None if needs.undisturbed is None else _needs_json(needs.undisturbed),
    }


def _needs(field: Field, changes: int = 0) -> SceneNeeds:
    if changes > _MOST_CHANGES:
        field.fail(f"at most {_MOST_CHANGES} changes of a scene")
    low, high = _two(field["clutter"])
    return SceneNeeds(
        room=field["room"].text(),
        objects=field["objects"].tuple_of(_object),
        fixtures=field["fixtures"].tuple_of(_fixture),
        clutter=(low, high),
        vary=field["vary"].pairs(Field.whole),
        more_clutter=field["more_clutter"].whole(),
        undisturbed=field.maybe("undisturbed", lambda f: _needs(f, changes + 1)),
    )


def _two(field: Field) -> tuple[int, int]:
    numbers = field.tuple_of(Field.whole)
    if len(numbers) != 2:
        field.fail("two numbers")
    return (numbers[0], numbers[1])


def _object(field: Field) -> ObjectNeed:
    return ObjectNeed(
        id=field["id"].text(),
        category=field["category"].text(),
        places=field["places"].tuple_of(Field.text),
        states=field["states"].pairs(Field.text),
        in_front_of=field.maybe("in_front_of", Field.text),
    )


def _fixture(field: Field) -> tuple[str, str, str]:
    words = field.tuple_of(Field.text)
    if len(words) != 3:
        field.fail("a fixture, an attribute and a value")
    return (words[0], words[1], words[2])


def _harm(field: Field) -> tuple[float, str]:
    both = field.items()
    if len(both) != 2:
        field.fail("a time and what was harmed")
    return (both[0].number(), both[1].text())
