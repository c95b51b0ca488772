"""Writes small episodes in RoboFail's layout: the stand-in's kitchen, driven as REFLECT's robot is.

Events are real pickles, of classes with the attributes and the names of the package's own.
"""

from __future__ import annotations

import json
import math
import pickle
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).with_name("standin")))

from box_kitchen import Kitchen
from things import Thing

SIZE = 160
MODULE = "ai2thor.server"
NUMBERED = ("CounterTop", "StoveBurner", "Cabinet", "Faucet", "Sink")

BOIL_WATER = (
    "(navigate_to_obj, Pot)",
    "(pick_up, Pot)",
    "(navigate_to_obj, Sink)",
    "(put_in, Pot, SinkBasin)",
    "(toggle_on, Faucet)",
    "(toggle_off, Faucet)",
    "(pick_up, Pot)",
    "(navigate_to_obj, StoveBurner-4)",
    "(put_on, Pot, StoveBurner-4)",
    "(toggle_on, StoveBurner-4)",
)


class MetadataWrapper(dict[str, Any]):
    """The package's; a dictionary."""


class _Lazy:
    def __init__(self, **said: Any) -> None:
        self.__dict__.update(said)


class LazyInstanceSegmentationMasks(_Lazy):
    """The package's: a picture of ids and a colour for each."""


class LazyClassSegmentationMasks(_Lazy):
    """The package's."""


class LazyInstanceDetections2D(_Lazy):
    """The package's."""


class LazyClassDetections2D(_Lazy):
    """The package's."""


class Event(_Lazy):
    """The package's."""


CLASSES = (
    Event, MetadataWrapper, LazyInstanceSegmentationMasks, LazyClassSegmentationMasks,
    LazyInstanceDetections2D, LazyClassDetections2D,
)  # fmt: skip


@contextmanager
def named_as_the_package() -> Iterator[None]:
    """While a pickle is written, the classes above are found where it will say that they are."""
    module, real = ModuleType(MODULE), {n: sys.modules.get(n) for n in ("ai2thor", MODULE)}
    for each in CLASSES:
        each.__module__ = MODULE
        setattr(module, each.__name__, each)
    sys.modules["ai2thor"], sys.modules[MODULE] = real["ai2thor"] or ModuleType("ai2thor"), module
    try:
        yield
    finally:
        for name, was in real.items():
            sys.modules.pop(name)
            if was is not None:
                sys.modules[name] = was


def event_of(kitchen: Kitchen) -> Event:
    """What the package would have made of the kitchen's answer."""
    about = MetadataWrapper(kitchen.metadata(1)["agents"][0])
    colours = {c["name"]: c["color"] for c in about["colors"]}
    ids = np.ascontiguousarray(kitchen.ids)
    masks = LazyInstanceSegmentationMasks(
        _masks={},
        _loaded=False,
        _unique_integer_keys=None,
        _empty_mask=None,
        instance_segmentation_frame_uint32=ids.view(np.uint32).squeeze(),
        _alpha_channel_value=255,
        instance_colors={n: c for n, c in colours.items() if "|" in n},
        class_colors={},
    )
    rgba = np.dstack([kitchen.rgb, np.full(kitchen.rgb.shape[:2], 255, np.uint8)])
    event = Event(
        metadata=about,
        screen_width=SIZE,
        screen_height=SIZE,
        frame=rgba[:, :, :3],
        depth_frame=kitchen.depth,
        normals_frame=None,
        color_to_object_id={tuple(c): n for n, c in colours.items()},
        object_id_to_color={n: tuple(c) for n, c in colours.items()},
        instance_masks=masks,
        instance_detections2D=LazyInstanceDetections2D(instance_masks=masks, _detections2d={}),
        class_masks=LazyClassSegmentationMasks(instance_masks=masks, _loaded=False, _masks={}),
        class_detections2D=LazyClassDetections2D(instance_masks=masks, _loaded=False),
        instance_segmentation_frame=ids[:, :, :3],
        third_party_camera_frames=[],
    )
    event.events = [event]  # type: ignore[attr-defined]
    return event


def at_start() -> Kitchen:
    """The stand-in's kitchen through the camera of REFLECT's robot."""
    kitchen = Kitchen(SIZE, SIZE)
    kitchen.step({"action": "Initialize", "fieldOfView": 60.0})
    return kitchen


