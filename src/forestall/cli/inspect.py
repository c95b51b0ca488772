"""`forestall compare` and `forestall check`: graphs and observations of the user's own."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from forestall.cli.flags import RunFlags, Settings
from forestall.config import DEFAULT_DOMAIN

if TYPE_CHECKING:
    from forestall.types.graph import SceneGraph
    from forestall.types.verdict import Diagnosis, Verdict

Json = Annotated[bool, Parameter(name="--json", negative="")]


def read_graph(path: Path) -> SceneGraph:
    """A scene graph from a JSON file.

    Raises:
        FileFormatError: it cannot be read, or is no scene graph.
        InputError: it contradicts itself (a dangling relation, an id twice).
    """
    from forestall.errors import FileFormatError, InputError
    from forestall.types.graph import SceneGraph

    try:
        return SceneGraph.from_json(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise FileFormatError(f"cannot read scene graph {path}: {error}") from error
    except InputError as error:
        raise type(error)(f"{path}: {error}") from error


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
    print(f"score {parts.score:.3f}")
    for name, value in (("node", parts.node), ("edge", parts.edge), ("structure", parts.structure)):
        print(f"  {name:10s} {'off' if value is None else f'{value:.3f}'}")
    for d in result.discrepancies:
        print(f"  {d.change.value}: {d.text}")
    return 0


def check(
    folder: Path,
    /,
    *,
    subtask: str,
    task: str | None = None,
    memory: Path | None = None,
    threshold: float | None = None,
    states: str | None = None,
    config: Path | None = None,
    settings: Settings = None,
    as_json: Json = False,
) -> int:
    """Judge a stored observation of your own before a subtask.

    Exit code 0: it fits; 1: an alarm; 4: it could not be judged (no demonstration to compare with,
    or something that is needed is not in view).

    Args:
        folder: the observation (docs/observation-format.md).
        subtask: what is about to start, e.g. "put_in(Plate, Microwave)".
        task: the task's name, so that its own demonstrations are preferred.
        memory: a demonstration file; the ready-made one of the task by default.
        threshold: alarm when no demonstration reaches this score.
        states: given (as the folder says), or read off its pictures: learned, clip.
        config: a TOML file with a table for each kind of part; flags come over it.
        settings: one option of a part; --detector.threshold 0.85 is short for
            --set detector.threshold=0.85.
        as_json: print JSON.
    """
    from forestall.assembly.checking import judge_stored
    from forestall.assembly.configuration import Given, run_config
    from forestall.assembly.demonstrations import memory_path
    from forestall.cli.demos import memory_of
    from forestall.errors import InputError
    from forestall.kinds import STATES
    from forestall.types.verdict import Decision

    flags = RunFlags(
        threshold=threshold, states=states, memory=memory, config=config, settings=settings
    )
    given = flags.given()
    remembering = Given(tuple(part for part in given.parts if part[0] != STATES.name))
    wanted = run_config(task or "", given=remembering)
    if task is None and memory_path(wanted) is None:
        raise InputError("give --memory FILE, or --task NAME to compare with its ready-made memory")
    demonstrations, path = memory_of(wanted, as_json)
    started = time.perf_counter()
    graph, verdict, diagnosis = judge_stored(folder, subtask, task, demonstrations, given)
    data = _verdict_json(verdict, diagnosis) | {
        "subtask": str(graph.subtask),
        "memory": path,
        "graph": graph.to_json(),
        "compute_s": time.perf_counter() - started,
    }
    if as_json:
        print(json.dumps(data, indent=2))
    else:
        judged = "not judged" if verdict.score is None else verdict.decision.value
        print(f"{judged}: before {graph.subtask}")
        score = "none" if verdict.score is None else f"{verdict.score:.3f}"
        print(
            f"  score {score}, threshold {verdict.threshold:.2f}, {verdict.references} references"
        )
        if verdict.note:
            print(f"  {verdict.note}")
        for d in verdict.discrepancies:
            print(f"  {d.change.value}: {d.text}")
        if diagnosis is not None:
            print(f"  cause: {diagnosis.cause}")
            for fact in diagnosis.must_change:
                print(f"  must change: {fact}")
    if verdict.decision is Decision.REPLAN:
        return 1
    return 0 if verdict.decision is Decision.PROCEED and verdict.score is not None else 4


def _verdict_json(verdict: Verdict, diagnosis: Diagnosis | None) -> dict[str, Any]:
    return {
        "decision": verdict.decision.value,
        "score": verdict.score,
        "threshold": verdict.threshold,
        "calibration": verdict.calibration.value,
        "references": verdict.references,
        "nearest": None
        if verdict.nearest is None
        else {
            "demonstration": verdict.nearest.demonstration,
            "task": verdict.nearest.task,
            "subtask": str(verdict.nearest.subtask),
        },
        "discrepancies": [d.text for d in verdict.discrepancies],
        "note": verdict.note,
        "cause": None if diagnosis is None else diagnosis.cause,
        "must_change": [] if diagnosis is None else [str(f) for f in diagnosis.must_change],
    }
