"""The kitchen's geometry for a robot that works from its own map and does not stand where it meant.

`model` builds it in the place of `KitchenWorld` for the profile "honest". Places to stand are
chosen by the map of the furniture alone, without a look at what can be seen from there; things are
let go of at the hand; doors can be left ajar and vessels can lie on their side.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from forestall.errors import SceneError
from forestall.types.observation import Vec3
from forestall.worlds.kitchen.bodies import Bodies
from forestall.worlds.kitchen.forms import FLOOR
from forestall.worlds.kitchen.navigation import ROBOT_RADIUS_M, Floor, Standing
from forestall.worlds.kitchen.world import KitchenWorld

GRIPPER_OPENS_M = 0.10
"""How far the fingers come apart; what is wider is held by its rim or its handle."""

SLACK_M = 0.04
"""How much nearer to furniture than it means to the robot may come to stand."""

AJAR = 0.2
"""How far a door is open that was left ajar."""

PLACES = 200
"""How many places on the map are looked at, the best first."""

Chance = Callable[[str], tuple[float, float, float, float]]
"""Thing driven to → share of the places that are passed over, metres, metres, radians off."""


class HonestWorld(KitchenWorld):
    """A room whose robot errs in where it stands; see `KitchenWorld` for the arguments."""

    def __init__(
        self, bodies: Bodies, floor: Floor, start: Standing, decks: Mapping[str, str]
    ) -> None:
        super().__init__(bodies, floor, start, decks)
        self._chance: Chance = lambda _: (0.0, 0.0, 0.0, 0.0)

    def stand_with(self, chance: Chance) -> None:
        """From now on places to stand are chosen and reached by chance."""
        self._chance = chance

    def drive_to(self, name: str) -> float:
        """Drive to where the map says that `name` can be reached; simulated seconds."""
        if name in (FLOOR, self.held_name):
            return 0.0
        share, *off = self._chance(name)
        goal = self._on_the_map(name, share) or self.standing_for(name)
        if goal is None:
            return 0.0
        return self.go_to(self._missed(goal, *off))

    def look_from(self, place: Vec3, point: Vec3) -> float:
        """Drive to where the point can be looked at, or somewhere near."""
        _, *off = self._chance("lookout")
        x, y, _ = place
        goal = Standing(x, y, float(np.arctan2(point[1] - y, point[0] - x)))
        return self.go_to(self._missed(goal, *off))

    def _on_the_map(self, name: str, share: float) -> Standing | None:
        """A free place before the furniture from which the arm reaches, the best for a share 0."""
        target, places = self._approach(name)
        floor = self._free_floor(without=self.bodies.base(name))
        found = []
        for x, y in places[:PLACES]:
            here = Standing(x, y, float(np.arctan2(target[1] - y, target[0] - x)))
            if floor.free(x, y) and self.reachable_from(here, name):
                found.append(here)
                if not share:
                    break
        return found[int(share * len(found))] if found else None

    def _missed(self, goal: Standing, dx: float, dy: float, turn: float) -> Standing:
        floor = self._free_floor()
        x, y = goal.x + dx, goal.y + dy
        if not floor.free(x, y, ROBOT_RADIUS_M - SLACK_M):
            x, y = goal.x, goal.y
        return Standing(x, y, goal.yaw_rad + turn)

    def place(self, thing: str, receptacle: str) -> None:
        """Put `thing` at the free spot that is nearest to the hand, or raise SceneError."""
        near = np.array(self.gripper_position_world_m)
        found = self.find_spot(thing, receptacle, near=None if receptacle == FLOOR else near)
        if found is None:
            raise SceneError(f"{receptacle} has no room for {thing}")
        self.settle(thing, *found)

    def leave_ajar(self, name: str, towards: str) -> None:
        """Leave a door a little way open, on its way to a state that it does not reach."""
        share = AJAR if towards == "open" else 1 - AJAR
        self.bodies.leave_between(name, "open", towards, share)

    def lay(self, name: str) -> None:
        """Lay a thing that stands on its side, where it stands."""
        form, pose = self.bodies.forms[name], self.bodies.pose(name)
        if pose[2, 2] < 0.5:
            return
        lying = pose.copy()
        lying[:3, 1], lying[:3, 2] = pose[:3, 2], -pose[:3, 1]
        lying[:3, 3] += pose[:3, 1] * form.height_m / 2
        lying[2, 3] += -form.footprint.y0
        self.bodies.move(name, lying)

    def grip_width_m(self, thing: str) -> float:
        """How far the fingers are apart around a thing."""
        return min(*self.bodies.forms[thing].footprint.size, GRIPPER_OPENS_M)
