"""Where the two packages keep what is read here, and programs and start graphs out of their files.

Called by `households` and the importer. Nothing of the packages is imported by its name: importing
them starts a simulator or pulls in what nobody needs here. `virtualhome` holds the evolving graph,
which executes programs; `eai-eval` the programs with their start graphs, and a PDDL domain.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path

from forestall.errors import FileFormatError, InputError
from forestall.reading.documents import read_json
from forestall.reading.fields import Field
from forestall.reading.files import read_text

HOW = "pip install --no-deps --target FOLDER eai-eval==1.0.5 virtualhome==2.3.0 and give the folder"
_DATA, _ENGINE = "virtualhome_eval", "virtualhome"
_SET = "dataset/programs_processed_precond_nograb_morepreconds"
_PDDL = "resources/virtualhome/virtualhome.pddl"
_STEP = re.compile(r"\[(\w+)\]((?:\s*<[^<>]+>\s*\([\d.]+\))*)")
_THING = re.compile(r"<([^<>]+)>\s*\((?:\d+\.)?(\d+)\)")

CHARACTER = "character"
ROOMS = "Rooms"


@dataclass(frozen=True, slots=True)
class Line:
    """One step of a program: "[PUTIN] <food_food> (1.1000) <freezer> (1.289)".

    Args:
        verb: as the program writes it.
        things: (class name, node id) of each argument.
    """

    verb: str
    things: tuple[tuple[str, int], ...] = ()

    def __str__(self) -> str:
        return " ".join([f"[{self.verb}]", *(f"<{name}> ({n})" for name, n in self.things)])


@dataclass(frozen=True, slots=True)
class Program:
    """One program.

    Args:
        name: of its file, without the ending.
        task: its first line.
        lines: its steps.
        graphs: file of its start and final graph.
    """

    name: str
    task: str
    lines: tuple[Line, ...]
    graphs: Path

    @property
    def ids(self) -> frozenset[int]:
        """Node ids of everything that it names."""
        return frozenset(n for line in self.lines for _, n in line.things)


@dataclass(frozen=True, slots=True)
class Node:
    """A thing of a start graph."""

    id: int
    name: str
    category: str
    properties: frozenset[str]
    states: frozenset[str]


@dataclass(frozen=True)
class Flat:
    """A start graph: things, and (from, relation, to) between them."""

    nodes: Mapping[int, Node]
    edges: frozenset[tuple[int, str, int]]

    @cached_property
    def character(self) -> int:
        """Id of who acts.

        Raises:
            FileFormatError: there is nobody.
        """
        found = sorted(n.id for n in self.nodes.values() if n.name == CHARACTER)
        if not found:
            raise FileFormatError(f"the graph has nobody who acts: a node called {CHARACTER}")
        return found[0]

    def to(self, start: int, *relations: str) -> frozenset[int]:
        """Where the edges of some relations lead to."""
        return frozenset(b for a, r, b in self.edges if a == start and r in relations)

    def stating(self, node: int, *states: str, instead_of: tuple[str, ...] = ()) -> Flat:
        """The same with other states of one thing."""
        old = self.nodes[node]
        new = replace(old, states=(old.states - set(instead_of)) | set(states))
        return Flat({**self.nodes, node: new}, self.edges)

    def linked(self, added: set[tuple[int, str, int]], lost: set[tuple[int, str, int]]) -> Flat:
        """The same with other edges."""
        return Flat(self.nodes, (self.edges - lost) | added)

    def plain(self) -> dict[str, object]:
        """As the packages write it."""
        return {
            "nodes": [
                {
                    "id": n.id,
                    "class_name": n.name,
                    "category": n.category,
                    "properties": sorted(n.properties),
                    "states": sorted(n.states),
                    "prefab_name": None,
                    "bounding_box": None,
                }
                for n in self.nodes.values()
            ],
            "edges": [
                {"from_id": a, "relation_type": r, "to_id": b} for a, r, b in sorted(self.edges)
            ],
        }


@dataclass(frozen=True, slots=True)
class Packages:
    """The folders in which the two packages lie.

    Args:
        data: of `virtualhome_eval`.
        engine: of `virtualhome`.
    """

    data: Path
    engine: Path

    @classmethod
    def found(cls, folder: Path | None = None) -> Packages:
        """In a folder, or where Python finds them.

        Raises:
            InputError: one of them is not there; says how to get it.
        """
        places = [_place(name, folder) for name in (_DATA, _ENGINE)]
        return cls(places[0], places[1])

    @property
    def pddl(self) -> Path:
        """The PDDL domain."""
        return self.data / _PDDL

    @property
    def evolving_graph(self) -> Path:
        """The package that executes programs."""
        return self.engine / "simulation" / "evolving_graph"

    def programs(self) -> list[Program]:
        """Every program with its graphs, by file name.

        Raises:
            InputError: there is none.
            FileFormatError: a program cannot be read.
        """
        files = sorted((self.data / _SET / "executable_programs").glob("*/*/*.txt"))
        if not files:
            raise InputError(f"{self.data / _SET}: no program is there; {HOW}")
        graphs = self.data / _SET / "init_and_final_graphs"
        return [
            read_program(f, graphs / f.parent.parent.name / f.parent.name / f"{f.stem}.json")
            for f in files
        ]


def _place(name: str, folder: Path | None) -> Path:
    if folder is not None:
        place = folder / name
    else:
        spec = find_spec(name)
        several = list(spec.submodule_search_locations or ()) if spec is not None else []
        if not several:
            raise InputError(f"the package {name} is not installed: {HOW}")
        place = Path(several[0])
    if not place.is_dir():
        raise InputError(f"{place}: the package {name} is not there; {HOW}")
    return place


def read_program(path: Path, graphs: Path) -> Program:
    """A program out of its file: the task, a description, and a step a line.

    Raises:
        FileFormatError: no task, no step, or a line that is none.
    """
    lines = [x.strip() for x in read_text(path, "program").splitlines()]
    task = next((x for x in lines if x), "")
    steps = [(number, x) for number, x in enumerate(lines, 1) if x.startswith("[")]
    if not task or task.startswith("[") or not steps:
        raise FileFormatError(f"{path}: a program is a line with its task, then steps [VERB] ...")
    return Program(path.stem, task, tuple(_line(path, n, x) for n, x in steps), graphs)


def _line(path: Path, number: int, text: str) -> Line:
    match = _STEP.fullmatch(text)
    if match is None:
        raise FileFormatError(
            f"{path}, line {number}: {text!r} is no step: write [VERB] <name> (1.id)"
        )
    things = tuple((name.strip(), int(n)) for name, n in _THING.findall(match[2]))
    return Line(match[1].upper(), things)


def read_start(path: Path) -> Flat:
    """The start graph out of a file of graphs.

    Raises:
        FileFormatError: something of it is missing, or an edge leads nowhere.
    """
    graph = Field(read_json(path, "start graph"), str(path))["init_graph"]
    nodes = {n.id: n for n in graph["nodes"].tuple_of(_node)}
    edges = _edges(graph["edges"])
    for a, r, b in edges:
        if a not in nodes or b not in nodes:
            raise FileFormatError(f"{path}: the edge {a} {r} {b} leads to no node")
    return Flat(nodes, edges)


def _node(field: Field) -> Node:
    return Node(
        field["id"].whole(),
        field["class_name"].name(),
        field["category"].name(),
        frozenset(x.name() for x in field["properties"].items()),
        frozenset(x.name() for x in field["states"].items()),
    )


_EDGE = {"from_id": int, "relation_type": str, "to_id": int}


def _edges(field: Field) -> frozenset[tuple[int, str, int]]:
    """The edges, thousands in a graph: without a `Field` for each."""
    if not isinstance(field.value, list):
        field.fail("a list")
    found: list[tuple[int, str, int]] = []
    for number, edge in enumerate(field.value):
        if not isinstance(edge, dict) or any(type(edge.get(k)) is not t for k, t in _EDGE.items()):
            raise FileFormatError(
                f"{field.place}[{number}]: an edge has {', '.join(_EDGE)}, not {edge!r}"
            )
        found.append((edge["from_id"], edge["relation_type"], edge["to_id"]))
    return frozenset(found)
