"""Motions that sometimes go wrong, in ways that the robot sees and in ways that it does not.

`environment` gives them to the robot in the profile "honest". Every attempt draws a number from a
stream of its own, named by the scene's seed, the skill, the kinds of things it deals with, and how
many times that has been attempted: what a monitor does in between changes no draw. Each draw stands
in the oracle's events. What the robot knows of it is its status, and whether its gripper closed on
anything.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, NoReturn

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError, SceneError
from forestall.types.episode import SLIP
from forestall.types.facts import category_of
from forestall.worlds.kitchen import effects
from forestall.worlds.kitchen.household import FLOOR, Household
from forestall.worlds.kitchen.motions import FailureError, Motions
from forestall.worlds.kitchen.naming import why_no_room
from forestall.worlds.kitchen.streams import Streams

if TYPE_CHECKING:
    from forestall.worlds.kitchen.actor import Robot

DRAW_EVENT = "draw"
"""Kind of the events that say what was drawn for an attempt."""

STAND_EVENT = "stand"
"""Kind of the events that say how far from where it meant to stand the robot stands."""

AS_MEANT = "as meant"
"""What is said of a draw by which nothing goes wrong."""

NEAR_M = 0.25
"""What stands no further from a thing can be grasped in its stead."""

DRIVEN_S = 1.0
"""A drive that takes less does not shake what is held."""


@dataclass(frozen=True, slots=True)
class Rates:
    """How often an attempt goes wrong, each way in itself; `docs/honest.md` has the sources.

    A way that is not possible where it is drawn (no neighbour, nothing that can tip) leaves the
    attempt as it was meant.

    Args:
        miss: the gripper closes beside the thing; seen.
        neighbour: it closes around the thing next to it; not seen.
        slip: what it took falls on the next drive; not seen when it happens.
        balk: the arm stops before the place is reached, and keeps what it holds; seen.
        beside: a put lands on what is next to the place, or on the floor; not seen.
        tip: a vessel falls on its side when it is let go, and loses what was in it; not seen.
        handle: the handle slips out of the fingers and the door stays as it was; seen.
        ajar: the door stays a little way open, and counts as it was before; not seen.
        press_seen: the finger misses the switch; seen.
        press: the switch is pressed and does not take; not seen.
        shy: the arm stops before it pours; seen.
        spill: what is poured goes beside, or half of it stays in where a drain takes it; not seen.
        glance: the knife glances off; seen.
        shell: the shell does not crack; seen.
        shell_beside: what is in it lands beside the vessel; not seen.
        stall: the base stops on the way and goes back; seen.
        hard: share of the falls so hard that what is fragile breaks.
        place_sd_m: standard deviation of where the robot comes to stand, along each axis.
        turn_sd_deg: of how it is turned there.
        roam: which part of the places from which its arm reaches, the best first, it may choose to
            stand at; the better ones more often.

    Raises:
        InputError: a rate that is none, or rates of one skill above 1.
    """

    miss: float = 0.045
    neighbour: float = 0.010
    slip: float = 0.012
    balk: float = 0.030
    beside: float = 0.012
    tip: float = 0.015
    handle: float = 0.035
    ajar: float = 0.015
    press_seen: float = 0.030
    press: float = 0.020
    shy: float = 0.030
    spill: float = 0.040
    glance: float = 0.060
    shell: float = 0.030
    shell_beside: float = 0.030
    stall: float = 0.010
    hard: float = 0.3
    place_sd_m: float = 0.02
    turn_sd_deg: float = 2.0
    roam: float = 0.6

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            top = 1.0 if f.name not in ("place_sd_m", "turn_sd_deg") else np.inf
            if not 0.0 <= value <= top:
                raise InputError(f"{f.name} = {value} is no rate: give a number from 0 to 1")
        for skill, ways in WAYS.items():
            if sum(getattr(self, w) for w in ways) > 1.0:
                raise InputError(f"{' + '.join(ways)}, of {skill}, is more than 1")

    def of(self, skill: str) -> Mapping[str, float]:
        """Way → rate of one motion."""
        return {way: getattr(self, way) for way in WAYS[skill]}


WAYS: Mapping[str, tuple[str, ...]] = {
    "take": ("miss", "neighbour", "slip"),
    "release": ("balk", "beside", "tip"),
    "swing": ("handle", "ajar"),
    "switch": ("press_seen", "press"),
    "pour": ("shy", "spill"),
    "cut": ("glance",),
    "crack": ("shell", "shell_beside"),
    "set_out": ("stall",),
}
"""Motion → ways in which it goes wrong."""

PERFECT = Rates(**{f.name: 0.0 for f in fields(Rates)})
"""Nothing goes wrong."""


class ImperfectMotions(Motions):
    """Motions of one run.

    Args:
        rates: how often they go wrong.
        streams: of the scene's seed.
    """

    def __init__(self, rates: Rates, streams: Streams) -> None:
        self._rates = rates
        self._streams = streams
        self._attempts: dict[tuple[str, ...], int] = {}
        self._loose: str | None = None
        self._error: str | None = None

    # draws

    def standing(self, name: str) -> tuple[float, float, float, float]:
        """Which place is chosen, and how far off it the robot ends; see `stage.Lifelike`."""
        rng = self._stream("stand", category_of(name))
        share = self._rates.roam * float(rng.random()) ** 2
        x, y, turn = np.clip(rng.standard_normal(3), -2.0, 2.0).tolist()
        along, by_deg = self._rates.place_sd_m, self._rates.turn_sd_deg * turn
        self._error = f"{1000 * along * x:.0f} mm, {1000 * along * y:.0f} mm, {by_deg:.1f} degrees"
        return share, along * x, along * y, float(np.deg2rad(by_deg))

    def _stream(self, *key: str) -> np.random.Generator:
        number = self._attempts[key] = self._attempts.get(key, 0) + 1
        return self._streams("skill", *key, number)

    def _drawn(
        self,
        robot: Robot,
        motion: str,
        *things: str,
        to: str = "",
        factor: float = 1.0,
        cannot: Collection[str] = (),
    ) -> str:
        """The way in which an attempt goes wrong, "" for none; noted in the oracle's events.

        Args:
            robot: who attempts it.
            motion: one of `WAYS`.
            things: instances that it deals with.
            to: the state that it is to bring about.
            factor: how many times as often as usual what is taken slips.
            cannot: ways that are not possible here.
        """
        key = (motion, *(category_of(t) for t in things), *([to] if to else []))
        number = float(self._stream(*key).random())
        way, upper = "", 0.0
        for name, rate in self._rates.of(motion).items():
            upper += rate * (factor if name == "slip" else 1.0)
            if not way and number < upper:
                way = name
        said = " ".join((motion, *things, *key[len(things) + 1 :]))
        told = f"{said} #{self._attempts[key]}: {number:.4f}, "
        if way in cannot:
            told, way = f"{told}{way} is not possible, ", ""
        robot.household.record(DRAW_EVENT, things[:1], told + (way or AS_MEANT))
        if way:
            robot.household.record(SLIP, things[:1], f"{said}: {way}")
        return way

    def _fail(self, robot: Robot, seconds: float, why: str) -> NoReturn:
        robot.done(seconds)
        raise FailureError(why)

    # motions

    def set_out(self, robot: Robot, name: str) -> None:
        """See `Motions`."""
        if self._drawn(robot, "set_out", name) == "stall":
            self._fail(robot, 2.0, f"the base stopped on the way to {name} and went back")

    def arrive(self, robot: Robot, seconds: float) -> None:
        """See `Motions`; what is loosely held falls."""
        home, loose = robot.household, self._loose
        if self._error is not None and robot.focus is not None:
            home.record(STAND_EVENT, (robot.focus,), f"stands off by {self._error}")
        self._error = None
        if loose is None or seconds < DRIVEN_S:
            return
        self._loose = None
        if home.held != loose:
            return
        with suppress(SceneError):
            home.fall(loose)
            robot.lost, robot.mistaken = True, None
            hard = float(self._stream("fall", category_of(loose)).random()) < self._rates.hard
            _hit_the_floor(home, loose, hard)

    def take(self, robot: Robot, name: str) -> None:
        """See `Motions`."""
        home = robot.household
        robot.mistaken = self._loose = None
        near = _next_to(home, name)
        cannot = ("neighbour",) if near is None else ()
        way = self._drawn(robot, "take", name, factor=home.law.slips(name), cannot=cannot)
        if way == "miss":
            self._fail(robot, robot.times.pick_s, f"the gripper closed on nothing beside {name}")
        if way == "neighbour" and near is not None:
            home.hold(near)
            robot.mistaken = name
            return
        home.hold(name)
        if way == "slip":
            self._loose = name

    def release(self, robot: Robot, name: str, place: str) -> None:
        """See `Motions`."""
        home = robot.household
        beside, filled = _beside(home, name, place), home.state(name, "filled")
        tips = filled is not None and not home.contents(name)
        cannot = [*([] if beside else ["beside"]), *([] if tips else ["tip"])]
        way = self._drawn(robot, "release", name, place, cannot=cannot)
        if way == "balk":
            said = f"the arm stopped before {name} was at {place}"
            self._fail(robot, robot.times.put_s, said)
        if (way == "beside" or home.is_lying(place)) and _put_first(home, name, beside):
            return
        super().release(robot, name, place)
        if way == "tip":
            if filled != "empty":
                effects.spill(home, name, "it fell on its side")
            home.lay(name)

    def swing(self, robot: Robot, name: str, value: str) -> None:
        """See `Motions`."""
        way = self._drawn(robot, "swing", name, to=value)
        if way == "handle":
            self._fail(robot, robot.times.open_s, f"the handle of {name} slipped from the fingers")
        if way == "ajar":
            robot.household.leave_ajar(name, value)
            return
        super().swing(robot, name, value)

    def switch(self, robot: Robot, name: str, value: str) -> None:
        """See `Motions`."""
        way = self._drawn(robot, "switch", name, to=value)
        if way == "press_seen":
            self._fail(robot, robot.times.toggle_s, "the finger met no switch")
        if way != "press":
            super().switch(robot, name, value)

    def pour(self, robot: Robot, name: str, place: str) -> None:
        """See `Motions`."""
        home = robot.household
        way = self._drawn(robot, "pour", name, place)
        if way == "shy":
            self._fail(robot, robot.times.pour_s, f"the arm stopped before it poured over {place}")
        if way == "spill" and home.category(place).drains:
            return  # half of it stays: it is not empty
        if way == "spill" or home.is_lying(place):
            effects.spill(home, name, f"it went beside {place}")
            return
        super().pour(robot, name, place)

    def cut(self, robot: Robot, name: str) -> None:
        """See `Motions`."""
        if self._drawn(robot, "cut", name) == "glance":
            self._fail(robot, robot.times.slice_s, f"the knife glanced off {name}")

    def crack(self, robot: Robot, name: str, place: str | None) -> str | None:
        """See `Motions`."""
        way = self._drawn(robot, "crack", name)
        if way == "shell":
            self._fail(robot, robot.times.crack_s, f"the shell of {name} did not break")
        if way == "shell_beside" and place is not None:
            home = robot.household
            room = [o for o in _beside(home, name, place) if why_no_room(home, name, o) is None]
            return room[0] if room else place
        return place


def _put_first(home: Household, name: str, places: Iterable[str]) -> bool:
    """Let go of a thing over the first of some places that takes it; whether one did."""
    for place in places:
        try:
            if category_of(place) == FLOOR:
                home.fall(name)
                _hit_the_floor(home, name, hard=False)
            else:
                home.put(name, place)
                effects.arrived(home, name, place)
        except SceneError:
            continue
        return True
    return False


def _hit_the_floor(home: Household, name: str, hard: bool) -> None:
    """What a fall does; what lay in or on the thing and can be taken out lies beside it then."""
    effects.crash(home, name, hard)
    floor = home.parent(name)
    for thing in home.contents(name):
        if floor is not None and home.category(thing).pickupable:
            with suppress(SceneError):
                home.put(thing, floor)


def _next_to(home: Household, name: str) -> str | None:
    """What stands next to a thing and could be grasped in its stead, the nearest."""
    place, at = home.parent(name), _middle(home, name)
    found: list[tuple[float, str]] = []
    for other in home.contents(place) if place is not None else ():
        if other == name or not home.category(other).pickupable:
            continue
        there = _middle(home, other)
        away = 0.0 if at is None or there is None else float(np.linalg.norm(at - there))
        if away <= NEAR_M and home.world.within_reach(other):
            found.append((away, other))
    return min(found)[1] if found else None


def _middle(home: Household, name: str) -> npt.NDArray[np.float64] | None:
    place = getattr(home.world, "position_world_m", lambda _: None)(name)
    return None if place is None else np.asarray(place)


def _beside(home: Household, name: str, place: str) -> list[str]:
    """Where a thing lands that misses a place: on what that stands on, on a support, on the floor.

    Nothing misses a support on which any place will do.
    """
    if home.is_any_support(category_of(place)) or category_of(place) == FLOOR:
        return []
    supports = [
        n
        for n in home.names()
        if home.is_any_support(category_of(n))
        and category_of(n) != FLOOR
        and home.world.within_reach(n)
    ]
    candidates = [*home.ancestors(place), *supports]
    open_ones = [
        n
        for n in dict.fromkeys(candidates)
        if n != name
        and home.catalogue.accepts(n, name)
        and not home.is_shut(n)
        and home.closed_around(n) is None
        and why_no_room(home, name, n) is None
    ]
    return [*open_ones[:1], *home.of_category(FLOOR)]
