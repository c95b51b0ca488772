"""What the arm does once a skill's needs are met: grasp, let go, pull, press, pour, drive.

`skills` calls it, and it changes the household. This one always does what was meant, as far as the
household's own law lets it; `imperfection` has the one that sometimes does not.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from forestall.worlds.kitchen import effects
from forestall.worlds.kitchen.naming import RefusalError

if TYPE_CHECKING:
    from forestall.worlds.kitchen.actor import Robot


class FailureError(RefusalError):
    """A skill has begun and went wrong, and the robot knows it; its text is what it knows."""


class Motions:
    """Motions that succeed.

    A motion that fails lets its time pass and raises `FailureError`.
    """

    def set_out(self, robot: Robot, name: str) -> None:
        """Before a drive that was asked for."""

    def arrive(self, robot: Robot, seconds: float) -> None:
        """After any drive."""

    def take(self, robot: Robot, name: str) -> None:
        """Close the gripper around a thing and lift it."""
        robot.household.hold(name)

    def release(self, robot: Robot, name: str, place: str) -> None:
        """Put what is held down on or in a place."""
        home = robot.household
        if not home.law.fits(name, place):
            robot.done(robot.times.put_s)
            raise FailureError(f"the hand stopped short of {place} with {name}")
        home.put(name, place)
        effects.arrived(home, name, place)

    def swing(self, robot: Robot, name: str, value: str) -> None:
        """Open or close a door, a drawer, a lid."""
        home = robot.household
        if value == "open" and not home.law.opens(name):
            robot.done(robot.times.open_s)
            raise FailureError(f"{name} did not move when it was pulled")
        home.swing(name, value)

    def switch(self, robot: Robot, name: str, value: str) -> None:
        """Press or turn what switches a thing."""
        home = robot.household
        if home.law.turns(name, value):
            home.set_state(name, "toggled", value)

    def pour(self, robot: Robot, name: str, place: str) -> None:
        """Pour what is in a held vessel into something, or down a drain."""
        home = robot.household
        liquid, takes = home.state(name, "filled"), home.state(place, "filled")
        if home.category(place).drains:
            home.set_state(name, "filled", "empty")
        elif takes == "empty":
            home.set_state(name, "filled", "empty")
            home.set_state(place, "filled", str(liquid))
            home.set_state(place, "temperature", home.state(name, "temperature") or "room")
            effects.soak(home, place, f"{liquid} was poured onto it")
        else:
            effects.spill(home, name, f"{place} was already full of {takes}")
            effects.soak(home, place, f"{liquid} was poured onto it")

    def cut(self, robot: Robot, name: str) -> None:
        """Before a thing is sliced."""

    def crack(self, robot: Robot, name: str, place: str | None) -> str | None:
        """Where what is in a thing lands, of which the place below the hand is given."""
        return place
