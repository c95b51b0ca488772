"""Observations and scenes in memory, damaged, and handed to a monitor.

Some damage leaves nothing that may be believed: after it the answer "proceed" is wrong. That is
said here, from what was done to the input, and from nothing that the program finds out.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import fields, replace
from functools import cache
from random import Random
from typing import Any

import numpy as np

from forestall import Monitor
from forestall.types.decision import Outcome
from forestall.types.observation import Frame, GripperState, Intrinsics, Observation
from stranger import GRASP, TWELVE
from stranger import scene as stranger_scene

from . import mutate, scene

WRONG = "wrong proceed"
PEG = "peg-1"

Change = Callable[[dict[str, Any], Random], None]
"""What is done to the fields of a frame."""

NUMBERS = (0.0, -1.0, 1e-300, 1e-30, 1e30, 1e300, float("nan"), float("inf"), -float("inf"))


def _all(name: str, value: Any, kind: str = "float32") -> Change:
    def change(frame: dict[str, Any], rng: Random) -> None:
        frame[name] = np.full_like(frame[name], value, dtype=kind)

    return change


def _camera(**values: float) -> Change:
    def change(frame: dict[str, Any], rng: Random) -> None:
        frame["intrinsics"] = replace(frame["intrinsics"], **values)

    return change


def _pose(matrix: Any) -> Change:
    def change(frame: dict[str, Any], rng: Random) -> None:
        pose = np.array(frame["camera_to_world"], dtype=float)
        frame["camera_to_world"] = matrix(pose) if callable(matrix) else np.array(matrix, float)

    return change


def _without(frame: dict[str, Any], rng: Random) -> None:
    frame["detections"] = tuple(d for d in frame["detections"] if d.instance != scene.ARGUMENT)


def _shifted(frame: dict[str, Any], rng: Random) -> None:
    by, axis = rng.choice((-20, -15, 15, 20)), rng.choice((0, 1))
    frame["detections"] = tuple(
        replace(d, mask=np.roll(d.mask, by, axis=axis)) for d in frame["detections"]
    )


def _unsure(frame: dict[str, Any], rng: Random) -> None:
    frame["detections"] = tuple(replace(d, score=0.0) for d in frame["detections"])


def _upside_down(frame: dict[str, Any], rng: Random) -> None:
    frame["depth_m"] = np.ascontiguousarray(frame["depth_m"][::-1])


def _far(pose: Any) -> Any:
    pose[:3, 3] = 1e300
    return pose


BROKEN: dict[str, Change] = {
    "no detection": lambda f, rng: f.update(detections=()),
    "argument not seen": _without,
    "depth zero": _all("depth_m", 0.0),
    "depth constant": _all("depth_m", 1.0),
    "depth NaN": _all("depth_m", np.nan),
    "depth infinite": _all("depth_m", np.inf),
    "depth huge": _all("depth_m", 1e30),
    "depth in millimetres": lambda f, rng: f.update(depth_m=f["depth_m"] * np.float32(1000)),
    "depth upside down": _upside_down,
    "focal length huge": _camera(fx=1e300, fy=1e300),
    "focal length tiny": _camera(fx=1e-300, fy=1e-300),
    "focal length NaN": _camera(fx=float("nan")),
    "principal point outside": _camera(cx=1e6),
    "identity pose": _pose(np.eye(4)),
    "camera far off": _pose(_far),
    "pose of zeros": _pose(np.zeros((4, 4))),
    "pose of NaN": _pose(np.full((4, 4), np.nan)),
    "mirrored pose": _pose(lambda p: p @ np.diag([-1.0, 1.0, 1.0, 1.0])),
    "masks shifted": _shifted,
    "masks upside down": lambda f, rng: f.update(
        detections=tuple(
            replace(d, mask=np.ascontiguousarray(d.mask[::-1])) for d in f["detections"]
        )
    ),
    "every confidence zero": _unsure,
}
"""Damage after which nothing may be believed."""

ARRAYS = ("rgb", "depth_m", "camera_to_world", "detections", "instance_ids", "intrinsics")
KINDS = (
    "float32",
    "float64",
    "float16",
    "uint8",
    "uint16",
    "int64",
    "bool",
    "complex64",
    "U3",
    "O",
)
_SIZE = (scene.ROWS, scene.COLUMNS)
SHAPES: tuple[tuple[int, ...], ...] = (
    (), (0,), (1,), _SIZE, _SIZE[::-1], (*_SIZE, 3), (*_SIZE, 4), (*_SIZE, 1), (4, 4), (3, 4),
    (0, 0), (0, 0, 3), (2, *_SIZE),
)  # fmt: skip


def observation(rng: Random) -> tuple[str, Callable[[], Observation], bool]:
    """What was done, what makes the observation, and whether it can be believed no more."""
    if rng.random() < 0.4:
        name = rng.choice(sorted(BROKEN))
        return name, lambda: _made(BROKEN[name], rng), True
    name = rng.choice((*ARRAYS, "mask", "gripper", "time_s", "robot_position_world_m", "frames"))
    return name, lambda: _made_odd(name, rng), False


def _made(change: Change, rng: Random) -> Observation:
    seen = scene.with_masks(scene.observation())
    frame = {f.name: getattr(seen.frames[0], f.name) for f in fields(Frame)}
    change(frame, rng)
    return replace(seen, frames=(Frame(**frame),))


def _odd(rng: Random) -> Any:
    """Something that is no array of the right sort, or anything at all."""
    if rng.random() < 0.3:
        return mutate.value(rng)
    array = np.full(rng.choice(SHAPES), rng.choice((0, 1, 2, 200)), dtype=rng.choice(KINDS))
    if array.dtype.kind == "f" and array.size and rng.random() < 0.5:
        array.flat[rng.randrange(array.size)] = rng.choice(NUMBERS)
    return array


def _made_odd(name: str, rng: Random) -> Observation:
    seen: Any = scene.with_masks(scene.observation())
    if name == "frames":
        several: Any = ((), None, (None,), seen.frames * 3, [seen.frames])
        return _as_seen(replace(seen, frames=rng.choice(several)))
    if name == "gripper":
        hand: Any = rng.choice((None, "Plate-1", "", 7, "no-1", "Plate", mutate.value(rng)))
        where: Any = rng.choice(
            (seen.gripper.position_world_m, (rng.choice(NUMBERS),) * 3, (), None)
        )
        return _as_seen(replace(seen, gripper=GripperState(hand, where, mutate.value(rng))))
    if name == "time_s":
        return _as_seen(replace(seen, time_s=rng.choice((*NUMBERS, mutate.value(rng)))))
    if name == "robot_position_world_m":
        places: Any = ((rng.choice(NUMBERS),) * 3, (), 7)
        return _as_seen(replace(seen, robot_position_world_m=rng.choice(places)))
    frame = {f.name: getattr(seen.frames[0], f.name) for f in fields(Frame)}
    if name == "mask":
        first, *others = frame["detections"]
        frame["detections"] = (replace(first, mask=_odd(rng)), *others)
    elif name == "detections":
        first = frame["detections"][0]
        odd = {"category": mutate.value(rng), "instance": mutate.value(rng), "score": _odd(rng)}
        key = rng.choice(sorted(odd))
        frame["detections"] = (replace(first, **{key: odd[key]}), *frame["detections"][1:])
    elif name == "intrinsics":
        numbers: Any = [
            rng.choice((*NUMBERS, 80, 60, 39.5, -5, 10**6, None, "80")) for _ in range(6)
        ]
        frame["intrinsics"] = Intrinsics(*numbers)
    else:
        frame[name] = _odd(rng)
    return _as_seen(replace(seen, frames=(Frame(**frame),)))


def _as_seen(found: Any) -> Observation:
    assert isinstance(found, Observation)
    return found


def judge(given: tuple[str, Callable[[], Observation], bool]) -> str | None:
    """Have it judged before the plate is picked up."""
    _, make, broken = given
    decision = scene.monitor().before(make())
    return WRONG if broken and decision.outcome is Outcome.PROCEED else None


# --- scenes in a stranger's words -----------------------------------------------------------------


def dictionary(rng: Random) -> Any:
    """A scene as a dictionary, damaged."""
    found = stranger_scene()
    if rng.random() < 0.2:
        return _hide(found, rng)
    return mutate.tree(found, rng)


def _hide(found: dict[str, Any], rng: Random) -> dict[str, Any]:
    found = copy.deepcopy(found)
    if rng.random() < 0.5:
        found["objects"].pop(PEG)
        found["relations"] = [r for r in found["relations"] if PEG not in r]
    else:
        found["unseen"] = [PEG]
    return found


def check(given: Any) -> str | None:
    """Have it judged before the peg is grasped."""
    return judged_by(_monitor(), given)


def judged_by(monitor: Monitor, given: Any = None) -> str | None:
    """What a monitor says of a scene; it may not proceed without the peg."""
    seen = stranger_scene() if given is None else given
    decision = monitor.check(seen, GRASP)
    proceeds = decision.outcome is Outcome.PROCEED
    return WRONG if proceeds and not _has_peg(seen) else None


def _has_peg(seen: Any) -> bool:
    objects = seen.get("objects", ()) if isinstance(seen, dict) else ()
    unseen = seen.get("unseen") or () if isinstance(seen, dict) else ()
    return PEG in objects and PEG not in unseen


@cache
def _monitor() -> Monitor:
    return Monitor.from_demonstrations(TWELVE)
