"""Programs as plans: every step a skill of the domain, whoever acts its first argument.

Called by the importer and the world; calls nothing but `packages`.
"""

from __future__ import annotations

from collections.abc import Mapping

from forestall.errors import UnknownNameError
from forestall.types.plan import Plan, Subtask
from forestall.worlds.virtualhome.packages import Flat, Line, Program
from forestall.worlds.virtualhome.seen import name_of

SKILLS: Mapping[str, str] = {
    "CLOSE": "close", "CUT": "cut", "DRINK": "drink", "DROP": "drop", "EAT": "eat",
    "FIND": "find", "GRAB": "grab", "GREET": "greet", "LIE": "lie", "LOOKAT": "look_at",
    "MOVE": "move", "OPEN": "open", "PLUGIN": "plug_in", "PLUGOUT": "plug_out",
    "POINTAT": "look_at", "POUR": "pour", "PULL": "move", "PUSH": "move",
    "PUTBACK": "put_on", "PUTIN": "put_inside", "PUTOBJBACK": "put_back", "PUTOFF": "take_off",
    "PUTON": "put_on_character", "READ": "read", "RELEASE": "drop", "RINSE": "wash",
    "RUN": "walk_towards", "SCRUB": "wash", "SIT": "sit", "SLEEP": "sleep",
    "SQUEEZE": "squeeze", "STANDUP": "standup", "SWITCHOFF": "switch_off",
    "SWITCHON": "switch_on", "TOUCH": "touch", "TURNTO": "turn_to", "TYPE": "type",
    "WAKEUP": "wake_up", "WALK": "walk_towards", "WASH": "wash", "WATCH": "watch", "WIPE": "wipe",
}  # fmt: skip
"""Verb of a program → skill of the domain; who walks to a room walks into it."""

_INTO = {"walk_towards": "walk_into"}


def subtask(line: Line, flat: Flat) -> Subtask:
    """A step of a program as a subtask.

    Raises:
        UnknownNameError: no such verb.
    """
    if line.verb not in SKILLS:
        raise UnknownNameError("verb of a program", line.verb, SKILLS)
    skill = SKILLS[line.verb]
    if skill in _INTO and flat.nodes[line.things[0][1]].category == "Rooms":
        skill = _INTO[skill]
    things = [name_of(flat.nodes[n].name, n) for _, n in line.things]
    return Subtask(skill, (name_of(flat.nodes[flat.character].name, flat.character), *things))


def plan(program: Program, flat: Flat) -> Plan:
    """A program as a plan.

    Raises:
        UnknownNameError: a verb that no skill stands for.
    """
    return Plan(tuple(subtask(line, flat) for line in program.lines), program.task)
