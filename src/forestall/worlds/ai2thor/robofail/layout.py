"""RoboFail's folders: which episodes there are, what each was to do, and when it failed.

`<task>/<task>-<n>/` holds `task.json`, `events/step_<k>.pickle` with k from 1, one each second,
`interact_actions.pickle` {frame: text} and `nav_actions.pickle` {(first, last): text}; pictures and
video beside them repeat what the events have. Called by `dataset`; calls `labels` and readers.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from forestall.errors import FileFormatError, InputError
from forestall.reading.documents import read_json
from forestall.reading.fields import Field
from forestall.reading.files import inside
from forestall.reading.pickles import read_pickle
from forestall.types.facts import category_of
from forestall.types.plan import Plan, Subtask
from forestall.worlds.ai2thor.naming import BASINS
from forestall.worlds.ai2thor.robofail.labels import failed_at

TASK_FILE, EVENTS = "task.json", "events"
DRIVES = "navigate_to_obj"

MOST_FRAMES = 5000
"""Of one episode; the longest published one has 231."""

MOST_ENTRIES = 20_000
"""What is looked at while episodes are looked for; an episode's own files are not among it."""

MOST_STEPS = 500
_DEPTH = 3
_STEP = re.compile(r"step_(\d{1,6})\.pickle")
_SKILLS: Mapping[str, str] = {
    "pick up": "pick_up", "put": "put", "toggle on": "toggle_on", "toggle off": "toggle_off",
    "open": "open_obj", "close": "close_obj", "slice": "slice_obj", "crack": "crack_obj",
    "pour": "pour",
}  # fmt: skip
"""How a text of `interact_actions` begins → the skill; one of the two that put is meant by both."""


@dataclass(frozen=True, slots=True)
class Episode:
    """One run on disk.

    Args:
        folder: of it.
        name: of the folder.
        task: of the folder around it, in our spelling ("make-coffee").
        scene: "FloorPlan16", or what stands there.
        plan: the steps that were carried out.
        frames: how many events.
        acted: (last frame, skill) of what the hand did, in order.
        drove: (first, last frame) of each drive, in order.
        named: Unity's name of a thing → the plan's.
        failure: first and last second, None for a run that went well.
        reason: in the data set's words.
        kind: what was done to make it fail, "" where that is not said.
    """

    folder: Path
    name: str
    task: str
    scene: str
    plan: Plan
    frames: int
    acted: tuple[tuple[int, str], ...]
    drove: tuple[tuple[int, int], ...]
    named: Mapping[str, str]
    failure: tuple[int, int] | None
    reason: str
    kind: str

    def event(self, frame: int) -> Path:
        """The file of a frame, from 1."""
        return inside(self.folder, f"{EVENTS}/step_{frame}.pickle")


def episode_folders(folder: Path) -> list[Path]:
    """Every folder with a `task.json`, at most three levels down, in order.

    Raises:
        FileFormatError: no such folder, none in it, or too much beside them.
    """
    if not folder.is_dir():
        raise FileFormatError(
            f"{folder} is no folder: unpack the data set, and name the folder with its tasks"
        )
    found: list[Path] = []
    looked = 0
    level = [folder]
    for _ in range(_DEPTH + 1):
        below: list[Path] = []
        for place in level:
            if (place / TASK_FILE).is_file():
                found.append(place)
                continue
            with os.scandir(place) as entries:
                for entry in entries:
                    looked += 1
                    if looked > MOST_ENTRIES:
                        raise FileFormatError(
                            f"{folder} has more than {MOST_ENTRIES} files and folders that belong "
                            "to no episode: name the folder that has the tasks"
                        )
                    if entry.is_dir(follow_symlinks=False):
                        below.append(Path(entry.path))
        level = below
    if not found:
        raise FileFormatError(f"{folder} has no episode: <task>/<task>-<n>/{TASK_FILE} is expected")
    return sorted(found, key=_in_order)


