"""Recorded runs of others, seen as a monitor sees: one look at a time, into graphs.

Called by `forestall import` and `bench detection --data`; calls a data set (`seams.DataSet`) and
`eyes`. Of a run the graphs before its steps are kept, never its pictures.
"""

from __future__ import annotations

import inspect
import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import forestall
from forestall.assembly.configuration import Given
from forestall.assembly.eyes import Eyes, eyes_for, of_stored
from forestall.assembly.registry import data_set
from forestall.assembly.tables import DATA_SETS
from forestall.domain.model import Domain
from forestall.errors import (
    FileFormatError,
    ForestallError,
    InputError,
    ObservationError,
    PerceptionError,
)
from forestall.files import replace_file
from forestall.kinds import DOMAIN
from forestall.memory.store import open_store
from forestall.seams.others import DataSet
from forestall.types.demonstration import Demonstration
from forestall.types.foreign import ForeignRun
from forestall.types.graph import SceneGraph
from forestall.types.observation import Frame, Observation
from forestall.types.plan import Subtask
from forestall.types.recorded import Look, ReadReport, RecordedRun, Unread

FAILED = "failed"
"""What makes a run fail of which nobody says it."""

MEMORY, LABELS, REPORT, FAILING = "memory.db", "failing.json", "report.json", "failing"

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, slots=True)
class SeenRun:
    """A recorded run and what was seen of it.

    Args:
        recorded: the run.
        run: its scenes, as far as its steps have one; whole for a good run.
    """

    recorded: RecordedRun
    run: ForeignRun

    @property
    def good(self) -> bool:
        """Whether it went well."""
        return self.recorded.fails is None


@dataclass(frozen=True, slots=True)
class OutlinedStep:
    """A step of a run that would be read: when it begins, what it is, how it is said to end."""

    time_s: float
    subtask: str
    ended: str


@dataclass(frozen=True, slots=True)
class Outline:
    """What would be read of a run, or why nothing.

    Args:
        name: of the run.
        task: what it was to do.
        fails: at which step, in words; "" for a good run.
        looks: how many.
        pictures: how many of which kind, in words.
        steps: that were carried out.
        left_out: what of it cannot be read.
        why_not: why it cannot be used at all.
    """

    name: str
    task: str = ""
    fails: str = ""
    looks: int = 0
    pictures: str = ""
    steps: tuple[OutlinedStep, ...] = ()
    left_out: tuple[str, ...] = ()
    why_not: str = ""


def _silent(done: int, total: int, what: str) -> None:
    """Nobody is told how far it is."""


@dataclass(frozen=True, slots=True)
class Opened:
    """A data set with the domain, the eyes and the parts that it is seen with."""

    data: DataSet
    domain: Domain
    eyes: Eyes
    given: Given = field(default_factory=Given)

    def seen(self, report: ReadReport, progress: Progress = _silent) -> Iterator[SeenRun]:
        """Every run that can be used, one after the other.

        Args:
            report: is told what came of each.
            progress: told how far it is.
        """
        for done, run in enumerate(self.data.runs(self.domain)):
            progress(done, len(self.data), run.name)
            unread = run if isinstance(run, Unread) else None
            if isinstance(run, RecordedRun):
                notes = list(run.left_out)
                try:
                    seen = _seen(run, self.eyes, notes)
                except ForestallError as error:
                    unread = Unread(run.name, str(error))
                else:
                    (report.good if seen.good else report.failing).append(run.name)
                    if notes:
                        report.notes[run.name] = notes
                    yield seen
            if unread is not None:
                report.unread.append(unread)


