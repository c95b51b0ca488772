"""One change each that may make a good program fail: a step that is missing, or another start.

Called by `household`, which keeps those of which the executor then refuses a step.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from forestall.worlds.virtualhome.packages import Flat, Program

DROPPED = ("OPEN", "GRAB", "WALK", "SWITCHOFF", "STANDUP", "CLOSE")


@dataclass(frozen=True, slots=True)
class Changed:
    """A program and a start of which one differs from the good run.

    Args:
        sort: of the change.
        where: the step or the thing that it is about.
        program: the steps.
        start: how the household begins.
        about: node ids that matter beside those of the program.
    """

    sort: str
    where: str
    program: Program
    start: Flat
    about: frozenset[int] = frozenset()


def changes(program: Program, start: Flat) -> Iterator[Changed]:
    """Every single change of a good program."""
    for number, line in enumerate(program.lines):
        if line.verb in DROPPED:
            rest = program.lines[:number] + program.lines[number + 1 :]
            if rest:
                dropped = replace(program, lines=rest)
                about = program.ids - dropped.ids
                yield Changed(f"no {line.verb}", f"step {number}", dropped, start, about)
    for node in _of(program, "OPEN"):
        other = start.stating(node, "OPEN", instead_of=("CLOSED",))
        yield Changed("open already", f"{node}", program, other)
    for node in _of(program, "SWITCHON"):
        on = start.stating(node, "ON", instead_of=("OFF",))
        yield Changed("on already", f"{node}", program, on)
        out = start.stating(node, "PLUGGED_OUT", instead_of=("PLUGGED_IN",))
        yield Changed("unplugged", f"{node}", program, out)
    yield from _shut_in(program, start)
    yield from _hands_full(program, start)
    me = start.character
    yield Changed("sitting", f"{me}", program, start.stating(me, "SITTING"))


def _of(program: Program, verb: str) -> list[int]:
    return list(dict.fromkeys(x.things[0][1] for x in program.lines if x.verb == verb))


def _shut_in(program: Program, start: Flat) -> Iterator[Changed]:
    opened = set(_of(program, "OPEN"))
    boxes = [
        n.id
        for n in sorted(start.nodes.values(), key=lambda n: n.id)
        if {"CAN_OPEN", "CONTAINERS"} <= n.properties and n.id not in opened | program.ids
    ]
    for node in _of(program, "GRAB"):
        if not boxes or node not in start.nodes:
            return
        box = boxes[0]
        rooms = {x for x in start.to(box, "INSIDE") if start.nodes[x].category == "Rooms"}
        lost = {
            (a, r, b)
            for a, r, b in start.edges
            if (a == node and r in ("ON", "INSIDE", "CLOSE")) or (b == node and r == "CLOSE")
        }
        added = {(node, "INSIDE", x) for x in (box, *rooms)}
        added |= {(node, "CLOSE", box), (box, "CLOSE", node)}
        shut = start.stating(box, "CLOSED", instead_of=("OPEN",)).linked(added, lost)
        yield Changed("shut in", f"{node}", program, shut, frozenset({box}))


def _hands_full(program: Program, start: Flat) -> Iterator[Changed]:
    free = [
        n.id
        for n in sorted(start.nodes.values(), key=lambda n: n.id)
        if "GRABBABLE" in n.properties and n.id not in program.ids
    ]
    if len(free) < 2:
        return
    me, held = start.character, free[:2]
    lost = {
        (a, r, b)
        for a, r, b in start.edges
        if (a in held and r in ("ON", "INSIDE", "CLOSE")) or (b in held and r == "CLOSE")
    }
    room = {x for x in start.to(me, "INSIDE") if start.nodes[x].category == "Rooms"}
    added = {(me, r, n) for r, n in zip(("HOLDS_RH", "HOLDS_LH"), held, strict=True)}
    added |= {e for n in held for e in ((me, "CLOSE", n), (n, "CLOSE", me))}
    added |= {(n, "INSIDE", x) for n in held for x in room}
    yield Changed("hands full", ", ".join(map(str, held)), program, start.linked(added, lost))
