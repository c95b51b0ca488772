"""The robot's body: base, column, and one arm whose hand hangs where things are held."""

from __future__ import annotations

from forestall.worlds.kitchen.assembly import Kit
from forestall.worlds.kitchen.forms import Rgba, Vec

ROBOT_GROUP = 2
"""Drawn like everything else, but no obstacle to a glance."""

_SHELL: Rgba = (0.88, 0.89, 0.90, 1)
_SLEEVE: Rgba = (0.42, 0.44, 0.47, 1)
_JOINT: Rgba = (0.18, 0.19, 0.21, 1)


def build_robot(kit: Kit, hand: Vec) -> None:
    """Add the robot as one carried body; its axis is the camera's place.

    Args:
        kit: the scene.
        hand: place of the hand in the robot's frame (x forward, y left).
    """
    part = kit.carried("robot")
    first = len(kit.parts)
    look = {"solid": False, "texture": "metal"}
    part.cylinder((-0.10, 0, 0.11), 0.21, 0.20, _SHELL, **look)
    part.cylinder((-0.10, 0, 0.22), 0.17, 0.03, _JOINT, **look)
    part.box((-0.17, 0, 0.75), (0.13, 0.17, 1.05), _SHELL, **look)
    part.box((-0.17, 0, 1.30), (0.15, 0.36, 0.12), _SHELL, **look)
    part.cylinder((-0.17, 0, 1.42), 0.03, 0.14, _JOINT, **look)
    part.box((-0.17, 0, 1.57), (0.10, 0.10, 0.10), _JOINT, **look)
    x, y, z = hand
    shoulder, elbow = (-0.17, y - 0.06, 1.27), (0.06, y - 0.12, z - 0.06)
    wrist = (x - 0.16, y - 0.015, z + 0.045)
    part.ellipsoid(shoulder, (0.06, 0.06, 0.06), _JOINT, **look)
    part.capsule(shoulder, elbow, 0.042, _SHELL, **look)
    part.ellipsoid(elbow, (0.05, 0.05, 0.05), _JOINT, **look)
    part.capsule(elbow, wrist, 0.027, _SLEEVE, **look)
    part.cylinder(wrist, 0.036, 0.05, _JOINT, **look)
    part.box((x - 0.105, y, z + 0.045), (0.05, 0.10, 0.035), _JOINT, **look)
    for side in (-1, 1):
        at = (x - 0.05, y + side * 0.045, z + 0.045)
        part.box(at, (0.08, 0.014, 0.024), _JOINT, **look)
    for added in kit.parts[first:]:
        added.geom.group = ROBOT_GROUP
