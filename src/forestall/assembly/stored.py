"""Scenes that are given as files: observation folders, scene graphs, and folders of either.

Called by `checking` and the command line; calls the reader of perception.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from forestall.domain.model import Domain
from forestall.domain.words import Names
from forestall.errors import FileFormatError, InputError, UnknownNameError
from forestall.perception.folder import OBSERVATION_FILE, read_observation
from forestall.perception.relations import DIRECTIONS
from forestall.reading.documents import read_json
from forestall.types.facts import category_of
from forestall.types.graph import ObjectNode, SceneGraph
from forestall.types.observation import Observation
from forestall.types.symbolic import scene_graph

GRAPH_SUFFIX = ".json"


@dataclass(frozen=True, slots=True, eq=False)
class Stored:
    """One scene as it was read.

    Args:
        path: of the folder or file.
        scene: pictures, or a graph.
        states: instance → attribute → value, as they were written down beside the pictures.
    """

    path: Path
    scene: Observation | SceneGraph
    states: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    @property
    def time_s(self) -> float:
        """Of the robot's clock, 0 where it is not told."""
        return self.scene.time_s if isinstance(self.scene, Observation) else 0.0


def scenes_in(paths: Iterable[Path], of_plan: bool = False) -> list[Path]:
    """Every scene in order: those that are named, and the numbered ones in a folder that is named.

    Args:
        paths: of scenes and folders of scenes.
        of_plan: each is of the next step of a plan, so that none may lack in a folder.

    Raises:
        FileFormatError: a folder that is no observation and holds none; no clear order; something
            with a number that is no scene; or, of a plan, a number that no scene has.
    """
    found: list[Path] = []
    for path in paths:
        if path.name == OBSERVATION_FILE:
            found.append(path.parent)
        elif path.is_dir() and not (path / OBSERVATION_FILE).is_file():
            numbers = _numbered(path)
            if of_plan:
                _whole(path, numbers, begins=not found)
            found += [numbers[n] for n in sorted(numbers)]
        else:
            found.append(path)
    return found


def is_graph(path: Path) -> bool:
    """Whether a scene is a graph file and no observation folder."""
    return path.suffix == GRAPH_SUFFIX and not path.is_dir()


def read_scene(
    path: Path, domain: Domain, names: Names | None = None, learnt: bool = False
) -> Stored:
    """Read one scene; `names` are those of the scenes before it.

    A `learnt` domain has only the words that its demonstrations used: a graph may have others.

    Raises:
        FileFormatError: a file is missing, cannot be read as what it should be, or says of things
            what means nothing in the domain.
        ObservationError: what was seen cannot be.
    """
    if not is_graph(path):
        return Stored(path, *read_observation(path, domain, names=names))
    graph = read_graph(path)
    try:
        check_scene(graph, domain, learnt)
    except InputError as error:
        raise FileFormatError(f"{path}: {error}") from error
    return Stored(path, graph)


def read_graph(path: Path) -> SceneGraph:
    """A scene graph from a JSON file, whole or in the short form (`types.symbolic`).

    Raises:
        FileFormatError: it cannot be read, is no scene graph, or contradicts itself.
    """
    data = read_json(path, "scene graph")
    try:
        return scene_graph(data)
    except InputError as error:
        raise FileFormatError(f"{path}: {error}") from error


def _numbered(folder: Path) -> dict[int, Path]:
    """The scenes of a folder by the first number in their names."""
    shown = [p for p in sorted(folder.iterdir()) if not p.name.startswith(".")]
    entries = [p for p in shown if _may_be_scene(p)]
    if not entries:
        raise FileFormatError(
            f"{folder} holds no {OBSERVATION_FILE}, and no observation folders or graph files "
            f"with numbers in their names (01, 02, ... or step-1{GRAPH_SUFFIX}, ...)"
        )
    numbers: dict[int, Path] = {}
    for path in entries:
        number = _number(path)
        if number is None:
            raise FileFormatError(f"{path}: a number in its name must say when it comes")
        if number in numbers:
            raise FileFormatError(f"{path} has the same number as {numbers[number].name}")
        numbers[number] = path
    for path in shown:
        number = _number(path)
        if number is not None and number not in numbers:
            raise FileFormatError(
                f"{path} has a number and is no scene: a folder with {OBSERVATION_FILE} is one, "
                f"or a graph file (step-{number}{GRAPH_SUFFIX}); what is none goes elsewhere"
            )
    return numbers


def _number(path: Path) -> int | None:
    found = re.search(r"\d+", path.name if path.is_dir() else path.stem)
    return None if found is None else int(found[0])


def _whole(folder: Path, numbers: Mapping[int, Path], begins: bool) -> None:
    """See that no scene lacks: the ones behind it would be judged before other steps."""
    least, last = min(numbers), max(numbers)
    first = 1 if begins and least > 1 else least
    lacking = next((n for n in range(first, last) if n not in numbers), None)
    if lacking is not None:
        raise FileFormatError(
            f"{folder} has no scene with the number {lacking}: those before the steps of a plan "
            "are numbered 1, 2, 3, ... without a gap; or name the scenes one by one"
        )


def _may_be_scene(path: Path) -> bool:
    return (path / OBSERVATION_FILE).is_file() if path.is_dir() else is_graph(path)


def check_scene(graph: SceneGraph, domain: Domain, learnt: bool) -> None:
    """A category may be any; what is said of things must mean something in the domain."""
    within: TopologicalSorter[str] = TopologicalSorter()
    for relation in graph.relations:
        known = relation.predicate in domain.relations or relation.predicate in DIRECTIONS
        if not known and not learnt:
            raise UnknownNameError("relation", relation.predicate, domain.relations)
        if relation.predicate in domain.containing:
            within.add(relation.subject, relation.object)
    for node in graph.nodes:
        _check_category(node, domain)
        for attribute, value in () if learnt else node.states:
            if attribute not in domain.attributes:
                raise UnknownNameError(f"attribute of {node.id}", attribute, domain.attributes)
            if value is not None and value not in domain.values(attribute):
                raise UnknownNameError(f"{attribute} of {node.id}", value, domain.values(attribute))
    try:
        within.prepare()
    except CycleError as error:
        chain = ", ".join(dict.fromkeys(error.args[1]))
        raise InputError(f"{chain}: a thing cannot be in or on itself") from error


def _check_category(node: ObjectNode, domain: Domain) -> None:
    """What is a state or a relation of the domain, and no category, is none."""
    word = node.category
    if domain.find(word) is not None or word == category_of(node.id):
        return
    if word in domain.relations:
        raise InputError(
            f"{node.id} is said to be of the category {word!r}, which is a relation: write "
            f'["{node.id}", "{word}", ...] among the relations'
        )
    for attribute in domain.attributes.values():
        if word in attribute.values:
            raise InputError(
                f"{node.id} is said to be of the category {word!r}, which is a state: write "
                f'"{node.id}": {{"{attribute.name}": "{word}"}}'
            )
