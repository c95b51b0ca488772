"""The stand-in's simulation: actions of AI2-THOR on the boxes of `things`, and their metadata.

Refusals are worded like the real ones. Called by `unity`; calls `drawing` for every picture, since
what is visible is what shows in it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from drawing import FAR_M, NEAR_M, Part, axes, draw
from things import FLOOR, WALLS, Thing, kitchen, make

VISIBLE_M = 1.5
GRID_M = 0.25
BODY_M = 0.2
EYE_M = 0.675
SCENES = ("FloorPlan1_physics", "FloorPlan2_physics")
LAZY = SCENES[1]
"""The scene in which running water reaches nothing, as it may miss things in a real one."""

_SLICES = {"Potato": "PotatoSliced", "Tomato": "TomatoSliced", "Bread": "BreadSliced",
           "Lettuce": "LettuceSliced"}  # fmt: skip
_HEATERS = ("Microwave", "StoveBurner", "Toaster", "CoffeeMachine")


class ActionError(Exception):
    """What the action's errorMessage says."""


class Kitchen:
    """One scene with an agent in it."""

    def __init__(self, width: int, height: int) -> None:
        self.size = (width, height)
        self.fov = 90.0
        self.scene = SCENES[0]
        self.last, self.message, self.returned = "Initialize", "", None
        self.reset()

    def reset(self) -> None:
        self.things = {t.id: t for t in kitchen()}
        self.gone: dict[str, Thing] = {}
        self.place = (0.0, 0.9, 0.0)
        self.yaw, self.horizon = 0.0, 0.0
        self.held: str | None = None
        self._settle()

    # --- one step --------------------------------------------------------------------------------

    def step(self, action: dict[str, Any]) -> None:
        """Carry an action out; what came of it is in the next metadata."""
        name = str(action["action"])
        self.last, self.message, self.returned, self.code = name, "", None, ""
        act = getattr(self, f"do_{name}", None)
        if act is None:
            self.message, self.code = f"Invalid action: {name}", "InvalidAction"
            return
        try:
            self.returned = act(action)
        except ActionError as error:
            self.message = str(error)
        self._settle()

    def do_GetScenesInBuild(self, a: dict[str, Any]) -> list[str]:
        return list(SCENES)

    def do_Reset(self, a: dict[str, Any]) -> None:
        self.scene = a["sceneName"]
        self.reset()

    def do_Initialize(self, a: dict[str, Any]) -> dict[str, float]:
        self.fov = float(a.get("fieldOfView", self.fov))
        return {"cameraNearPlane": NEAR_M, "cameraFarPlane": FAR_M}

    def do_ChangeResolution(self, a: dict[str, Any]) -> None:
        self.size = (int(a["x"]), int(a["y"]))

    def do_Done(self, a: dict[str, Any]) -> None:
        """Time passes."""

    def do_GetReachablePositions(self, a: dict[str, Any]) -> list[dict[str, float]]:
        steps = np.arange(-2.0, 2.01, GRID_M)
        return [
            {"x": float(x), "y": 0.9, "z": float(z)}
            for x in steps
            for z in steps
            if self._free(x, z)
        ]

    def do_Teleport(self, a: dict[str, Any]) -> None:
        to = a.get("position") or {"x": self.place[0], "z": self.place[2]}
        x, z = float(to["x"]), float(to["z"])
        horizon = float(a.get("horizon", self.horizon))
        if not -30.0 <= horizon <= 60.0:
            raise ActionError(f"Each horizon must be in [-30:60]. You gave {horizon}.")
        if not a.get("forceAction") and not self._free(x, z):
            raise ActionError("Collided with: furniture")
        self.place, self.horizon = (x, 0.9, z), horizon
        self.yaw = float((a.get("rotation") or {"y": self.yaw})["y"]) % 360.0
        self._carry()

    def do_PickupObject(self, a: dict[str, Any]) -> None:
        thing = self._target(a, "pickupable")
        if self.held is not None:
            raise ActionError("Agent hand has something in it already! Can't pick up anything else")
        thing.parent, self.held = None, thing.id
        self._carry()

    def do_PutObject(self, a: dict[str, Any]) -> None:
        place = self._target(a, "receptacle")
        if self.held is None:
            raise ActionError("Can't place an object if Agent isn't holding anything")
        thing = self.things[self.held]
        if thing.type not in place.takes:
            raise ActionError(f"{thing.type} cannot be placed in {place.type}")
        if place.is_("openable") and not place.states.get("isOpen"):
            raise ActionError(
                "Target openable Receptacle is CLOSED, can't place if target is not open!"
            )
        spot = next(iter(self._spots(place, thing)), None)
        if spot is None:
            raise ActionError("No valid positions to place object found")
        self._move(thing, spot)
        thing.parent, self.held = place.id, None

    def do_DropHandObject(self, a: dict[str, Any]) -> None:
        if self.held is None:
            raise ActionError("Nothing in hand to drop!")
        thing = self.things[self.held]
        ahead = axes(self.yaw, 0.0)[2]
        x, z = self.place[0] + 0.45 * ahead[0], self.place[2] + 0.45 * ahead[2]
        self._move(thing, (x, thing.size[1] / 2, z))
        thing.parent, self.held = None, None
        if thing.type == "Egg":
            self._replace(thing, "EggCracked", 1)

    def do_OpenObject(self, a: dict[str, Any]) -> None:
        thing = self._target(a, "openable")
        if thing.states.get("isOpen"):
            raise ActionError("already open")
        if thing.states.get("isToggled"):
            raise ActionError("Target must be OFF to open!")
        thing.states["isOpen"] = True

    def do_CloseObject(self, a: dict[str, Any]) -> None:
        thing = self._target(a, "openable")
        if not thing.states.get("isOpen"):
            raise ActionError("object already closed")
        thing.states["isOpen"] = False

    def do_ToggleObjectOn(self, a: dict[str, Any]) -> None:
        self._toggle(a, True)

    def do_ToggleObjectOff(self, a: dict[str, Any]) -> None:
        self._toggle(a, False)

    def do_SliceObject(self, a: dict[str, Any]) -> None:
        thing = self._target(a, "sliceable")
        if thing.id == self.held:
            raise ActionError("target object cannot be sliced while it is held")
        self._replace(
            thing, *(("EggCracked", 1) if thing.type == "Egg" else (_SLICES[thing.type], 3))
        )

    def do_BreakObject(self, a: dict[str, Any]) -> None:
        thing = self._target(a, "breakable")
        if thing.type == "Egg":
            self._replace(thing, "EggCracked", 1)
        thing.states["isBroken"] = True

    def do_DirtyObject(self, a: dict[str, Any]) -> None:
        self._target(a, "dirtyable").states["isDirty"] = True

    def do_CleanObject(self, a: dict[str, Any]) -> None:
        self._target(a, "dirtyable").states["isDirty"] = False

    def do_CookObject(self, a: dict[str, Any]) -> None:
        self._target(a, "cookable").states["isCooked"] = True

    def do_FillObjectWithLiquid(self, a: dict[str, Any]) -> None:
        thing = self._target(a, "fillable")
        if thing.states.get("isFilledWithLiquid"):
            raise ActionError(f"{thing.id} is already Filled!")
        thing.states.update(isFilledWithLiquid=True, fillLiquid=a["fillLiquid"])

    def do_EmptyLiquidFromObject(self, a: dict[str, Any]) -> None:
        thing = self._target(a, "fillable")
        if not thing.states.get("isFilledWithLiquid"):
            raise ActionError(f"{thing.id} is already empty!")
        thing.states.update(isFilledWithLiquid=False, fillLiquid=None)

    def do_GetSpawnCoordinatesAboveReceptacle(self, a: dict[str, Any]) -> list[dict[str, float]]:
        place = self._target(a | {"forceAction": True}, "receptacle")
        probe = make("Statue", 0.0, 0.0)
        probe.size = (0.02, 0.02, 0.02)
        return [{"x": x, "y": place.floor_y(), "z": z} for x, _, z in self._spots(place, probe)]

    def do_PlaceObjectAtPoint(self, a: dict[str, Any]) -> None:
        thing, at = self.things[a["objectId"]], a["position"]
        centre = (float(at["x"]), float(at["y"]) + thing.size[1] / 2, float(at["z"]))
        under = [
            t for t in self.things.values()
            if t.is_("receptacle") and abs(t.floor_y() - float(at["y"])) < 0.02
            and self._inside(t, thing, centre)
        ]  # fmt: skip
        if not under or any(self._collide(thing, centre, o) for o in self._loose(thing)):
            raise ActionError(f"{thing.id} would collide or falls at this point")
        self._move(thing, centre)
        thing.parent = min(under, key=lambda t: t.size[0] * t.size[2]).id
        if self.held == thing.id:
            self.held = None

    # --- what actions are made of -----------------------------------------------------------------

    def _target(self, a: dict[str, Any], flag: str) -> Thing:
        thing = self.things.get(str(a.get("objectId")))
        if thing is None:
            raise ActionError(
                f"objectId: {a.get('objectId')} is not the objectId on any object in the scene!"
            )
        if not thing.is_(flag):
            raise ActionError(f"{thing.id} is not {flag}")
        if not a.get("forceAction") and thing.id not in self.visible and thing.id != self.held:
            raise ActionError("Target object not found within the specified visibility.")
        return thing

    def _toggle(self, a: dict[str, Any], on: bool) -> None:
        thing = self._target(a, "toggleable")
        if bool(thing.states.get("isToggled")) is on:
            how = "on" if on else "off"
            raise ActionError(f"can't toggle object {how} if it is already {how}!")
        if on and thing.type == "Microwave" and thing.states.get("isOpen"):
            raise ActionError("Target must be closed to Toggle On!")
        thing.states["isToggled"] = on
        if thing.controls is not None:
            self.things[thing.controls].states["isToggled"] = on

    def _contents(self, place: Thing) -> list[Thing]:
        direct = [t for t in self.things.values() if t.parent == place.id]
        return direct + [t for d in direct for t in self._contents(d)]

    def _settle(self) -> None:
        """Water, heat and cold do what Unity's triggers do; then the picture is drawn."""
        for thing in list(self.things.values()):
            on = thing.states.get("isToggled")
            if thing.type == "Faucet" and on and self.scene != LAZY:
                for basin in (t for t in self.things.values() if t.type == "SinkBasin"):
                    for c in (t for t in self.things.values() if t.parent == basin.id):
                        c.states["isDirty"] = False
                        self._fill(c, "water")
            if thing.type in _HEATERS and on:
                for c in self._contents(thing):
                    c.states["temperature"] = "Hot"
                    if c.is_("cookable"):
                        c.states["isCooked"] = True
                    if thing.type == "CoffeeMachine":
                        self._fill(c, "coffee")
            if thing.is_("cold") and not thing.states.get("isOpen"):
                for c in self._contents(thing):
                    c.states["temperature"] = "Cold"
        self._carry()
        self._look()

    def _fill(self, thing: Thing, liquid: str) -> None:
        if thing.is_("fillable") and not thing.states.get("isFilledWithLiquid"):
            thing.states.update(isFilledWithLiquid=True, fillLiquid=liquid)

    def _replace(self, thing: Thing, kind: str, count: int) -> None:
        del self.things[thing.id]
        thing.states["isSliced"] = True
        self.gone[thing.id] = thing
        x, _, z = thing.centre
        for i in range(count):
            piece = make(
                kind, x + 0.065 * (i - (count - 1) / 2), z, thing.low[1],
                id=f"{thing.id}|{kind}_{i}", parent=thing.parent,
            )  # fmt: skip
            piece.states["temperature"] = thing.states.get("temperature", "RoomTemp")
            piece.states["isCooked"] = bool(thing.states.get("isCooked"))
            self.things[piece.id] = piece

    def _move(self, thing: Thing, centre: tuple[float, float, float]) -> None:
        """With all that is in or on it."""
        by = [b - a for a, b in zip(thing.centre, centre, strict=True)]
        for each in (thing, *self._contents(thing)):
            x, y, z = (a + d for a, d in zip(each.centre, by, strict=True))
            each.centre = (x, y, z)

    @property
    def hand(self) -> tuple[float, float, float]:
        ahead = axes(self.yaw, 0.0)[2]
        return (self.place[0] + 0.38 * ahead[0], 1.35, self.place[2] + 0.38 * ahead[2])

    def _carry(self) -> None:
        if self.held is not None:
            self._move(self.things[self.held], self.hand)

    def _loose(self, thing: Thing) -> list[Thing]:
        """What a thing could stand in the way of."""
        mine = {thing.id, *(t.id for t in self._contents(thing))}
        return [
            t for t in self.things.values()
            if t.id not in mine and t.id != self.held
            and (t.parent is not None or t.type == "Faucet")
        ]  # fmt: skip

    def _inside(self, place: Thing, thing: Thing, centre: tuple[float, float, float]) -> bool:
        rim = 0.0 if place.form == "solid" else 0.015
        return all(
            place.low[i] + rim - 1e-9 <= centre[i] - thing.size[i] / 2
            and centre[i] + thing.size[i] / 2 <= place.high[i] - rim + 1e-9
            for i in (0, 2)
        )

    def _collide(self, thing: Thing, centre: tuple[float, float, float], other: Thing) -> bool:
        return all(
            abs(centre[i] - other.centre[i]) < (thing.size[i] + other.size[i]) / 2 - 1e-9
            for i in range(3)
        ) and not (
            other.is_("receptacle")
            and other.floor_y() <= centre[1] - thing.size[1] / 2 + 1e-6
            and self._inside(other, thing, centre)
        )

    def _spots(self, place: Thing, thing: Thing) -> list[tuple[float, float, float]]:
        """Free centres for a thing, the nearest to the agent first."""
        y = place.floor_y() + thing.size[1] / 2 + 0.0005
        found = [(place.centre[0], y, place.centre[2])]
        one = ("StoveBurner", "Plate", "Toaster", "CoffeeMachine", "Microwave")
        if place.type in one and any(t.parent == place.id for t in self.things.values()):
            return []
        if place.form == "stand":
            found = [(place.centre[0], y, place.centre[2] - 0.05)]
        elif place.type not in ("StoveBurner", "Plate", "Toaster"):
            xs = np.arange(place.low[0] + 0.13, place.high[0] - 0.12, 0.05)
            zs = np.arange(place.low[2] + 0.13, place.high[2] - 0.12, 0.05)
            grid = [(float(x), y, float(z)) for x in xs for z in zs]
            x0, _, z0 = self.place
            found += sorted(grid, key=lambda c: (c[0] - x0) ** 2 + (c[2] - z0) ** 2)
        fits = place.type in ("StoveBurner", "Plate", "Toaster")
        return [
            c for c in found
            if (fits or self._inside(place, thing, c))
            and not any(self._collide(thing, c, o) for o in self._loose(thing) if o.id != place.id)
        ]  # fmt: skip

    def _free(self, x: float, z: float) -> bool:
        return abs(x) <= 2.0 and abs(z) <= 2.0 and not any(
            t.low[0] - BODY_M < x < t.high[0] + BODY_M
            and t.low[2] - BODY_M < z < t.high[2] + BODY_M
            for t in self.things.values() if t.parent is None and t.id != self.held
            and t.low[1] < 0.6
        )  # fmt: skip

    # --- what is seen -----------------------------------------------------------------------------

    def _look(self) -> None:
        order = list(self.things.values())
        boxes = [FLOOR, *WALLS]
        parts = [
            Part(len(order) + i, low, high, (200, 195, 185)) for i, (low, high) in enumerate(boxes)
        ]
        parts += [Part(i, *box) for i, t in enumerate(order) for box in t.boxes()]
        x, y, z = self.place
        eye = (x, y + EYE_M, z)
        self.rgb, self.depth, owners = draw(
            parts, eye, (self.yaw, self.horizon), self.size, self.fov
        )
        ids = np.zeros((*owners.shape, 4), dtype=np.uint8)
        ids[..., 3] = 255
        self.colors = []
        shown, counts = np.unique(owners, return_counts=True)
        pixels = dict(zip(shown.tolist(), counts.tolist(), strict=True))
        self.visible = set()
        names = [t.id for t in order] + ["Floor|+00.00|+00.00|+00.00", *["Wall"] * len(WALLS)]
        for i, name in enumerate(names):
            colour = [(i * 53 + 17) % 256, (i * 97 + 5) % 256, 10 + i // 256]
            self.colors.append({"name": name, "color": colour})
            if i in pixels:
                ids[owners == i, :3] = colour
        for i, t in enumerate(order):
            away = math.hypot(
                *(max(t.low[k] - eye[k], eye[k] - t.high[k], 0.0) for k in (0, 2))
            )  # AI2-THOR looks for colliders in a capsule from the eye down to the floor
            if pixels.get(i, 0) >= 4 and away <= VISIBLE_M:
                self.visible.add(t.id)
        self.ids = ids

    def metadata(self, sequence: int) -> dict[str, Any]:
        """As AI2-THOR 5.0 gives it, as far as an adapter asks."""
        x, y, z = self.place
        hand = self.hand
        held = [] if self.held is None else [
            {"objectId": self.held, "objectType": self.things[self.held].type}
        ]  # fmt: skip
        agent = {
            "objects": [self._object(t) for t in (*self.things.values(), *self.gone.values())]
            + [self._ground()],
            "isSceneAtRest": True,
            "agent": {"name": "agent", "position": _xyz((x, y, z)), "isStanding": True,
                      "rotation": {"x": 0.0, "y": self.yaw, "z": 0.0},
                      "cameraHorizon": self.horizon},
            "heldObjectPose": {"position": _xyz(hand), "rotation": _xyz((0, self.yaw, 0))},
            "arm": None, "fov": self.fov, "cameraPosition": _xyz((x, y + EYE_M, z)),
            "thirdPartyCameras": [], "inventoryObjects": held, "sceneName": self.scene,
            "lastAction": self.last, "lastActionSuccess": not self.message,
            "errorMessage": self.message, "errorCode": getattr(self, "code", ""),
            "screenWidth": self.size[0], "screenHeight": self.size[1], "agentId": 0,
            "depthFormat": "Meters", "colors": self.colors, "currentTime": 0.0,
            "actionReturn": self.returned,
        }  # fmt: skip
        return {"agents": [agent], "thirdPartyCameras": [], "sequenceId": sequence,
                "activeAgentId": 0}  # fmt: skip

    def _object(self, t: Thing) -> dict[str, Any]:
        chain: list[str] = []
        parent = t.parent
        while parent is not None:
            chain.insert(0, parent)
            parent = self.things[parent].parent
        inside = [c.id for c in self._contents(t)] if t.is_("receptacle") else None
        says = t.states.get
        return {
            "name": t.id, "objectId": t.id, "objectType": t.type, "position": _xyz(
                (t.centre[0], t.low[1], t.centre[2])),
            "rotation": _xyz((0, 0, 0)), "visible": t.id in self.visible,
            "isInteractable": t.id in self.visible, "receptacle": t.is_("receptacle"),
            "toggleable": t.is_("toggleable"), "isToggled": bool(says("isToggled")),
            "breakable": t.is_("breakable"), "isBroken": bool(says("isBroken")),
            "canFillWithLiquid": t.is_("fillable"),
            "isFilledWithLiquid": bool(says("isFilledWithLiquid")),
            "fillLiquid": says("fillLiquid"), "dirtyable": t.is_("dirtyable"),
            "isDirty": bool(says("isDirty")), "cookable": t.is_("cookable"),
            "isCooked": bool(says("isCooked")), "temperature": says("temperature", "RoomTemp"),
            "isHeatSource": t.type in _HEATERS, "isColdSource": t.is_("cold"),
            "sliceable": t.is_("sliceable"), "isSliced": bool(says("isSliced")),
            "openable": t.is_("openable"), "isOpen": bool(says("isOpen")),
            "pickupable": t.is_("pickupable"), "isPickedUp": t.id == self.held,
            "moveable": t.is_("moveable"), "receptacleObjectIds": inside,
            "parentReceptacles": chain or None,
            "controlledObjects": None if t.controls is None else [t.controls],
            "axisAlignedBoundingBox": {"center": _xyz(t.centre), "size": _xyz(t.size)},
            "objectOrientedBoundingBox": None,
        }  # fmt: skip

    def _ground(self) -> dict[str, Any]:
        floor = make("Statue", 0.0, 0.0)
        floor.id, floor.type, floor.flags = "Floor|+00.00|+00.00|+00.00", "Floor", frozenset()
        floor.centre, floor.size = (0.0, -0.05, 0.0), (4.4, 0.1, 4.4)
        lying = [t.id for t in self.things.values() if t.parent is None and t.low[1] < 0.01]
        return self._object(floor) | {"receptacle": True, "receptacleObjectIds": lying}


def _xyz(v: tuple[float, float, float]) -> dict[str, float]:
    return {"x": float(v[0]), "y": float(v[1]), "z": float(v[2])}
