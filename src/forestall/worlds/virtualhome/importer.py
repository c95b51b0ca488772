"""Programs with their start graphs as runs: executed step by step, a scene before each.

Called by `household`; calls `evolving` and `seen`.
"""

from __future__ import annotations

from collections.abc import Iterable

from forestall.types.foreign import ForeignRun
from forestall.types.graph import SceneGraph
from forestall.worlds.virtualhome.evolving import Evolving
from forestall.worlds.virtualhome.packages import Flat, Packages, Program
from forestall.worlds.virtualhome.plans import plan
from forestall.worlds.virtualhome.seen import scene


def carried_out(
    packages: Packages,
    program: Program,
    start: Flat,
    *,
    about: Iterable[int] = (),
    name: str = "",
    change: str = "",
) -> ForeignRun:
    """Execute a program as far as it goes.

    Args:
        packages: who executes it.
        program: its steps.
        start: how the household begins.
        about: node ids that matter beside those that the program names.
        name: of the run; that of the program by default.
        change: what was changed about it.
    """
    flat = Evolving(packages.evolving_graph, start)
    concerned = program.ids | set(about)
    scenes: list[SceneGraph] = []
    why = None
    for line in program.lines:
        scenes.append(scene(flat, concerned))
        why = flat.act(line)
        if why is not None:
            break
    return ForeignRun(
        name or program.name,
        program.name,
        program.task,
        plan(program, start),
        tuple(scenes),
        scene(flat, concerned) if why is None else None,
        change,
        why or "",
    )
