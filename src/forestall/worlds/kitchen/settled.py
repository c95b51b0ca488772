"""Checks that nothing in a scene goes through anything else; used by `model` and by tests."""

from __future__ import annotations

import mujoco
import numpy as np

from forestall.worlds.kitchen.assembly import HIDDEN
from forestall.worlds.kitchen.forms import inverse
from forestall.worlds.kitchen.world import KitchenWorld

DEPTH_M = 0.003
"""How deep two things may overlap before it is called interpenetration."""


def check_settled(world: KitchenWorld, depth_m: float = DEPTH_M) -> tuple[str, ...]:
    """Interpenetrations between different instances, and between instances and walls.

    A hollow thing collides as a solid; what it contains is tested against its inner wall instead.
    """
    bodies = world.bodies
    model, data = world.model, world.data
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    names = world.appearance.instance_names
    owners = world.appearance.geom_instance
    deepest: dict[tuple[str, str], float] = {}
    for k in range(data.ncon):
        contact = data.contact[k]
        if contact.dist > -depth_m:
            continue
        pair = [int(g) for g in contact.geom]
        if any(model.geom_group[g] == HIDDEN for g in pair):
            continue
        a, b = sorted(names[owners[g]] if owners[g] >= 0 else "the room" for g in pair)
        if a == b or (bodies.is_thing(a) and a not in bodies.present):
            continue
        if world.held_name in (a, b) or bodies.parents.get(a) == b or bodies.parents.get(b) == a:
            inside = [n for n in (a, b) if bodies.is_thing(bodies.parents.get(n) or "")]
            if inside or world.held_name in (a, b):
                continue
        deepest[a, b] = max(deepest.get((a, b), 0.0), -float(contact.dist))
    found = [f"{a} and {b} overlap by {1000 * d:.1f} mm" for (a, b), d in sorted(deepest.items())]
    return (*found, *_outside_their_vessels(world, depth_m))


def _outside_their_vessels(world: KitchenWorld, depth_m: float) -> list[str]:
    bodies = world.bodies
    found = []
    for name, parent in sorted(bodies.parents.items()):
        if parent is None or not bodies.is_thing(parent):
            continue
        where = bodies.region_of(name)
        if where is None or not where[0].profile:
            continue
        region = where[0]
        local = inverse(bodies.pose(parent)) @ bodies.pose(name)
        heights, radii = (np.array(c) for c in zip(*region.profile, strict=True))
        z = float(local[2, 3]) - region.z_m
        over = float(np.hypot(*local[:2, 3])) + bodies.forms[name].core_m
        over -= float(np.interp(z, heights, radii))
        if z < -depth_m or over > depth_m:
            found.append(f"{name} goes through {parent} by {1000 * max(over, -z):.1f} mm")
    return found
