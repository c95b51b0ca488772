"""Who acts in the household: what the robot faces, what it believes to hold, and how it drives."""

from __future__ import annotations

from dataclasses import dataclass

from forestall.errors import ForestallError
from forestall.types.facts import category_of
from forestall.worlds.kitchen.household import Household
from forestall.worlds.kitchen.motions import FailureError, Motions
from forestall.worlds.kitchen.naming import RefusalError, resolve_carried


@dataclass(frozen=True, slots=True)
class SkillTimes:
    """Fixed duration of each manipulation in simulated seconds; driving comes on top."""

    pick_s: float = 4.0
    put_s: float = 4.0
    open_s: float = 3.0
    toggle_s: float = 2.0
    slice_s: float = 6.0
    crack_s: float = 3.0
    pour_s: float = 4.0
    turn_s_per_90deg: float = 1.0


class Robot:
    """Who acts: the household, the durations, and what the robot faces.

    `focus` is the last thing that was driven to or handled; something let go of lands there.
    `mistaken` is what the robot believes to hold, where it holds something else; `lost` whether
    what it held fell while it drove.
    """

    def __init__(
        self, household: Household, times: SkillTimes, motions: Motions | None = None
    ) -> None:
        self.household = household
        self.times = times
        self.motions = motions or Motions()
        self.focus: str | None = None
        self.mistaken: str | None = None
        self.lost = False

    @property
    def believed(self) -> str | None:
        """What the robot believes to hold; its gripper feels that there is something."""
        held = self.household.held
        return held if held is None or self.mistaken is None else self.mistaken

    def carried(self, name: str) -> str:
        """The instance that the object of a put, pour or crack means to this robot."""
        home, mistaken = self.household, self.mistaken
        if home.held is None or mistaken is None:
            return resolve_carried(home, name)
        if home.catalogue.canonical(name) in (mistaken, category_of(mistaken)):
            return home.held
        return resolve_carried(home, name)

    def drive(self, name: str) -> None:
        """Drive to a thing, whatever the distance, and face it.

        Raises:
            RefusalError: there is no way to it.
        """
        try:
            seconds = self.household.world.drive_to(name)
        except ForestallError as error:
            raise RefusalError(f"there is no way to {name}: {error}") from error
        self.household.time_s += seconds
        self.focus = name
        self.motions.arrive(self, seconds)

    def approach(self, name: str) -> None:
        """Drive to a thing if it is out of reach, and face it."""
        if name == self.household.held:
            return
        if self.household.world.within_reach(name):
            self.focus = name
            return
        held = self.household.held
        self.drive(name)
        if held is not None and self.household.held is None:
            raise FailureError("the gripper closed on nothing on the way")
        if not self.household.world.within_reach(name):
            raise RefusalError(f"{name} stays out of reach")

    def need_accessible(self, name: str) -> None:
        """Refuse what lies in something closed."""
        closed = self.household.closed_around(name)
        if closed is not None:
            raise RefusalError(f"{name} cannot be reached: {closed} is closed")

    def done(self, seconds: float) -> str:
        """Let the time of a manipulation pass; the empty reason of a success."""
        self.household.time_s += seconds
        return ""
