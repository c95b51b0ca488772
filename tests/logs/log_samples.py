"""Small runs without a simulator: looks with everything that a log can keep."""

from dataclasses import dataclass

import numpy as np

from forestall.logs.writing import Executed, Head, LogWriter
from forestall.types.episode import SkillStatus
from forestall.types.observation import (
    Detection,
    Frame,
    GripperState,
    Intrinsics,
    Observation,
)
from forestall.types.plan import Subtask

WIDTH, HEIGHT = 16, 12
CAMERA = Intrinsics(WIDTH, HEIGHT, 20.5, 20.25, 7.5, 5.5)
HEAD = Head("one", "heat-potato", "kitchen-3", "A warm meal.", "household")
STEPS = ("navigate_to_obj(Potato)", "pick_up(Potato-1)", "put_on(Potato-1, Plate-1)")


def pose(turn: float = 0.0) -> np.ndarray:
    """A camera 1.4 m above the floor that looks ahead, turned about the vertical."""
    ahead = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    about = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    made = np.eye(4)
    made[:3, :3] = about @ ahead
    made[:3, 3] = (0.1, 0.2, 1.4)
    return made


def frame(seed: int, *, overlapping: bool = False, named: bool = True) -> Frame:
    """A picture of noise; two things in it, on one another if wanted."""
    random = np.random.default_rng(seed)
    rgb = random.integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)
    depth = random.uniform(0.5, 4.0, (HEIGHT, WIDTH)).astype(np.float32)
    depth[0, 0] = 0
    if overlapping:
        one, two = np.zeros((2, HEIGHT, WIDTH), np.bool_)
        one[2:8, 2:8], two[5:11, 5:11] = True, True
        found = (
            Detection("Plate", one, "Plate-1" if named else None, 0.75),
            Detection("Potato", two, "Potato-1" if named else None, 0.5),
        )
        return Frame(rgb, depth, CAMERA, pose(seed / 7), detections=found)
    ids = np.full((HEIGHT, WIDTH), -1, np.int32)
    ids[1:5, 1:5], ids[6:9, 9:14] = 1, 0
    return Frame(rgb, depth, CAMERA, pose(seed / 7), ids, ("Potato-1", "Plate-1"))


def observation(seed: int, time_s: float, frames: int = 1, **how: bool) -> Observation:
    """A look with every field of a hand that a robot may tell."""
    hand = GripperState(
        "Plate-1" if seed % 2 else None,
        (0.3, 0.1 * seed, 1.0 / 3.0),
        "Potato-1" if seed > 1 else None,
        (0.7, 0.1, 0.9) if seed > 1 else None,
        width_m=0.04 if seed == 2 else None,
    )
    return Observation(
        tuple(frame(seed * 10 + n, **how) for n in range(frames)),
        hand,
        time_s,
        (0.1, 0.2 / 3, 0.0),
        others=(GripperState(None, (0.0, 0.5, 1.0), name="left"),) if seed == 3 else (),
        told=(("Potato-1", (1.0, 2.0, 0.5)),) if seed == 3 else (),
    )


@dataclass(frozen=True)
class Run:
    """What a writer is told: looks, and what was carried out after each of them."""

    looks: tuple[Observation, ...]
    done: tuple[tuple[Executed, ...], ...]


def run(
    statuses: tuple[SkillStatus, ...] = (SkillStatus.SUCCEEDED,) * 3,
    looked_at_end: bool = True,
    **how: bool,
) -> Run:
    """A look around, one before each of three steps, and one at the end."""
    looks = [observation(0, 0.0, 3, **how)]
    looks += [observation(n, 0.1 + 2.3 * (n - 1), 1 + n % 2, **how) for n in range(1, 5)]
    done: list[tuple[Executed, ...]] = [()]
    done += [
        (Executed(Subtask.parse(text), status, "" if status is SkillStatus.SUCCEEDED else "stuck"),)
        for text, status in zip(STEPS, statuses, strict=True)
    ]
    if not looked_at_end:
        looks.pop()
        return Run(tuple(looks), tuple(done))
    return Run(tuple(looks), (*done, ()))


def write(writer: LogWriter, told: Run, success: bool | None = True, why: str = "") -> None:
    """Tell a writer of a run, as the episode loop does."""
    writer.begin(HEAD)
    for look, done in zip(told.looks, told.done, strict=True):
        writer.look(look)
        for executed in done:
            writer.executed(executed)
    writer.finish(success, why)
