"""What there is in the stand-in's kitchen: boxes with the flags and states of AI2-THOR's objects.

Facts and forms only; `box_kitchen` moves and changes them. Coordinates are AI2-THOR's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

Vec = tuple[float, float, float]

WALL_M = 0.015


@dataclass
class Thing:
    """One object. `centre` is that of its box; `front` is where a shell's door is."""

    id: str
    type: str
    centre: Vec
    size: Vec
    colour: tuple[int, int, int]
    form: str = (
        "solid"  # solid, bowl (open above), shell (a door in front), stand (a base and back)
    )
    front: tuple[int, int] = (0, -1)
    flags: frozenset[str] = frozenset()
    takes: frozenset[str] = frozenset()
    controls: str | None = None
    parent: str | None = None
    states: dict[str, Any] = field(default_factory=dict)

    def is_(self, flag: str) -> bool:
        return flag in self.flags

    @property
    def low(self) -> Vec:
        x, y, z = (c - s / 2 for c, s in zip(self.centre, self.size, strict=True))
        return (x, y, z)

    @property
    def high(self) -> Vec:
        x, y, z = (c + s / 2 for c, s in zip(self.centre, self.size, strict=True))
        return (x, y, z)

    def floor_y(self) -> float:
        """Where what it takes comes to rest."""
        if self.form == "stand":
            return self.low[1] + 0.03
        return self.high[1] if self.form == "solid" else self.low[1] + WALL_M

    def boxes(self) -> list[tuple[Vec, Vec, tuple[int, int, int]]]:
        """Low corner, high corner and colour of each box that it is made of."""
        (x0, y0, z0), (x1, y1, z1), w = self.low, self.high, WALL_M
        colour = self._shade()
        if self.form == "solid":
            return [(self.low, self.high, colour)]
        if self.form == "stand":
            fx, fz = self.front
            back = (
                (x0 if fx >= 0 else x1 - 0.08, y0, z0 if fz >= 0 else z1 - 0.08),
                (x0 + 0.08 if fx > 0 else x1, y1, z0 + 0.08 if fz > 0 else z1),
            )
            return [((x0, y0, z0), (x1, y0 + 0.03, z1), colour), (*back, colour)]
        bottom = ((x0, y0, z0), (x1, y0 + w, z1), colour)
        sides = {
            (-1, 0): ((x0, y0, z0), (x0 + w, y1, z1), colour),
            (1, 0): ((x1 - w, y0, z0), (x1, y1, z1), colour),
            (0, -1): ((x0, y0, z0), (x1, y1, z0 + w), colour),
            (0, 1): ((x0, y0, z1 - w), (x1, y1, z1), colour),
        }
        found = [bottom, *sides.values()]
        if self.form == "shell":
            found.append(((x0, y1 - w, z0), (x1, y1, z1), colour))
            if self.states.get("isOpen"):
                found.remove(sides[self.front])
        liquid = self.states.get("fillLiquid")
        if liquid:
            top = y0 + 0.6 * (y1 - y0)
            found.append(((x0 + w, y0 + w, z0 + w), (x1 - w, top, z1 - w), LIQUIDS[liquid]))
        return found

    def _shade(self) -> tuple[int, int, int]:
        r, g, b = self.colour
        if self.states.get("isDirty"):
            return (r // 2 + 40, g // 2 + 20, b // 2)
        if self.states.get("isCooked"):
            return (r * 2 // 3, g // 2, b // 3)
        if self.states.get("isToggled"):
            return (min(255, r + 60), g, b)
        return self.colour


LIQUIDS = {"water": (90, 140, 230), "coffee": (60, 35, 20), "wine": (110, 15, 40)}

FOOD = frozenset({"Potato", "Tomato", "Lettuce", "Apple", "Egg", "EggCracked", "PotatoSliced",
                  "TomatoSliced", "LettuceSliced", "AppleSliced", "BreadSliced"})  # fmt: skip
CROCKERY = frozenset({"Mug", "Cup", "Bowl", "Plate"})
EVERYTHING = FOOD | CROCKERY | {"Pot", "Pan", "Kettle", "Knife", "Bread", "WineBottle", "Book",
                                "RemoteControl", "CellPhone", "Laptop"}  # fmt: skip

KINDS: dict[str, dict[str, Any]] = {
    "Mug": {"size": (0.09, 0.10, 0.09), "colour": (40, 90, 190), "form": "bowl",
            "flags": "pickupable receptacle fillable dirtyable breakable", "takes": {"Egg"}},
    "Bowl": {"size": (0.20, 0.09, 0.20), "colour": (225, 200, 90), "form": "bowl",
             "flags": "pickupable receptacle fillable dirtyable breakable", "takes": FOOD},
    "Plate": {"size": (0.22, 0.02, 0.22), "colour": (240, 240, 245),
              "flags": "pickupable receptacle dirtyable breakable", "takes": FOOD},
    "Pot": {"size": (0.20, 0.13, 0.20), "colour": (130, 130, 140), "form": "bowl",
            "flags": "pickupable receptacle fillable dirtyable", "takes": FOOD},
    "Pan": {"size": (0.22, 0.05, 0.22), "colour": (60, 60, 65), "form": "bowl",
            "flags": "pickupable receptacle dirtyable", "takes": FOOD},
    "WineBottle": {"size": (0.08, 0.30, 0.08), "colour": (30, 70, 40),
                   "flags": "pickupable fillable breakable"},
    "Potato": {"size": (0.10, 0.065, 0.07), "colour": (190, 150, 90),
               "flags": "pickupable sliceable cookable"},
    "PotatoSliced": {"size": (0.06, 0.02, 0.055), "colour": (230, 215, 150),
                     "flags": "pickupable cookable"},
    "Tomato": {"size": (0.075, 0.065, 0.075), "colour": (210, 40, 30),
               "flags": "pickupable sliceable"},
    "TomatoSliced": {"size": (0.06, 0.02, 0.06), "colour": (220, 70, 50), "flags": "pickupable"},
    "Lettuce": {"size": (0.15, 0.12, 0.15), "colour": (90, 180, 70),
                "flags": "pickupable sliceable"},
    "LettuceSliced": {"size": (0.06, 0.02, 0.07), "colour": (150, 210, 110),
                      "flags": "pickupable"},
    "Laptop": {"size": (0.32, 0.03, 0.22), "colour": (60, 60, 70),
               "flags": "pickupable openable toggleable breakable"},
    "Bread": {"size": (0.24, 0.11, 0.11), "colour": (200, 150, 90),
              "flags": "pickupable sliceable"},
    "BreadSliced": {"size": (0.10, 0.02, 0.10), "colour": (240, 215, 160),
                    "flags": "pickupable cookable"},
    "Egg": {"size": (0.05, 0.06, 0.05), "colour": (240, 225, 205),
            "flags": "pickupable sliceable breakable"},
    "EggCracked": {"size": (0.10, 0.02, 0.10), "colour": (250, 220, 90),
                   "flags": "pickupable cookable"},
    "Knife": {"size": (0.28, 0.02, 0.04), "colour": (150, 155, 165), "flags": "pickupable"},
    "RemoteControl": {"size": (0.05, 0.025, 0.18), "colour": (30, 30, 35), "flags": "pickupable"},
    "HousePlant": {"size": (0.22, 0.40, 0.22), "colour": (40, 140, 50),
                   "flags": "fillable moveable"},
    "Television": {"size": (0.10, 0.50, 0.80), "colour": (25, 25, 30),
                   "flags": "toggleable moveable"},
    "TVStand": {"size": (0.45, 0.50, 1.00), "colour": (120, 85, 60), "flags": "receptacle",
                "takes": EVERYTHING},
    "CounterTop": {"size": (1.0, 0.90, 0.60), "colour": (170, 165, 155), "flags": "receptacle",
                   "takes": EVERYTHING},
    "DiningTable": {"size": (1.0, 0.75, 0.7), "colour": (150, 105, 70), "flags": "receptacle",
                    "takes": EVERYTHING},
    "Sink": {"size": (0.60, 0.90, 0.60), "colour": (185, 190, 195), "flags": ""},
    "SinkBasin": {"size": (0.50, 0.14, 0.44), "colour": (205, 210, 215), "form": "bowl",
                  "flags": "receptacle", "takes": EVERYTHING},
    "Faucet": {"size": (0.05, 0.25, 0.05), "colour": (215, 215, 225), "flags": "toggleable"},
    "Microwave": {"size": (0.52, 0.32, 0.42), "colour": (80, 80, 90), "form": "shell",
                  "flags": "receptacle openable toggleable moveable",
                  "takes": (FOOD | CROCKERY) - {"Lettuce"}},
    "Fridge": {"size": (0.60, 1.10, 0.70), "colour": (215, 220, 225), "form": "shell",
               "flags": "receptacle openable cold", "takes": EVERYTHING - {"Knife"}},
    "Toaster": {"size": (0.24, 0.19, 0.20), "colour": (190, 60, 55), "form": "bowl",
                "flags": "receptacle toggleable moveable", "takes": {"BreadSliced"}},
    "CoffeeMachine": {"size": (0.22, 0.34, 0.28), "colour": (45, 40, 45), "form": "stand",
                      "flags": "receptacle toggleable moveable", "takes": {"Mug", "Cup"}},
    "StoveBurner": {"size": (0.22, 0.03, 0.22), "colour": (30, 30, 30), "flags": "receptacle",
                    "takes": {"Pot", "Pan", "Kettle"}},
    "StoveKnob": {"size": (0.05, 0.05, 0.05), "colour": (90, 90, 95), "flags": "toggleable"},
    "Statue": {"size": (0.08, 0.20, 0.08), "colour": (120, 160, 150), "flags": "pickupable"},
}  # fmt: skip

FLOOR_Y = 0.0


def make(kind: str, x: float, z: float, y: float | None = None, **more: Any) -> Thing:
    """A thing that stands at a place; `y` is where it rests, the floor by default."""
    about = KINDS[kind]
    size = more.pop("size", about["size"])
    rests = FLOOR_Y if y is None else y
    centre = (x, rests + size[1] / 2, z)
    name = more.pop("id", f"{kind}|{x:+06.2f}|{rests:+06.2f}|{z:+06.2f}")
    flags = frozenset(about["flags"].split())
    return Thing(
        name, kind, centre, size, about["colour"], about.get("form", "solid"),
        more.pop("front", (0, -1)), flags, frozenset(about.get("takes", ())), **more,
    )  # fmt: skip


def kitchen() -> list[Thing]:
    """Furniture along the walls of a room of 4.4 m by 4.4 m, and what stands on it."""
    left = make("CounterTop", -1.25, 1.90, size=(1.90, 0.90, 0.60))
    right = make("CounterTop", 1.30, 1.90, size=(1.80, 0.90, 0.60))
    stove = make("CounterTop", -1.90, -0.50, size=(0.60, 0.90, 1.40))
    table = make("DiningTable", 0.30, -1.60)
    stand = make("TVStand", 1.95, -0.40)
    sink = make("Sink", 0.05, 1.90)
    basin = make("SinkBasin", 0.05, 1.84, 0.90, id=f"{sink.id}|SinkBasin")
    burners = [make("StoveBurner", x, z, 0.90) for x in (-1.75, -2.02) for z in (-0.85, -0.30)]
    knobs = [
        make("StoveKnob", -1.57, z, 0.80, controls=b.id)
        for b, z in zip(burners, (-0.20, -0.40, -0.60, -0.80), strict=True)
    ]
    fridge = make("Fridge", 1.85, 0.75, 0.45, front=(-1, 0))
    microwave = make("Microwave", 1.75, 1.92, 0.90, parent=right.id)
    machine = make("CoffeeMachine", -1.95, 1.95, 0.90, parent=left.id)
    toaster = make("Toaster", -1.55, 1.95, 0.90, parent=left.id)
    top: dict[str, Any] = {"y": 0.90, "parent": left.id}
    other: dict[str, Any] = {"y": 0.90, "parent": right.id}
    on_table: dict[str, Any] = {"y": 0.75, "parent": table.id}
    pan = make("Pan", -1.75, -0.85, 0.93, parent=burners[0].id)
    found = [
        left, right, stove, table, stand, sink, basin, *burners, *knobs, fridge, microwave,
        machine, toaster, make("Faucet", 0.05, 2.13, 0.90), pan,
        make("Plate", 0.65, 1.80, **other), make("Potato", 1.00, 1.75, **other),
        make("Bowl", 1.30, 1.80, **other),
        make("Mug", -1.20, 1.75, **top), make("Knife", -0.85, 1.72, **top),
        make("Bread", -0.85, 1.95, **top), make("Egg", -0.42, 1.72, **top),
        make("Pot", -0.60, 2.02, **top),
        make("WineBottle", 0.00, -1.55, **on_table), make("HousePlant", 0.60, -1.60, **on_table),
        make("Statue", 0.25, -1.75, **on_table), make("Lettuce", -0.05, -1.80, **on_table),
        make("Laptop", 1.90, -0.10, 0.50, parent=stand.id),
        make("Tomato", 1.85, 0.75, fridge.floor_y(), parent=fridge.id),
        make("Television", 1.98, -0.40, 0.50, parent=stand.id),
        make("RemoteControl", 1.80, -0.75, 0.50, parent=stand.id),
    ]  # fmt: skip
    for thing in found:
        if thing.type == "WineBottle":
            thing.states.update(isFilledWithLiquid=True, fillLiquid="wine")
    return found


WALLS: tuple[tuple[Vec, Vec], ...] = (
    ((-2.3, 0.0, 2.2), (2.3, 2.6, 2.3)),
    ((-2.3, 0.0, -2.3), (2.3, 2.6, -2.2)),
    ((-2.3, 0.0, -2.2), (-2.2, 2.6, 2.2)),
    ((2.2, 0.0, -2.2), (2.3, 2.6, 2.2)),
)
FLOOR: tuple[Vec, Vec] = ((-2.2, -0.1, -2.2), (2.2, 0.0, 2.2))
