"""Demonstrations from whatever shows one: a memory file, runs, graphs, steps in Python, a mixture.

Called by `monitor` and the command line; calls memory and records. A demonstration that somebody
wrote is one JSON file, or one list of steps in Python:

    [("grasp(peg-1)", scene), ("insert(peg-1, hole-1)", scene), last_scene]
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import forestall
from forestall.assembly.eyes import Eyes, is_picture
from forestall.errors import FileFormatError, ForestallError, InputError
from forestall.memory.codec import encode
from forestall.memory.recording import demonstration_from
from forestall.memory.store import open_store
from forestall.perception.folder import OBSERVATION_FILE
from forestall.reading.documents import read_json
from forestall.reading.files import inside
from forestall.records.record import read_record
from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.facts import Literal, is_instance
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.symbolic import scene_graph

MEMORY_SUFFIXES = (".db", ".sqlite", ".sqlite3")
RECORD_FILES = ("record.json", "boundaries.jsonl")
_BESIDE = ("-wal", "-shm")
WRITTEN_KEYS = ("task", "scene", "steps", "final")
LABEL = "a person's label"
"""Where a demonstration comes from that nobody ran."""

_PAIR = 2

Source = Any
"""A path, a `Demonstration`, a list of steps, or an iterable of these."""


def demonstrations_from(
    source: Source, eyes: Eyes | None = None, memories: list[Path] | None = None
) -> list[Demonstration]:
    """Every demonstration of a source.

    Args:
        source: a memory file; the folder of a run; a JSON file of a demonstration that somebody
            wrote (`written`), or of one graph with its subtask; a folder of any of these; a
            `Demonstration`; a list of steps; or an iterable of all that.
        eyes: see scenes that are pictures; without them these are refused.
        memories: every memory file that was read is added to them.

    Returns:
        Demonstrations with ids that differ, in the order of the source. Of the same one in several
        files there is one; equal ones that are given in Python are as many as are given.

    Raises:
        InputError: something that is no demonstration, with its place.
        MemoryFileError: see `memory.store`.
    """
    return gathered(source, eyes, memories)[0]


def gathered(
    source: Source, eyes: Eyes | None = None, memories: list[Path] | None = None
) -> tuple[list[Demonstration], int]:
    """Like `demonstrations_from`, and how many were left out because they were there already.

    Raises:
        InputError: something that is no demonstration, with its place.
        MemoryFileError: see `memory.store`.
    """
    found = _from(source, eyes, [] if memories is None else memories)
    if not found:
        raise InputError(f"no demonstration was found in {_said(source)}")
    named = _named(found)
    return named, len(found) - len(named)


def passed_over(sources: Iterable[Path]) -> list[Path]:
    """What in folders of demonstrations is read as none: unknown files, and folders of no run.

    Hidden things, what a memory has beside it and stored observations, of which demonstrations
    have some, are not meant to be any.
    """
    return [
        entry
        for folder in sources
        if folder.is_dir() and not _is_run(folder)
        for entry in sorted(folder.iterdir())
        if not (_shows(entry) or entry.name.startswith(".") or entry.name.endswith(_BESIDE))
        and not (entry / OBSERVATION_FILE).is_file()
    ]


def scoped(
    demonstrations: Iterable[Demonstration], scope: Callable[[SceneGraph, Subtask], SceneGraph]
) -> list[Demonstration]:
    """Demonstrations whose graphs are whole, cut to what concerns each subtask as a monitor's are.

    Args:
        demonstrations: those that were cut before stay as they are.
        scope: of the perceiver that they are compared with.
    """
    return [
        replace(
            d,
            steps=tuple(
                replace(s, graph=scope(s.whole, s.subtask))
                if s.graph == replace(s.whole, subtask=s.subtask)
                else s
                for s in d.steps
            ),
        )
        for d in demonstrations
    ]


def written(data: Any, folder: Path | None = None, eyes: Eyes | None = None) -> Demonstration:
    """A demonstration as somebody wrote it.

    Args:
        data: {"task", "scene", "steps": [{"subtask", "scene"}], "final"}; a scene is a graph in
            its short form or in JSON, or the name of a file with one. Or a list of
            (subtask, scene), behind which may stand the scene after the last one.
        folder: where files are looked for; None: scenes are not in files.
        eyes: see scenes that are pictures: an observation, one in plain data, or the name of the
            folder of a stored one.

    Raises:
        InputError: what cannot be read, with the number of the step.
    """
    if isinstance(data, Mapping):
        for key in data:
            if key not in WRITTEN_KEYS:
                known = ", ".join(WRITTEN_KEYS)
                raise InputError(f"a demonstration has no entry {key!r}: known are {known}")
        steps = data.get("steps")
        if not isinstance(steps, Sequence) or isinstance(steps, str):
            raise InputError('a demonstration needs \'steps\', a list of {"subtask", "scene"}')
        pairs = [_pair(number, step) for number, step in enumerate(steps, 1)]
        final, task = data.get("final"), str(data.get("task", ""))
        scene = str(data.get("scene", ""))
    else:
        ends = bool(data) and not _is_pair(data[-1])
        pairs = [_pair(n, step) for n, step in enumerate(data[: len(data) - ends], 1)]
        final, task, scene = (data[-1] if ends else None), "", ""
    if not pairs:
        raise InputError("a demonstration needs one step at least")
    made = []
    seen = any(is_picture(given) or _is_folder(given, folder) for _, given in pairs)
    if seen and eyes is not None:
        eyes.begin()
    for number, (subtask, given) in enumerate(pairs, 1):
        try:
            graph = _scene(given, folder, eyes)
            made.append(_step(number - 1, subtask, graph, eyes if seen else None))
        except InputError as error:
            raise InputError(f"step {number}: {error}") from error
    last = None if final is None else _scene(final, folder, eyes)
    return Demonstration(task, scene, 0, tuple(made), version=forestall.__version__, final=last)


def labelled(
    subtask: str, scene: Path | None = None, facts: Iterable[str] = (), task: str = ""
) -> Demonstration:
    """A demonstration of one step, which somebody says should look so; it says so itself.

    Args:
        subtask: in text form.
        scene: a file with a graph.
        facts: that hold, in text form, over instances: states and relations.
        task: the name of its task.

    Raises:
        InputError: neither a scene nor a fact, a fact that does not hold of anything, or a file
            that cannot be read.
    """
    given: dict[str, Any] = {"objects": {}, "relations": []}
    for fact in map(Literal.parse, facts):
        if fact.value == "false" or len(fact.args) != (1 if fact.is_state else _PAIR):
            raise InputError(
                f"the fact '{fact}' cannot be drawn: write states, attribute(thing-1)=value, and "
                "relations that hold, relation(thing-1, thing-2)"
            )
        for name in fact.args:
            given["objects"].setdefault(name, {})
        if fact.is_state:
            given["objects"][fact.args[0]][fact.predicate] = fact.value
        else:
            given["relations"].append((fact.args[0], fact.predicate, fact.args[1]))
    graph = scene_graph(given)
    if scene is not None:
        graph = _over(graph, _scene(scene.name, scene.parent, None))
    if not graph.nodes:
        raise InputError("a label says nothing: give a scene, or a fact")
    steps = [{"subtask": subtask, "scene": graph}]
    made = written({"task": task, "scene": "label", "steps": steps})
    return replace(made, perception=(("source", LABEL),))


def _over(said: SceneGraph, seen: SceneGraph) -> SceneGraph:
    """A scene with what is said beside it: more things, states and relations."""
    own = {n.id: n for n in said.nodes}
    nodes = [
        replace(n, states=tuple({**dict(n.states), **dict(own.pop(n.id).states)}.items()))
        if n.id in own
        else n
        for n in seen.nodes
    ]
    return replace(
        seen,
        nodes=(*nodes, *own.values()),
        relations=(*seen.relations, *said.relations),
    )


def _from(source: Source, eyes: Eyes | None, memories: list[Path]) -> list[Demonstration]:
    if isinstance(source, Demonstration):
        return [source]
    if isinstance(source, str | Path):
        return _from_path(Path(source), eyes, memories)
    if isinstance(source, Mapping) or _is_steps(source):
        return [written(source, None, eyes)]
    if isinstance(source, Iterable):
        found = []
        for number, part in enumerate(source, 1):
            try:
                found += _from(part, eyes, memories)
            except InputError as error:
                raise InputError(f"demonstration {number}: {error}") from error
        return found
    raise InputError(
        f"{_said(source)} shows no demonstration: give a memory file, the folder of a run, a "
        "demonstration in JSON, a list of (subtask, scene), or a list of these"
    )


def _from_path(path: Path, eyes: Eyes | None, memories: list[Path]) -> list[Demonstration]:
    if not path.exists():
        raise FileFormatError(f"{path}: there is no such file or folder")
    if path.is_file() and path.suffix in MEMORY_SUFFIXES:
        memories.append(path)
        with open_store(path) as store:
            return list(store.required())
    if path.is_file() and path.suffix == ".json" and path.name not in RECORD_FILES:
        return [_from_json(path, eyes)]
    if path.name in RECORD_FILES or _is_run(path):
        found = demonstration_from(read_record(path), forestall.__version__)
        if found is None:
            raise InputError(
                f"{path} is no demonstration: only a finished run becomes one that succeeded "
                "without a new plan, a refusal or a failure on the way"
            )
        return [found]
    if path.is_dir():
        return [
            d
            for inside in sorted(path.iterdir())
            if _shows(inside)
            for d in _from_path(inside, eyes, memories)
        ]
    known = ", ".join((".json", *MEMORY_SUFFIXES))
    raise FileFormatError(f"{path} shows no demonstration: files may be {known}")


def _shows(path: Path) -> bool:
    """Whether something in a folder is meant to be read."""
    return _is_run(path) if path.is_dir() else path.suffix in (".json", *MEMORY_SUFFIXES)


def _is_run(path: Path) -> bool:
    return any((path / name).is_file() for name in RECORD_FILES)


def _from_json(path: Path, eyes: Eyes | None) -> Demonstration:
    data = read_json(path, "demonstration")
    try:
        if isinstance(data, dict) and "steps" in data:
            return _identified(written(data, path.parent, eyes))
        if isinstance(data, dict) and data.get("subtask"):
            graph = scene_graph(data)
            assert graph.subtask is not None, "its text is not empty"
            steps = [{"subtask": str(graph.subtask), "scene": graph}]
            return _identified(written({"steps": steps}))
        raise InputError("neither a demonstration with 'steps' nor a graph with its 'subtask'")
    except ForestallError as error:
        raise FileFormatError(f"{path}: {error}") from error


def _is_folder(given: Any, folder: Path | None) -> bool:
    return isinstance(given, str) and folder is not None and (folder / given).is_dir()


def _is_pair(step: Any) -> bool:
    return (
        isinstance(step, Sequence)
        and not isinstance(step, str)
        and len(step) == _PAIR
        and isinstance(step[0], str | Subtask)
    )


def _is_steps(source: Source) -> bool:
    return isinstance(source, Sequence) and bool(source) and _is_pair(source[0])


def _pair(number: int, step: Any) -> tuple[Subtask, Any]:
    if isinstance(step, Mapping) and {"subtask", "scene"} == step.keys():
        step = (step["subtask"], step["scene"])
    if not _is_pair(step):
        raise InputError(f"step {number}: a subtask and its scene are expected, not {_said(step)}")
    said, scene = step
    try:
        return (Subtask.parse(said) if isinstance(said, str) else said), scene
    except InputError as error:
        raise InputError(f"step {number}: {error}") from error


def _scene(given: Any, folder: Path | None, eyes: Eyes | None) -> SceneGraph:
    if isinstance(given, str):
        if folder is None:
            raise InputError(f"the scene {given!r} is a name: give the scene itself")
        if not (folder / given).is_dir():
            return scene_graph(read_json(inside(folder, given), "scene"))
        given = inside(folder, f"{given}/{OBSERVATION_FILE}").parent
    if not isinstance(given, Path) and not is_picture(given):
        return scene_graph(given)
    if eyes is None:
        raise InputError("a picture needs a domain to be seen in: give one, or a scene graph")
    return eyes.see(given)


def _step(
    index: int, subtask: Subtask, graph: SceneGraph, eyes: Eyes | None = None
) -> DemonstrationStep:
    """A step whose arguments are the graph's own nodes, where a name can mean one only.

    Of what was seen the monitor's own rules say which one is meant.
    """
    whole, names = replace(graph, subtask=None), []
    if eyes is not None:
        ground, scoped = eyes.step(subtask, graph)
        return DemonstrationStep(index, ground, scoped, whole)
    for name in subtask.args:
        fitting = graph.matches(name)
        if len(fitting) > 1 and not is_instance(name):
            raise InputError(f"{name!r} of {subtask} can be {' or '.join(fitting)}: name one")
        names.append(fitting[0] if fitting else name)
    ground = replace(subtask, args=tuple(names))
    return DemonstrationStep(index, ground, replace(graph, subtask=ground), whole)


def _named(found: Iterable[Demonstration]) -> list[Demonstration]:
    """With ids, which those lack that somebody wrote in Python, and which are told apart by number.

    Of those that have the same id and the same content there is one.
    """
    used: dict[str, Demonstration] = {}
    for d in found:
        name = d.id or _content_name(d)
        number, own = 1, name
        while own in used and not (d.id and _same(used[own], d)):
            number += 1
            own = f"{name}-{number}"
        used.setdefault(own, replace(d, id=own))
    return list(used.values())


def _identified(d: Demonstration) -> Demonstration:
    """With the id of its content: a file says the same however often it is read."""
    return replace(d, id=_content_name(d))


def _content_name(d: Demonstration) -> str:
    return f"{d.task or 'written'}-{encode(d).digest[:12]}"


def _same(one: Demonstration, other: Demonstration) -> bool:
    return encode(one).digest == encode(other).digest


def _said(source: Source) -> str:
    if isinstance(source, list | tuple) and all(isinstance(s, str | Path) for s in source):
        return ", ".join(map(str, source)) or "an empty list"
    text = str(source) if isinstance(source, str | Path) else type(source).__name__
    return repr(text) if isinstance(source, str) else text
