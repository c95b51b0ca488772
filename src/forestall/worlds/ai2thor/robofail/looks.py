"""An episode look by look, in our frame and names: one event in memory at a time.

Called by `dataset`; calls `events`, and what the world of AI2-THOR turns its events into ours with.
States are those of the metadata, of things that show: REFLECT's own perception takes them, too.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from forestall.domain.model import Domain
from forestall.errors import FileFormatError, ForestallError
from forestall.types.facts import category_of
from forestall.types.observation import Detection, Frame, GripperState, Observation
from forestall.types.recorded import Look
from forestall.worlds.ai2thor.frames import frame_from_event, point_from_thor
from forestall.worlds.ai2thor.naming import Names
from forestall.worlds.ai2thor.robofail.events import StoredEvent, read_event
from forestall.worlds.ai2thor.robofail.layout import DRIVES, Episode
from forestall.worlds.ai2thor.scene import Scene

_ACTS = frozenset(
    ("PickupObject", "PutObject", "OpenObject", "CloseObject", "ToggleObjectOn", "ToggleObjectOff",
     "SliceObject", "BreakObject", "DropHandObject", "PlaceObjectAtPoint", "MoveHeldObjectAhead",
     "FillObjectWithLiquid", "EmptyLiquidFromObject", "CleanObject", "DirtyObject", "CookObject")
)  # fmt: skip
"""What changes a thing; the rest moves the robot or its camera."""


_UNLISTED = {"pour": frozenset(("FillObjectWithLiquid", "EmptyLiquidFromObject"))}
"""Skills that REFLECT's lists of actions leave out, and what an event of theirs did last."""


@dataclass(frozen=True, slots=True)
class Span:
    """The frames of one step.

    Args:
        step: of the plan, from 0.
        first: its first frame.
        last: its last one; before the first for a step that the lists of actions do not have.
        drives: whether it only drives.
        shown_by: what an event of a step did last that is in no list, empty for one that is.
    """

    step: int
    first: int
    last: int
    drives: bool = False
    shown_by: frozenset[str] = frozenset()

    @property
    def listed(self) -> bool:
        """Whether it has frames."""
        return self.last >= self.first


def spans_of(episode: Episode) -> tuple[tuple[Span, ...], tuple[str, ...]]:
    """Which frames belong to which step, and what of the lists of actions fits no step.

    Steps and list are brought together in their order, by skill.
    """
    acts = [i for i, step in enumerate(episode.plan) if step.skill != DRIVES]
    steps = [_listed_as(episode.plan.subtasks[i].skill) for i in acts]
    listed = [skill for _, skill in episode.acted]
    frames = {acts[i]: episode.acted[k][0] for i, k in _paired(steps, listed)}
    found: list[Span] = []
    last = 0
    for number, step in enumerate(episode.plan):
        if step.skill == DRIVES:
            end = min((f for i, f in frames.items() if i > number), default=episode.frames)
            own = next((d for d in episode.drove if last < d[0] <= end), (last + 1, last))
            found.append(Span(number, *own, drives=True))
            last = own[1]
        elif number in frames:
            found.append(Span(number, min(last + 1, frames[number]), frames[number]))
            last = frames[number]
        else:
            shown_by = _UNLISTED.get(step.skill, frozenset())
            found.append(Span(number, last + 1, last, shown_by=shown_by))
    return tuple(found), tuple(_unmatched(episode, frames))


def _paired(one: Sequence[str], other: Sequence[str]) -> Iterator[tuple[int, int]]:
    """The longest common subsequence, as indices of both."""
    best = np.zeros((len(one) + 1, len(other) + 1), dtype=int)
    for i in reversed(range(len(one))):
        for k in reversed(range(len(other))):
            same = 1 + best[i + 1, k + 1] if one[i] == other[k] else 0
            best[i, k] = max(same, best[i + 1, k], best[i, k + 1])
    i = k = 0
    while i < len(one) and k < len(other):
        if one[i] == other[k] and best[i, k] == 1 + best[i + 1, k + 1]:
            yield i, k
            i, k = i + 1, k + 1
        elif best[i + 1, k] == best[i, k]:
            i += 1
        else:
            k += 1


