"""The skills of the robot: what each needs, what it does, and why it refuses.

`perform` looks a verb up in one table, resolves its names (`naming`), lets the skill change the
household and returns the outcome; the environment then lets the automatic effects settle
(`effects`). A refusal names the object and the unmet need and changes nothing but the robot's own
position. Every manipulation skill first drives to its target when that is out of reach. What a
category is good for is read from the catalogue.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature

from forestall.errors import SceneError
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.plan import Subtask
from forestall.worlds.kitchen import effects
from forestall.worlds.kitchen.actor import Robot
from forestall.worlds.kitchen.household import FLOOR, number_of
from forestall.worlds.kitchen.motions import FailureError
from forestall.worlds.kitchen.naming import (
    RefusalError,
    resolve_receptacle,
    resolve_settled,
    resolve_thing,
    why_no_room,
)

KNIFE = "Knife"
"""Category that slicing needs in the hand."""


def perform(robot: Robot, subtask: Subtask) -> SkillOutcome:
    """Run one skill on the household; what cannot be done is refused and never raised."""
    start_s = robot.household.time_s
    try:
        reason = _skill_of(subtask)(robot, *subtask.args)
        status = SkillStatus.SUCCEEDED
    except FailureError as failure:
        reason, status = str(failure), SkillStatus.FAILED
    except (RefusalError, SceneError) as refusal:
        reason, status = str(refusal), SkillStatus.REFUSED
    held = robot.household.held
    if held is not None and robot.believed is not None:
        reason = reason.replace(held, robot.believed)
    return SkillOutcome(status, robot.household.time_s - start_s, reason)


def _skill_of(subtask: Subtask) -> Callable[..., str]:
    """What carries a subtask out; one that this robot cannot read is refused."""
    skill = SKILL_TABLE.get(subtask.skill)
    if skill is None:
        raise RefusalError(f"this robot has no skill {subtask.skill!r}")
    takes = len(signature(skill).parameters) - 1
    if len(subtask.args) != takes:
        raise RefusalError(f"{subtask.skill} takes {takes} argument(s), got {len(subtask.args)}")
    return skill


def navigate_to_obj(robot: Robot, target: str) -> str:
    """Drive to a thing and face it; with something in the hand to where that can be put."""
    home = robot.household
    if home.held is not None and home.is_any_support(target):
        name = resolve_receptacle(home, target, home.held)
    else:
        name = resolve_thing(home, target)
    if name == robot.household.held:
        return f"{name} is in the gripper"
    robot.motions.set_out(robot, name)
    robot.drive(name)
    return ""


def pick_up(robot: Robot, what: str) -> str:
    """Needs an empty gripper and a thing that can be carried, is accessible and unblocked."""
    home = robot.household
    if home.held is not None:
        raise RefusalError(f"the gripper is not empty: it holds {home.held}")
    name = resolve_thing(home, what)
    if not home.category(name).pickupable:
        raise RefusalError(f"{name} cannot be picked up")
    robot.need_accessible(name)
    facing = robot.focus
    robot.approach(name)
    blocker = home.blocker(name)
    if blocker is not None:
        raise RefusalError(f"{name} cannot be grasped: {blocker} stands in front of it")
    in_reach = facing is not None and home.exists(facing) and home.world.within_reach(facing)
    robot.focus = facing if in_reach and facing != name else home.parent(name)
    robot.motions.take(robot, name)
    return robot.done(robot.times.pick_s)


def put(robot: Robot, what: str, target: str) -> str:
    """Needs the thing in the gripper and a receptacle that takes it, has room and is open."""
    home = robot.household
    name = robot.carried(what)
    if name != home.held:
        settled = resolve_settled(home, what, target)
        if settled is not None:
            return f"{settled} is already there"
        raise RefusalError(f"{name} is not in the gripper")
    place = resolve_receptacle(home, target, name)
    _need_takes(robot, name, place)
    robot.approach(place)
    full = why_no_room(home, name, place)
    if full is not None:
        raise RefusalError(full)
    robot.motions.release(robot, name, place)
    return robot.done(robot.times.put_s)


def _need_takes(robot: Robot, name: str, place: str) -> None:
    home = robot.household
    if home.category(place).receptacle is None:
        raise RefusalError(f"nothing can be put on or into {place}")
    if name in home.ancestors(place):
        raise RefusalError(f"{name} cannot be put into itself")
    if not home.catalogue.accepts(place, name):
        raise RefusalError(f"{place} does not take {name}")
    robot.need_accessible(place)
    if home.is_shut(place):
        raise RefusalError(f"{place} is closed")
    device = home.category(place).device
    if device is not None and device.shut_while_on and home.state(place, "toggled") == "on":
        raise RefusalError(f"{place} takes nothing while it is on")


def open_obj(robot: Robot, target: str) -> str:
    """Needs a thing that opens and, if it works closed only, is off."""
    name = _openable(robot, target, "opened")
    home = robot.household
    if home.state(name, "open") == "open" and not home.is_ajar(name):
        return f"{name} is already open"
    device = home.category(name).device
    if device is not None and device.needs_closed and home.state(name, "toggled") == "on":
        raise RefusalError(f"{name} does not open while it is on")
    robot.motions.swing(robot, name, "open")
    return robot.done(robot.times.open_s)


def close_obj(robot: Robot, target: str) -> str:
    """Needs a thing that opens."""
    name = _openable(robot, target, "closed")
    home = robot.household
    if home.state(name, "open") == "closed" and not home.is_ajar(name):
        return f"{name} is already closed"
    robot.motions.swing(robot, name, "closed")
    return robot.done(robot.times.open_s)


def _openable(robot: Robot, target: str, what: str) -> str:
    name = resolve_thing(robot.household, target)
    if robot.household.state(name, "open") is None:
        raise RefusalError(f"{name} cannot be {what}")
    robot.need_accessible(name)
    robot.approach(name)
    return name


def toggle_on(robot: Robot, target: str) -> str:
    """Needs what the device needs: something held, or its door closed."""
    name = _switchable(robot, target, "on")
    home = robot.household
    turned = home.law.wired(name)
    if home.state(turned, "toggled") == "on":
        return f"{name} is already on"
    device = home.category(name).device
    if device is not None and device.needs_held is not None:
        held = home.held
        if held is None or home.category(held).name != device.needs_held:
            words = home.category(device.needs_held).spoken
            raise RefusalError(f"{name} is turned on with the {words}, which is not in the gripper")
    if device is not None and device.needs_closed and home.state(name, "open") == "open":
        raise RefusalError(f"{name} cannot be turned on while it is open")
    robot.motions.switch(robot, turned, "on")
    return robot.done(robot.times.toggle_s)


def toggle_off(robot: Robot, target: str) -> str:
    """Needs a thing that can be switched."""
    name = _switchable(robot, target, "off")
    home = robot.household
    turned = home.law.wired(name)
    if home.state(turned, "toggled") == "off":
        return f"{name} is already off"
    robot.motions.switch(robot, turned, "off")
    return robot.done(robot.times.toggle_s)


def _switchable(robot: Robot, target: str, what: str) -> str:
    """The thing that is switched: for a knob what it controls."""
    home = robot.household
    reached = name = resolve_thing(home, target)
    controls = home.category(name).controls
    if controls is not None:
        name = f"{controls}-{number_of(name)}"
        if not home.exists(name):
            raise RefusalError(f"{reached} controls nothing that is here")
    if home.state(name, "toggled") is None:
        raise RefusalError(f"{name} cannot be turned {what}")
    robot.need_accessible(reached)
    robot.approach(reached)
    return name


def slice_obj(robot: Robot, what: str) -> str:
    """Needs a knife in the gripper and a thing that can be sliced, accessible and in reach."""
    home = robot.household
    name = resolve_thing(home, what)
    category = home.category(name)
    if category.slices_into is None:
        raise RefusalError(f"{name} cannot be sliced")
    if home.held is None or home.category(home.held).name != KNIFE:
        holding = "is empty" if home.held is None else f"holds {home.held}"
        raise RefusalError(f"{name} cannot be sliced without a knife: the gripper {holding}")
    robot.need_accessible(name)
    robot.approach(name)
    robot.motions.cut(robot, name)
    _refocus(robot, name)
    for piece in home.replace(name, category.slices_into, category.slices, "sliced"):
        parent = home.parent(piece)
        if parent is not None:
            effects.arrived(home, piece, parent)
    return robot.done(robot.times.slice_s)


def crack_obj(robot: Robot, what: str) -> str:
    """Needs an egg that is held or within reach; a held one lands in what the robot faces."""
    home = robot.household
    name = robot.carried(what)
    category = home.category(name)
    if category.cracks_into is None:
        raise RefusalError(f"{name} cannot be cracked")
    if name == home.held:
        place = _under_the_hand(robot, name, category.cracks_into)
        if place is None:
            raise RefusalError(f"there is no room for what is in {name}")
        home.put(name, robot.motions.crack(robot, name, place) or place)
    else:
        robot.need_accessible(name)
        robot.approach(name)
        robot.motions.crack(robot, name, None)
    _refocus(robot, name)
    for cracked in home.replace(name, category.cracks_into, 1, "cracked"):
        parent = home.parent(cracked)
        if parent is not None:
            effects.arrived(home, cracked, parent)
    return robot.done(robot.times.crack_s)


def _refocus(robot: Robot, vanishing: str) -> None:
    if robot.focus == vanishing:
        robot.focus = robot.household.parent(vanishing)


def _under_the_hand(robot: Robot, held: str, becomes: str) -> str | None:
    """Where something let go of lands.

    In the vessel that stands on what the robot faces (on a burner, say), in what it faces, on the
    support of that, else on the floor; wherever there is room.
    """
    home = robot.household
    focus = robot.focus
    candidates: list[str] = []
    if focus is not None and home.exists(focus) and home.world.within_reach(focus):
        kind = home.category(focus).receptacle
        on_it = home.contents(focus) if kind is not None and kind.capacity is not None else []
        candidates = [*on_it, focus, *home.ancestors(focus)]
    for place in [*candidates, *home.of_category(FLOOR)]:
        if (
            home.catalogue.accepts(place, becomes)
            and home.closed_around(place) is None
            and not home.is_shut(place)
            and why_no_room(home, held, place) is None
        ):
            return place
    return None


def pour(robot: Robot, what: str, target: str) -> str:
    """Needs a held vessel with liquid and something that takes or drains it."""
    home = robot.household
    name = robot.carried(what)
    if name != home.held:
        raise RefusalError(f"{name} is not in the gripper")
    liquid = home.state(name, "filled")
    if liquid is None:
        raise RefusalError(f"{name} holds no liquid that could be poured")
    if liquid == "empty":
        raise RefusalError(f"{name} is empty")
    place = resolve_thing(home, target, other_than=name)
    drains, takes = home.category(place).drains, home.state(place, "filled")
    if not drains and takes is None:
        raise RefusalError(f"nothing can be poured into {place}")
    robot.need_accessible(place)
    robot.approach(place)
    robot.motions.pour(robot, name, place)
    return robot.done(robot.times.pour_s)


SKILL_TABLE: dict[str, Callable[..., str]] = {
    "navigate_to_obj": navigate_to_obj,
    "pick_up": pick_up,
    "put_on": put,
    "put_in": put,
    "open_obj": open_obj,
    "close_obj": close_obj,
    "toggle_on": toggle_on,
    "toggle_off": toggle_off,
    "slice_obj": slice_obj,
    "crack_obj": crack_obj,
    "pour": pour,
}
"""Verb → what carries it out."""
