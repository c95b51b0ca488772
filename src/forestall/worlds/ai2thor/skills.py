"""The skills of a household as actions of AI2-THOR, with what each is known to need besides.

What AI2-THOR judges itself (sight, doors, room, what goes where) is left to it, and its
errorMessage is the reason of the refusal. What it does not judge stands here: a knife to slice
with, the remote control for a television, one thing at a time in what takes one, no cracked egg in
the hand. Called by `world`; calls `driving`, `scene`, `link`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from forestall.types.facts import category_of, is_instance
from forestall.types.plan import Subtask
from forestall.worlds.ai2thor.driving import Base
from forestall.worlds.ai2thor.frames import box_from_thor
from forestall.worlds.ai2thor.link import Link
from forestall.worlds.ai2thor.naming import type_of
from forestall.worlds.ai2thor.scene import Scene

CAPACITY: Mapping[str, int] = {
    "CoffeeMachine": 1, "Microwave": 1, "Plate": 1, "StoveBurner": 1, "Toaster": 1,
}  # fmt: skip
"""How many things at most stand directly in or on one of these."""

NEVER_HELD = ("EggCracked",)
"""What AI2-THOR would let the hand take and no hand can."""

KNIVES = ("Knife", "ButterKnife")


class RefusalError(Exception):
    """A need that is not met; the text is the reason."""


class Agent:
    """Acts in one scene.

    Args:
        link: to the build.
        base: where the agent stands.
        scene: what is true now.
        canonical: a domain's name of a category, for any name of it.
    """

    def __init__(
        self, link: Link, base: Base, scene: Callable[[], Scene], canonical: Callable[[str], str]
    ) -> None:
        self._link, self._base, self._scene = link, base, scene
        self._canonical = canonical
        self.focus: str | None = None
        self.driven_s = 0.0
        self.go_on: Callable[[], None] = lambda: None
        """Called before every action; raises where the robot was told to hold."""

    # --- skills ----------------------------------------------------------------------------------

    def perform(self, subtask: Subtask) -> None:
        """Carry a subtask out.

        Raises:
            RefusalError: a need is not met.
        """
        SKILLS[subtask.skill](self, *subtask.args)

    def navigate(self, target: str) -> None:
        """Stand before a thing."""
        name = self._find(target)
        self._approach(name, again=True)
        self.focus = name

    def pick_up(self, target: str) -> None:
        """Take a thing, with what is in or on it."""
        held = self._scene().held
        if held is not None:
            raise RefusalError(f"the gripper already holds {held}")
        name = self._find(target)
        if category_of(name) in NEVER_HELD:
            raise RefusalError(f"{name} cannot be picked up")
        place = self._scene().parent(name)
        self._approach(name)
        self._on(name, "PickupObject")
        self.focus = place or self.focus

    def put(self, target: str, place: str) -> None:
        """Put what is held somewhere."""
        thing = self._carried(target)
        where = self._place(place, thing)
        if thing in self._scene().ancestors(where) or thing == where:
            raise RefusalError(f"{where} is itself in or on {thing}")
        self._approach(where)
        self._put(thing, where)
        self.focus = where

    def open(self, target: str) -> None:
        """Open a door, a drawer, a lid."""
        self._door(target, "OpenObject", opened=True)

    def close(self, target: str) -> None:
        """Close it."""
        self._door(target, "CloseObject", opened=False)

    def toggle_on(self, target: str) -> None:
        """Turn a device on; a burner by its knob."""
        self._toggle(target, on=True)

    def toggle_off(self, target: str) -> None:
        """Turn it off."""
        self._toggle(target, on=False)

    def slice(self, target: str) -> None:
        """Slice a thing with a knife."""
        held = self._scene().held
        if held is None or category_of(held) not in KNIVES:
            raise RefusalError("no knife is in the gripper: slicing needs one")
        name = self._find(target)
        if type_of(self._scene().things[name]) == "Egg" or not self._is(name, "sliceable"):
            raise RefusalError(f"{name} cannot be sliced")
        self._approach(name)
        self._on(name, "SliceObject")

    def crack(self, target: str) -> None:
        """Crack an egg where it is; one that is held into what the robot stands at."""
        name = self._find(target)
        if type_of(self._scene().things[name]) != "Egg":
            raise RefusalError(f"{name} cannot be cracked")
        if name == self._scene().held:
            vessel = self._below_hand()
            if vessel is not None:
                self._put(name, vessel)
            else:
                self._step("DropHandObject", forceAction=True)
        else:
            self._approach(name)
        if name in self._scene():
            self._on(name, "BreakObject")

    def pour(self, target: str, place: str) -> None:
        """Pour what is in the held thing into another; what is full already keeps what it has."""
        thing = self._carried(target)
        liquid = self._scene().things[thing].get("fillLiquid")
        if not self._is(thing, "isFilledWithLiquid"):
            raise RefusalError(f"{thing} is empty")
        where = self._find(place)
        drains = where in self._scene().basins
        if not drains and not self._is(where, "canFillWithLiquid"):
            raise RefusalError(f"nothing can be poured from {thing} into {where}")
        if thing == where:
            raise RefusalError(f"{thing} cannot be poured into itself")
        self._approach(where)
        self._on(thing, "EmptyLiquidFromObject")
        if not drains and not self._is(where, "isFilledWithLiquid"):
            self._on(where, "FillObjectWithLiquid", fillLiquid=liquid)
        self.focus = where

    # --- what skills are made of ------------------------------------------------------------------

    def reach(self, name: str) -> None:
        """Stand where a thing can be handled.

        Raises:
            RefusalError: there is no such thing.
        """
        self._approach(self._find(name))

    def _door(self, target: str, action: str, opened: bool) -> None:
        name = self._find(target)
        if not self._is(name, "openable"):
            raise RefusalError(f"{name} cannot be {'opened' if opened else 'closed'}")
        self._approach(name)
        if self._is(name, "isOpen") is not opened:
            self._on(name, action)
        self.focus = name

    def _toggle(self, target: str, on: bool) -> None:
        name = self._find(target)
        scene = self._scene()
        switch = scene.knob(name) or name
        if not self._is(switch, "toggleable"):
            raise RefusalError(f"{name} cannot be turned on or off")
        remote = type_of(scene.things[name]) == "Television"
        if on and remote and category_of(scene.held or "") != "RemoteControl":
            raise RefusalError(
                f"{name} is turned on with the RemoteControl, which is not in the gripper"
            )
        self._approach(switch)
        if self._is(switch, "isToggled") is not on:
            self._on(switch, "ToggleObjectOn" if on else "ToggleObjectOff")
        self.focus = name

    def _put(self, thing: str, where: str) -> None:
        scene = self._scene()
        place = scene.receptacle(where)
        if place is None:
            raise RefusalError(f"{where} takes nothing")
        there = scene.contents(where)
        if len(there) >= CAPACITY.get(type_of(scene.things[where]), len(there) + 1):
            raise RefusalError(f"{where} has no room: it already has {', '.join(there)}")
        if type_of(scene.things[thing]) == "Pan" and type_of(scene.things[where]) == "Microwave":
            raise RefusalError(f"{where} does not take Pan")
        self._step("PutObject", objectId=place["objectId"], placeStationary=True)

    def _below_hand(self) -> str | None:
        """What an egg falls into that is cracked here: the vessel on what the robot faces."""
        scene = self._scene()
        if self.focus is None or self.focus not in scene:
            return None
        vessels = [n for n in scene.contents(self.focus) if scene.receptacle(n) is not None]
        if vessels and scene.receptacle(self.focus) is not None and len(vessels) == 1:
            return vessels[0]
        return self.focus if scene.receptacle(self.focus) is not None else None

    def _approach(self, name: str, again: bool = False) -> None:
        """Stand where a thing is seen near enough, or what it is shut in; the time passes.

        `again`: although it may be within reach from here.
        """
        scene = self._scene()
        if name == scene.held:
            return
        at = scene.closed_around(name) or name
        box = box_from_thor(scene.things[at])
        if box is None or (scene.visible(at) and not again):
            return
        if self._base.near(box):
            self.driven_s += self._base.look_at(box.centre)
            if self._scene().visible(at):
                return
        self.go_on()
        self._base.learn_floor()
        self.driven_s += self._base.drive_to(box, lambda: self._scene().visible(at))[1]

    def _on(self, name: str, action: str, **said: Any) -> None:
        thing = self._scene().things[name]
        self._step(action, objectId=thing["objectId"], **said)

    def _step(self, action: str, **said: Any) -> None:
        self.go_on()
        about = self._link.step(action, **said).metadata
        if not about["lastActionSuccess"]:
            raise RefusalError(self._spoken(str(about.get("errorMessage") or f"{action} failed")))

    def _spoken(self, message: str) -> str:
        """What AI2-THOR says, with our names in the place of its ids."""
        first = " ".join(message.split("trace:", maxsplit=1)[0].split())
        ids = {str(t["objectId"]): n for n, t in self._scene().things.items()}
        for object_id in sorted(ids, key=len, reverse=True):
            first = first.replace(object_id, ids[object_id])
        return first

    def _is(self, name: str, flag: str) -> bool:
        return bool(self._scene().things[name].get(flag))

    def _carried(self, target: str) -> str:
        held = self._scene().held
        if held is not None and target in (held, category_of(held)):
            return held
        what = "empty" if held is None else f"holding {held}"
        raise RefusalError(f"{target or 'nothing'} is not in the gripper, which is {what}")

    def _find(self, target: str) -> str:
        """The instance that is meant: of a category the held one, else the first at hand."""
        scene = self._scene()
        if is_instance(target):
            name = f"{self._canonical(category_of(target))}-{target.rpartition('-')[2]}"
            if name in scene:
                return name
        else:
            named = scene.of(target) if target else []
            if scene.held in named:
                return str(scene.held)
            if named:
                return min(named, key=lambda n: scene.closed_around(n) is not None)
        raise RefusalError(f"there is no {target or 'thing without a name'} here")

    def _place(self, target: str, thing: str) -> str:
        """Where to put something: of a category what is open and has room, the nearest."""
        scene = self._scene()
        if is_instance(target) or not target:
            return self._find(target)
        free = [n for n in scene.of(target) if not scene.shut(n) and n != thing]
        limit = CAPACITY.get(self._canonical(target))
        free = [n for n in free if limit is None or len(scene.contents(n)) < limit]
        x, y, _ = self._base.position_world_m

        def away(name: str) -> float:
            box = box_from_thor(scene.things[name])
            return float("inf") if box is None else box.away_m((x, y, box.centre[2]))

        return min(free, key=away) if free else self._find(target)


SKILLS: Mapping[str, Callable[..., None]] = {
    "navigate_to_obj": Agent.navigate,
    "pick_up": Agent.pick_up,
    "put_on": Agent.put,
    "put_in": Agent.put,
    "open_obj": Agent.open,
    "close_obj": Agent.close,
    "toggle_on": Agent.toggle_on,
    "toggle_off": Agent.toggle_off,
    "slice_obj": Agent.slice,
    "crack_obj": Agent.crack,
    "pour": Agent.pour,
}
"""Skill of the domain → what does it."""