def read_episode(folder: Path) -> Episode:
    """What is said of one episode; its events are only counted.

    Raises:
        FileFormatError: something is missing or cannot be read as what it should be.
    """
    path = inside(folder, TASK_FILE)
    about = Field(read_json(path, "RoboFail task"))
    try:
        plan = Plan(tuple(_step(f) for f in about["actions"].at_most(MOST_STEPS, Field.text)))
        failure = failed_at(_plain(about, "gt_failure_step"), _plain(about, "gt_failure_reason"))
        scene = about["scene"].name()
        map_of = about.find("unity_name_map")
        named = {} if map_of is None else dict(map_of.pairs(Field.name))
        kind = about.optional("chosen_failure", Field.text) or ""
    except InputError as error:
        raise FileFormatError(f"{path}: {error}") from error
    if not plan.subtasks:
        raise FileFormatError(f"{path}: its plan has no step")
    frames = _count(folder)
    return Episode(
        folder,
        folder.name,
        _spelt(folder.parent.name),
        scene,
        plan,
        frames,
        _acted(folder, frames),
        _drove(folder, frames),
        named,
        failure,
        str(_plain(about, "gt_failure_reason")).strip(),
        kind.replace(" ", "_"),
    )


def _plain(about: Field, key: str) -> Any:
    found = about.find(key)
    return None if found is None else found.value


def _step(text: str) -> Subtask:
    said = Subtask.parse(text)
    return Subtask(said.skill, tuple(_whole(a) for a in said.args))


def _whole(name: str) -> str:
    """A basin is a part of its sink here."""
    kind = category_of(name)
    return BASINS.get(kind, kind) + name.removeprefix(kind)


def _spelt(task: str) -> str:
    """The name of a folder, "makeCoffee", as ours: "make-coffee"."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", task).casefold()


def _in_order(path: Path) -> list[Any]:
    parts = re.split(r"(\d+)", str(path))
    return [int(p) if p.isdigit() else p for p in parts]


def _count(folder: Path) -> int:
    """How many events, of which none is missing."""
    place = folder / EVENTS
    if not place.is_dir():
        raise FileFormatError(f"{place} is missing: the events of the episode")
    numbers: set[int] = set()
    with os.scandir(place) as entries:
        for entry in entries:
            if found := _STEP.fullmatch(entry.name):
                numbers.add(int(found[1]))
            if len(numbers) > MOST_FRAMES:
                raise FileFormatError(f"{place} has more than {MOST_FRAMES} events")
    missing = next((n for n in range(1, len(numbers) + 1) if n not in numbers), None)
    if not numbers or missing is not None:
        raise FileFormatError(f"{place}/step_{missing or 1}.pickle is missing")
    return len(numbers)


def _acted(folder: Path, frames: int) -> tuple[tuple[int, str], ...]:
    path = inside(folder, "interact_actions.pickle")
    found = []
    for frame, text in _entries(path):
        if type(frame) is not int or not 1 <= frame <= frames:
            raise FileFormatError(f"{path}: {frame!r} is no frame from 1 to {frames}")
        words = next((w for w in _SKILLS if text.casefold().startswith(w + " ")), None)
        if words is None:
            raise FileFormatError(f"{path}: {text[:60]!r} is no action of REFLECT's robot")
        found.append((frame, _SKILLS[words]))
    if len(found) > MOST_STEPS:
        raise FileFormatError(f"{path} has more than {MOST_STEPS} actions")
    return tuple(sorted(found))


def _drove(folder: Path, frames: int) -> tuple[tuple[int, int], ...]:
    path = inside(folder, "nav_actions.pickle")
    found = []
    for span, _ in _entries(path):
        if not isinstance(span, tuple) or len(span) != 2 or any(type(n) is not int for n in span):
            raise FileFormatError(f"{path}: {span!r} is no first and last frame")
        found.append((max(1, span[0]), min(frames, span[1])))
    return tuple(sorted(found))


def _entries(path: Path) -> Iterator[tuple[Any, str]]:
    said = read_pickle(path, "list of actions", most=2**20)
    if not isinstance(said, dict):
        raise FileFormatError(f"{path}: frames with texts are expected, not {type(said).__name__}")
    for frame, text in said.items():
        if not isinstance(text, str):
            raise FileFormatError(f"{path}: the action of {frame!r} is no text")
        yield frame, text
