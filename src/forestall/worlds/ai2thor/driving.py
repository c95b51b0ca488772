"""The agent's base and eye: turning, looking, driving to where a thing can be reached.

AI2-THOR has no path to drive along: the agent is put where it goes, and the time is that of the
shortest way over the grid of reachable positions, at 0.25 m a second and a second for 90°. Called
by `world` and `skills`; calls `link`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from forestall.types.graph import Box
from forestall.types.observation import Vec3
from forestall.worlds.ai2thor.frames import angles_to, point_from_thor
from forestall.worlds.ai2thor.link import VISIBLE_M, Link

GRID_M = 0.25
SECONDS_PER_STEP = 1.0
SECONDS_PER_90_DEG = 1.0

TRIES = 24
"""Places to stand that are tried for one thing, the best first."""

BEST_M = 0.7
"""How far away a thing is handled best."""

HORIZONS = (-30.0, 60.0)
"""How far up and down the agent's eye looks, in degrees."""


class Base:
    """Where the agent stands and looks; every call answers with the seconds that it took."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._floor: list[tuple[float, float, float]] = []

    def learn_floor(self) -> None:
        """Ask where the agent can stand; whatever moved since the last time counts."""
        found = self._link.step("GetReachablePositions").metadata["actionReturn"] or []
        self._floor = sorted((float(p["x"]), float(p["y"]), float(p["z"])) for p in found)

    @property
    def floor(self) -> Sequence[tuple[float, float, float]]:
        """Every place where the agent can stand, in AI2-THOR's coordinates."""
        return self._floor

    @property
    def eye_world_m(self) -> Vec3:
        """Where the camera is."""
        return point_from_thor(self._about["cameraPosition"])

    @property
    def position_world_m(self) -> Vec3:
        """Where the robot stands, on the floor."""
        x, y, _ = point_from_thor(self._about["agent"]["position"])
        return (x, y, 0.0)

    @property
    def looks(self) -> tuple[float, float]:
        """Yaw and horizon in degrees."""
        agent = self._about["agent"]
        return float(agent["rotation"]["y"]), float(agent["cameraHorizon"])

    def turn_to(self, yaw_deg: float, horizon_deg: float) -> float:
        """Look somewhere from where the agent stands."""
        before = self.looks[0]
        low, high = HORIZONS
        self._link.step(
            "Teleport",
            position=dict(self._about["agent"]["position"]),
            rotation={"x": 0.0, "y": yaw_deg % 360.0, "z": 0.0},
            horizon=min(max(horizon_deg, low), high),
            standing=True,
            forceAction=True,
        )
        return turning_s(before, self.looks[0])

    def look_at(self, point_world_m: Vec3) -> float:
        """Turn towards a point."""
        return self.turn_to(*angles_to(self.eye_world_m, point_world_m))

    def near(self, box: Box) -> bool:
        """Whether a thing is near enough to be handled from here."""
        x, y, _ = self.position_world_m
        return _away_m(box, x, y) <= VISIBLE_M - 0.1

    def drive_to(self, box: Box, sees: Callable[[], bool]) -> tuple[bool, float]:
        """Stand where a thing is seen near enough; whether that came about, and the seconds.

        Where nothing of it is ever seen, the agent stays at the last place that it tried.
        """
        start, yaw = self._about["agent"]["position"], self.looks[0]
        here = (float(start["x"]), float(start["z"]))
        ways = self._ways(here)
        places = [p for p in self._floor if _cell(p[0], p[2]) in ways] or self._floor
        places = [p for p in places if _away_m(box, p[0], p[2]) <= VISIBLE_M - 0.1]
        best = sorted(places, key=lambda p: (_awkward(box, p[0], p[2]), p))
        seconds = 0.0
        for place in best[:TRIES]:
            if not self._stand(place, box):
                continue
            x, _, z = place
            steps = ways.get(_cell(x, z), 0)
            seconds = steps * SECONDS_PER_STEP + turning_s(yaw, self.looks[0])
            if sees():
                return True, seconds
        return False, seconds

    def _stand(self, place: tuple[float, float, float], box: Box) -> bool:
        x, y, z = place
        eye = (x, z, self.eye_world_m[2])
        yaw, horizon = angles_to(eye, box.centre)
        low, high = HORIZONS
        event = self._link.step(
            "Teleport",
            position={"x": x, "y": y, "z": z},
            rotation={"x": 0.0, "y": yaw, "z": 0.0},
            horizon=min(max(horizon, low), high),
            standing=True,
        )
        return bool(event.metadata["lastActionSuccess"])

    def _ways(self, here: tuple[float, float]) -> dict[tuple[int, int], int]:
        """Cell → steps of the shortest way over the grid from where the agent stands."""
        free = {_cell(x, z) for x, _, z in self._floor}
        start = _cell(*here)
        found, ahead = {start: 0}, deque([start])
        while ahead:
            x, z = ahead.popleft()
            for cell in ((x + 1, z), (x - 1, z), (x, z + 1), (x, z - 1)):
                if cell in free and cell not in found:
                    found[cell] = found[x, z] + 1
                    ahead.append(cell)
        return found

    @property
    def _about(self) -> Any:
        return self._link.event.metadata


def turning_s(before_deg: float, after_deg: float) -> float:
    """How long a turn takes."""
    return abs((after_deg - before_deg + 180.0) % 360.0 - 180.0) / 90.0 * SECONDS_PER_90_DEG


def _cell(x: float, z: float) -> tuple[int, int]:
    return round(x / GRID_M), round(z / GRID_M)


def _awkward(box: Box, x: float, y: float) -> float:
    """How badly one handles a thing from a place: too near, too far, or at a slant.

    What opens shows its inside to one who stands straight before it.
    """
    aside = min(abs(box.centre[0] - x), abs(box.centre[1] - y))
    return abs(_away_m(box, x, y) - BEST_M) + 0.5 * aside


def _away_m(box: Box, x: float, y: float) -> float:
    """How far a point of the floor is from a box, seen from above."""
    return math.hypot(
        max(box.low[0] - x, x - box.high[0], 0.0), max(box.low[1] - y, y - box.high[1], 0.0)
    )