def open_data(
    name: str, folder: Path, given: Given, how: Mapping[str, Any] | None = None
) -> Opened:
    """A data set, in its own domain where no other is said.

    Args:
        name: of the data set.
        folder: where it is.
        given: what was said about parts.
        how: options of the data set itself; what is None was not said.

    Raises:
        UnknownNameError: no such data set.
        InputError: no folder of one, or a part or an option that is not valid.
    """
    opens = data_set(name)
    said = {option: value for option, value in (how or {}).items() if value is not None}
    known = inspect.signature(opens).parameters
    for option in said:
        if option not in known:
            raise InputError(f"--{option}: the data set {name!r} has no such option")
    data: DataSet = opens(folder, **said)
    needed = {
        kind: (data.parts.get(kind), data.options.get(kind, {}))
        for kind in {**data.options, **data.parts}
    }
    seen = of_stored(given.over(Given.of({DOMAIN.name: (data.domain, {}), **needed})))
    eyes = eyes_for(seen)
    return Opened(data, eyes.domain, eyes, seen)


def named_data(text: str) -> tuple[str, Path]:
    """The data set and the folder of "name:folder".

    Raises:
        InputError: it is not spelt so.
    """
    name, colon, folder = text.partition(":")
    if not colon or not folder:
        known = " or ".join(f"{name}:FOLDER" for name in DATA_SETS)
        raise InputError(f"data {text!r}: a data set and its folder are expected, {known}")
    return name, Path(folder)


