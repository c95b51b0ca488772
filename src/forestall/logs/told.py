"""Hands as plain data, for columns of text. Called by the LeRobot reader and writer."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict

from forestall.types.facts import GRIPPER
from forestall.types.observation import GripperState, Vec3


class _Hand(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    name: str = GRIPPER
    told: bool = True
    holding: str | None = None
    position_m: Vec3 = (0.0, 0.0, 0.0)
    released: str | None = None
    released_m: Vec3 | None = None
    width_m: float | None = None


class Hands(BaseModel):
    """What a cell says of every hand."""

    model_config = ConfigDict(extra="forbid")

    hands: tuple[_Hand, ...] = ()
    named: tuple[tuple[str, Vec3], ...] = ()

    def states(self) -> tuple[GripperState, ...]:
        """The hands, the first one first; one that does not tell where there is none."""
        found = tuple(
            GripperState(
                h.holding, h.position_m, h.released, h.released_m, h.name, h.told, h.width_m
            )
            for h in self.hands
        )
        return found or (GripperState.untold(),)


def hand_json(hand: GripperState) -> dict[str, Any]:
    """A hand as plain data."""
    return {
        "name": hand.name,
        "told": hand.told,
        "holding": hand.holding,
        "position_m": hand.position_world_m,
        "released": hand.released,
        "released_m": hand.released_world_m,
        "width_m": hand.width_m,
    }
