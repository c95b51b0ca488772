"""The package's evolving graph, which executes programs and says which step fails and why.

Called by the importer and the world; calls the package `virtualhome`, of which the evolving graph
alone is loaded: the package itself starts a simulator when it is imported.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from forestall.errors import InputError
from forestall.worlds.virtualhome.packages import Flat, Line

_NAME = "_forestall_evolving_graph"
_PARTS = ("environment", "execution", "scripts")


class Evolving:
    """A household that changes as a program is executed.

    Args:
        package: folder of the evolving graph.
        start: how it begins.
    """

    def __init__(self, package: Path, start: Flat) -> None:
        parts = _loaded(str(package))
        self._environment, self._execution, self._scripts = parts
        graph = self._environment.EnvironmentGraph(start.plain())
        self._state = self._environment.EnvironmentState(graph, {}, instance_selection=True)
        self.character = start.character
        self._relations = self._environment.Relation

    def act(self, line: Line) -> str | None:
        """Execute a step: None where it is done, otherwise why not, and nothing has changed."""
        try:
            action = self._scripts.Action[line.verb]
        except KeyError:
            return f"{line.verb} is no action of the evolving graph"
        if len(line.things) != action.value[1]:
            return f"{line.verb} takes {action.value[1]} argument(s), not {len(line.things)}"
        for _, node in line.things:
            if self._state.get_node(node) is None:
                return f"there is no thing {node}"
        things = [self._scripts.ScriptObject(name, node) for name, node in line.things]
        script = self._scripts.Script([self._scripts.ScriptLine(action, things, 1)])
        info = self._execution.ExecutionInfo()
        call = self._execution.ScriptExecutor.call_action_method
        try:
            after = next(iter(call(script, self._state, info, 0) or ()), None)
        except Exception as error:  # noqa: BLE001 - somebody else's code, which breaks on some steps
            return f"the evolving graph cannot: {type(error).__name__}: {error}"
        if after is None:
            return str(info.messages[-1]) if info.messages else "refused without a reason"
        self._state = after
        return None

    def states(self, node: int) -> frozenset[str]:
        """Names of the states of a thing."""
        return frozenset(s.name for s in self._state.get_node(node).states)

    def properties(self, node: int) -> frozenset[str]:
        """Names of what a thing is good for."""
        return frozenset(p.name for p in self._state.get_node(node).properties)

    def name(self, node: int) -> str:
        """The class name of a thing."""
        return str(self._state.get_node(node).class_name)

    def is_room(self, node: int) -> bool:
        """Whether it is a room."""
        return bool(self._state.get_node(node).category == "Rooms")

    def to(self, node: int, *relations: str) -> frozenset[int]:
        """Where the edges of a thing lead to."""
        found: set[int] = set()
        for r in relations:
            found.update(self._state.get_node_ids_from(node, self._relations[r]))
        return frozenset(found)

    def all_ids(self) -> list[int]:
        """Node ids of everything that is there."""
        return sorted(n.id for n in self._state.get_nodes())

    def near(self, node: int) -> bool:
        """Whether the character is close to a thing, as the executor judges it."""
        found = self._execution._is_character_close_to
        return bool(found(self._state, self._state.get_node(node), 0))

    def faced(self, node: int) -> bool:
        """Whether the character faces a thing, as the executor judges it."""
        found = self._execution._is_character_face_to
        return bool(found(self._state, self._state.get_node(node), 0))


@cache
def _loaded(folder: str) -> tuple[ModuleType, ...]:
    """The modules of the evolving graph, under a name of our own.

    Raises:
        InputError: they cannot be loaded.
    """
    place = Path(folder) / "__init__.py"
    if not place.is_file():
        raise InputError(f"{folder}: the evolving graph of the package virtualhome is not there")
    spec = spec_from_file_location(_NAME, place, submodule_search_locations=[folder])
    if spec is None:
        raise InputError(f"{folder}: the evolving graph cannot be loaded")
    sys.modules[_NAME] = module_from_spec(spec)  # its own __init__ draws in more than is needed
    try:
        parts = tuple(import_module(f"{_NAME}.{part}") for part in _PARTS)
    except Exception as error:  # somebody else's modules run while they are imported
        raise InputError(f"{folder}: the evolving graph cannot be loaded: {error}") from error
    parts[1].JoinedExecutor.execute = _joined
    return parts


def _joined(
    self: Any,
    script: Any,
    state: Any,
    info: Any,
    who: int,
    modify: bool = True,
    in_place: bool = False,
) -> Iterator[Any]:
    """`JoinedExecutor.execute`, which in 2.3.0 takes fewer arguments than it is given."""
    for executor in self.executors:
        yield from executor.execute(script, state, info, who, modify, in_place)
