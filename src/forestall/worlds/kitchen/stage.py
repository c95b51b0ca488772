"""What the environment asks of a kitchen's geometry beyond moving things; see `seams.World`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from forestall.seams.acting import World
from forestall.types.observation import Vec3
from forestall.worlds.kitchen.household import Placed


class Stage(World, Protocol):
    """What the environment asks of a world beyond moving things: its contents and its camera."""

    @property
    def instances(self) -> Iterable[Placed]:
        """Everything in the scene, prepared things included."""

    @property
    def data(self) -> Any:
        """What the renderer draws."""

    @property
    def robot_position_world_m(self) -> Vec3:
        """Where the robot stands."""

    @property
    def robot_yaw_rad(self) -> float:
        """Its heading, counter-clockwise from +x."""

    @property
    def gripper_position_world_m(self) -> Vec3:
        """Where its hand is."""

    def turn_to(self, yaw_rad: float) -> float:
        """Turn on the spot to a heading; returns the simulated seconds."""

    def position_world_m(self, name: str) -> Vec3 | None:
        """Middle of a thing's box, None when it is not there."""

    def look_at(self, point_world_m: Sequence[float]) -> npt.NDArray[np.float64]:
        """Camera-to-world pose (4, 4) of the head camera turned towards a point."""

    def camera_to_world(self, pan_rad: float, tilt_rad: float) -> npt.NDArray[np.float64]:
        """Camera-to-world pose (4, 4); pan to the left and tilt downwards are positive."""

    def reset(self) -> None:
        """Everything back to the start of the scene."""


@runtime_checkable
class Roving(Protocol):
    """A world whose robot can go where it sees something else of a point."""

    def lookouts(self, point: Vec3) -> Sequence[Vec3]:
        """Where its eyes could be to look at a point, the nearest first."""

    def look_from(self, place: Vec3, point: Vec3) -> float:
        """Drive to one of them and face the point; returns the simulated seconds."""


@runtime_checkable
class Lifelike(Protocol):
    """A world whose robot does not stand where it meant to, and feels how wide its hand is open."""

    def stand_with(self, chance: Callable[[str], tuple[float, float, float, float]]) -> None:
        """From now on places to stand are chosen and reached by chance.

        Args:
            chance: thing driven to → which of the places is chosen (0 the best, below 1), and how
                far off the robot ends there: metres, metres, radians.
        """

    def grip_width_m(self, thing: str) -> float:
        """How far the fingers are apart around a thing."""