def import_into(opened: Opened, out: Path, progress: Progress = _silent) -> ReadReport:
    """Write what a data set shows: a memory, the failing runs with their labels, a report.

    Args:
        opened: the data set.
        out: a new folder. In it `memory.db` has the good runs as demonstrations; `failing/<run>/`
            the scene before each step of a failing one and its plan, as `forestall check` reads
            them; `failing.json` what is said of when and why they failed; `report.json` what could
            not be read and why.
        progress: told how far it is.

    Raises:
        InputError: the folder is there and has something in it.
    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError(f"{out} is there already: name a new folder")
    out.mkdir(parents=True, exist_ok=True)
    report, labels = ReadReport(), []
    with open_store(out / MEMORY, create=True) as store:
        for seen in opened.seen(report, progress):
            if seen.good:
                store.add(_demonstration(seen, opened.eyes))
            else:
                _write_scenes(out / FAILING / seen.run.name, seen.run)
                labels.append(label_of(seen))
    _write(out / LABELS, labels)
    _write(out / REPORT, report_of(report))
    return report


def outlines(opened: Opened, progress: Progress = _silent) -> Iterator[Outline]:
    """What would be read of each run; every picture is decoded, and none is judged."""
    for done, run in enumerate(opened.data.runs(opened.domain)):
        progress(done, len(opened.data), run.name)
        if isinstance(run, Unread):
            yield Outline(run.name, why_not=run.why)
            continue
        try:
            yield _outline(run)
        except ForestallError as error:
            yield Outline(run.name, run.task, why_not=str(error))


def _demonstration(seen: SeenRun, eyes: Eyes) -> Demonstration:
    """A good run, told like one that was recorded here."""
    made = seen.run.demonstration()
    steps = tuple(replace(s, whole=replace(s.whole, subtask=None)) for s in made.steps)
    described = tuple(sorted(eyes.describe().items()))
    return replace(
        made,
        scene=seen.recorded.scene or made.scene,
        steps=steps,
        perception=described,
        version=forestall.__version__,
    )


def _outline(run: RecordedRun) -> Outline:
    steps: dict[int, OutlinedStep] = {}
    kinds: Counter[str] = Counter()
    looks, last_s = 0, 0.0
    for look in run.looks():
        for number in look.before:
            _must_show(look, number)
            steps[number] = OutlinedStep(last_s, str(run.plan.subtasks[number]), "")
        if look.done is not None:
            ended = "succeeded" if look.succeeded else FAILED
            steps[look.done] = replace(steps[look.done], ended=ended)
        if look.observation is not None:
            looks, last_s = looks + 1, look.observation.time_s
            kinds.update(map(_kind_of, look.observation.frames))
    fails = "" if run.fails is None else f"failed at step {run.fails + 1} ({run.kind or FAILED})"
    told = ", ".join(f"{n} pictures of {what}" for what, n in kinds.items())
    found = tuple(steps[n] for n in sorted(steps))
    return Outline(run.name, run.task, fails, looks, told or "no pictures", found, run.left_out)


def _kind_of(frame: Frame) -> str:
    k = frame.intrinsics
    found = frame.detections
    depth = "no depth" if frame.colour_only else "depth"
    masks = "no masks" if found is None else "masks"
    return f"{k.width} x {k.height} with {depth} and {masks}"


def label_of(seen: SeenRun) -> dict[str, Any]:
    """What the data set says of a failing run, in plain data; steps count from 1."""
    recorded, run = seen.recorded, seen.run
    assert recorded.fails is not None, "it failed"
    return {
        "run": run.name,
        "task": run.task,
        "scene": recorded.scene,
        "plan": run.plan.texts(),
        "scenes": len(run.scenes),
        "fails_at_step": recorded.fails + 1,
        "seconds": list(recorded.seconds),
        "kind": recorded.kind,
        "why": recorded.why,
    }


def report_of(report: ReadReport) -> dict[str, Any]:
    """Counts, and what could not be used with its reason, in plain data."""
    return {
        "good": len(report.good),
        "failing": len(report.failing),
        "not_read": len(report.unread),
        "why_not": [{"run": u.name, "why": u.why} for u in report.unread],
        "left_out": report.notes,
    }


def _seen(recorded: RecordedRun, eyes: Eyes, notes: list[str]) -> SeenRun:
    """Look at a run from its first look to its last."""
    eyes.begin()
    plan = recorded.plan.subtasks
    graph: SceneGraph | None = None
    meant: list[Subtask] = []
    scenes: list[SceneGraph] = []
    scoped: list[SceneGraph] = []
    refused: Counter[str] = Counter()
    for look in recorded.looks():
        first = graph is None
        if first and look.observation is not None:
            graph = _look(eyes, look.observation, graph, refused)
        for number in look.before:
            if graph is None:
                raise InputError(f"nothing that can be believed was seen before step {number + 1}")
            _must_show(look, number)
            step, concerns = eyes.step(plan[number], graph)
            meant.append(step)
            scenes.append(graph)
            scoped.append(concerns)
        if look.done is not None:
            eyes.acted(meant[look.done], look.succeeded)
        if not first and look.observation is not None:
            graph = _look(eyes, look.observation, graph, refused)
    notes += [f"{n} looks: {why}" for why, n in refused.items()]
    return SeenRun(recorded, _run(recorded, scenes, scoped, graph))


def _must_show(look: Look, number: int) -> None:
    """What somebody saw at another time is not how a step began."""
    if (why := dict(look.unshown).get(number)) is not None:
        raise InputError(f"{why}: nothing shows how it began")


def _look(
    eyes: Eyes, observation: Observation, before: SceneGraph | None, refused: Counter[str]
) -> SceneGraph | None:
    """What is known after a look; as before, where the look cannot be believed."""
    try:
        return eyes.see(observation)
    except (ObservationError, PerceptionError) as error:
        refused[str(error)] += 1
        return before


def _run(
    recorded: RecordedRun,
    scenes: list[SceneGraph],
    scoped: list[SceneGraph],
    final: SceneGraph | None,
) -> ForeignRun:
    good, steps = recorded.fails is None, len(recorded.plan)
    if not scenes or (good and len(scenes) < steps):
        raise FileFormatError(
            f"only {len(scenes)} of the {steps} steps of its plan have a scene before them"
        )
    return ForeignRun(
        recorded.name,
        recorded.name if good else recorded.task,
        recorded.task,
        recorded.plan,
        tuple(scenes),
        final if good else None,
        "" if good else recorded.kind or FAILED,
        recorded.why,
        tuple(scoped),
    )


def _write_scenes(folder: Path, run: ForeignRun) -> None:
    folder.mkdir(parents=True)
    for number, scene in enumerate(run.scenes, 1):
        _write(folder / f"{number:03d}.json", scene.to_json())
    replace_file(folder / "plan.txt", ("\n".join(run.plan.texts()) + "\n").encode())


def _write(path: Path, data: Any) -> None:
    replace_file(path, (json.dumps(data, indent=1) + "\n").encode())