def _unmatched(episode: Episode, frames: Mapping[int, int]) -> Iterator[str]:
    for number, step in enumerate(episode.plan):
        if step.skill not in (DRIVES, *_UNLISTED) and number not in frames:
            yield f"step {number + 1}, {step}, is not in its list of actions"
    used = set(frames.values())
    for frame, skill in episode.acted:
        if frame not in used:
            yield f"{skill} at frame {frame} is no step of its plan"


def step_at(spans: Sequence[Span], second: int) -> int:
    """The step that a second falls into; the last one for a later second."""
    return next((s.step for s in spans if s.listed and s.last >= second), spans[-1].step)


def looks_of(episode: Episode, spans: Sequence[Span], domain: Domain) -> Iterator[Look]:
    """Everything that was seen, one event after the other.

    Raises:
        FileFormatError: an event that cannot be read or cannot be what AI2-THOR gives.
    """
    waiting = deque(spans)
    names: Names | None = None
    for number in range(1, episode.frames + 1):
        path = episode.event(number)
        event = read_event(path)
        try:
            names = names or _names(event.metadata, episode.named)
            scene = Scene(event.metadata, names, domain)
            before, done = _begun(waiting, number, str(event.metadata["lastAction"]))
            seen = _observation(event, scene, names, float(number))
        except FileFormatError:
            raise
        except (ForestallError, KeyError, TypeError, ValueError, AttributeError) as error:
            raise FileFormatError(f"{path}: what this event says cannot be: {error!r}") from error
        yield Look(seen, before, done, bool(event.metadata.get("lastActionSuccess", True)))


def _begun(waiting: deque[Span], frame: int, action: str) -> tuple[tuple[int, ...], int | None]:
    """The steps that begin with a frame, taken off those that wait, and which one it shows done."""
    before: list[int] = []
    done: int | None = None
    while waiting and _begins(waiting, frame, action):
        span = waiting.popleft()
        before.append(span.step)
        done = done if span.drives else span.step
        if action in span.shown_by:
            break
    return tuple(before), done


def _begins(waiting: deque[Span], frame: int, action: str) -> bool:
    """Whether the next step begins with a frame.

    A drive begins with its first one, an act with what it changed, and one that is in no list with
    what shows it, or with the step after it.
    """
    span = waiting[0]
    if frame < span.first:
        return False
    if span.drives:
        return True
    if span.listed:
        return frame >= span.last or action in _ACTS
    following = next((s for s in list(waiting)[1:] if s.listed), None)
    after = following is not None and _begins(deque((following,)), frame, action)
    return action in span.shown_by or after


def _listed_as(skill: str) -> str:
    """As the list of actions says it: put is one skill there."""
    return "put" if skill in ("put_on", "put_in") else skill


def _names(about: Mapping[str, Any], named: Mapping[str, str]) -> Names:
    ids = {str(t["name"]): str(t["objectId"]) for t in about["objects"]}
    return Names(about["objects"], {ours: ids[n] for n, ours in named.items() if n in ids})


def _observation(event: StoredEvent, scene: Scene, names: Names, time_s: float) -> Observation:
    about = event.metadata

    def shown(object_id: str) -> str | None:
        name = names.name(object_id)
        return name if name in scene.things else None

    frame = frame_from_event(event, shown)
    x, y, _ = point_from_thor(about["agent"]["position"])
    hand = (about.get("heldObjectPose") or {}).get("position") or about["cameraPosition"]
    return Observation(
        frames=(_detected(frame, scene),),
        gripper=GripperState(scene.held, point_from_thor(hand)),
        time_s=time_s,
        robot_position_world_m=(x, y, 0.0),
    )


def _detected(frame: Frame, scene: Scene) -> Frame:
    """The frame with a mask for each thing, which knows the thing's states."""
    ids = frame.instance_ids
    assert ids is not None, "it was made of masks"
    there = np.unique(ids)
    detections = tuple(
        Detection(
            category_of(frame.instance_names[i]),
            ids == i,
            frame.instance_names[i],
            states=tuple(scene.states(frame.instance_names[i]).items()),
        )
        for i in there[there >= 0].tolist()
    )
    return replace(frame, instance_ids=None, instance_names=(), detections=detections)