@dataclass
class Robot:
    """REFLECT's robot: carries a plan out, and writes an event down for each second."""

    folder: Path
    start: tuple[float, float] = (0.0, 0.0)
    kitchen: Kitchen = field(default_factory=at_start)
    frames: int = 0
    acted: dict[int, str] = field(default_factory=dict)
    drove: dict[tuple[int, int], str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        x, z = self.start
        self.kitchen.step({"action": "Teleport", "position": {"x": x, "z": z}})
        (self.folder / "events").mkdir(parents=True)
        counts: dict[str, list[str]] = {}
        for thing in self.kitchen.things.values():
            counts.setdefault(thing.type, []).append(thing.id)
        several = {t: ids for t, ids in counts.items() if t in NUMBERED and len(ids) > 1}
        self.named = {i: f"{t}-{n}" for t, ids in several.items() for n, i in enumerate(ids, 1)}

    def run(self, plan: Sequence[str], nothing: int = -1, drops: int = -1) -> None:
        """Carry a plan out; one step does nothing, or the hand opens on one drive."""
        for number, text in enumerate(plan):
            skill, *args = (part.strip("() ") for part in text.split(","))
            if skill == "navigate_to_obj":
                self.drive(args[0], drops=number == drops)
            else:
                self.act(skill, args, fails=number == nothing)
        for _ in range(2):
            self.kitchen.step({"action": "Done"})
            self.save()

    def save(self) -> None:
        """One second."""
        self.frames += 1
        path = self.folder / "events" / f"step_{self.frames}.pickle"
        with named_as_the_package(), path.open("wb") as file:
            pickle.dump(event_of(self.kitchen), file, protocol=pickle.HIGHEST_PROTOCOL)

    def drive(self, name: str, drops: bool = False) -> None:
        """To the free place that is nearest to a thing."""
        thing, first = self.thing(name), self.frames + 1
        self.save()
        if drops:
            self.kitchen.step({"action": "DropHandObject"})
        free = self.kitchen.do_GetReachablePositions({})
        x, _, z = thing.centre
        near = min(free, key=lambda p: math.hypot(p["x"] - x, p["z"] - z))
        self.kitchen.step({"action": "Teleport", "position": near})
        self.save()
        self.look_at(thing)
        self.drove[first, self.frames] = f"Move to {name.lower()}"
        self.kitchen.step({"action": "Done"})

    def look_at(self, thing: Thing) -> None:
        """Turn, then tilt the camera: two seconds."""
        (x, y, z), (cx, cy, cz) = self.kitchen.place, thing.centre
        yaw = math.degrees(math.atan2(cx - x, cz - z))
        down = math.degrees(math.atan2(y + 0.675 - cy, math.hypot(cx - x, cz - z)))
        self.kitchen.step({"action": "Teleport", "rotation": {"y": yaw}, "forceAction": True})
        self.save()
        horizon = min(60.0, max(-30.0, down))
        self.kitchen.step({"action": "Teleport", "horizon": horizon, "forceAction": True})
        self.kitchen.last = "LookDown"
        self.save()

    def act(self, skill: str, args: Sequence[str], fails: bool = False) -> None:
        """Look, do it, and write down the second in which it was done."""
        kitchen, target = self.kitchen, args[-1]
        held = skill in ("put_in", "put_on") and kitchen.held is None
        if not fails and not held:
            self.look_at(self.thing(target))
            about = {"objectId": self.id(skill, target), "forceAction": True}
            if skill == "pour":
                liquid = self.thing(args[0]).states.get("fillLiquid", "water")
                source = {"objectId": self.thing(args[0]).id, "forceAction": True}
                kitchen.step({"action": "EmptyLiquidFromObject", **source})
                kitchen.step({"action": "FillObjectWithLiquid", "fillLiquid": liquid, **about})
            else:
                kitchen.step({"action": ACTIONS[skill], **about})
        self.save()
        if skill in WORDS:
            self.acted[self.frames] = WORDS[skill].format(*(a.lower() for a in args))
        kitchen.step({"action": "Done"})

    def thing(self, name: str) -> Thing:
        """The first thing of a type, or the one that a name means."""
        own = next((i for i, n in self.named.items() if n == name), None)
        things = self.kitchen.things
        return things[own] if own else next(t for t in things.values() if t.type == name)

    def id(self, skill: str, name: str) -> str:
        """Of what an action is for: the knob of a burner, the basin of a sink."""
        thing = self.thing("SinkBasin" if name == "Sink" else name)
        knobs = [t.id for t in self.kitchen.things.values() if t.controls == thing.id]
        return knobs[0] if skill.startswith("toggle") and knobs else thing.id


ACTIONS = {
    "pick_up": "PickupObject", "put_in": "PutObject", "put_on": "PutObject",
    "toggle_on": "ToggleObjectOn", "toggle_off": "ToggleObjectOff", "open_obj": "OpenObject",
    "close_obj": "CloseObject", "slice_obj": "SliceObject",
}  # fmt: skip
WORDS = {
    "pick_up": "Pick up {}", "put_in": "Put {} inside {}", "put_on": "Put {} on {}",
    "toggle_on": "Toggle on {}", "toggle_off": "Toggle off {}", "open_obj": "Open {}",
    "close_obj": "Close {}", "slice_obj": "Slice {}",
}  # fmt: skip
"""What REFLECT writes of each; it writes nothing of pouring."""


def write_episode(
    root: Path,
    name: str,
    plan: Sequence[str] = BOIL_WATER,
    *,
    nothing: int = -1,
    drops: int = -1,
    start: tuple[float, float] = (0.0, 0.0),
    step: Any = "00:00",
    reason: str = "No failure added",
    **more: Any,
) -> Robot:
    """An episode `<task>/<task>-<n>` with everything that is read of one.

    Args:
        root: of the data set.
        name: of the episode, "boilWater-3".
        plan: what is carried out.
        nothing: index of a step that does nothing.
        drops: index of a drive on which the hand opens.
        start: where the robot stands, x and z.
        step: what `gt_failure_step` says.
        reason: what `gt_failure_reason` says.
        more: further entries of task.json.
    """
    folder = root / name.rpartition("-")[0] / name
    robot = Robot(folder, start)
    robot.run(plan, nothing, drops)
    for file, said in (("interact", robot.acted), ("nav", robot.drove)):
        with (folder / f"{file}_actions.pickle").open("wb") as out:
            pickle.dump(said, out, protocol=pickle.HIGHEST_PROTOCOL)
    about = {
        "name": "boil water",
        "task_idx": 1,
        "scene": "FloorPlan1",
        "actions": list(plan),
        "success_condition": "a pot of water on a burner that is on.",
        "unity_name_map": robot.named,
        "gt_failure_step": step,
        "gt_failure_reason": reason,
        **more,
    }
    (folder / "task.json").write_text(json.dumps(about))
    return robot
