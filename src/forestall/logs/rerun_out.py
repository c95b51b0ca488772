"""A run as a recording for the Rerun viewer (implements `writing.JudgedWriter`).

Called by the listener and by `retold`; calls the package rerun-sdk. Everything lies on two
timelines: `robot`, the robot's clock, and `boundary`, the position of a boundary in the record,
which what is seen before it and what is carried out after it have, too. docs/logs.md says which
entity is what.
"""

from __future__ import annotations

import errno
import warnings
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from forestall.errors import InputError
from forestall.extras import need
from forestall.files import whole_file
from forestall.logs.outlines import MOST_DETECTIONS, detections_of, layers_of
from forestall.logs.writing import Executed, Head
from forestall.records.derived import in_words, is_alarm
from forestall.types.episode import BoundaryRecord, SkillStatus
from forestall.types.graph import ObjectNode, SceneGraph
from forestall.types.observation import Detection, Frame, Observation, Vec3
from forestall.types.plan import Subtask
from forestall.types.verdict import Verdict

ROBOT, BOUNDARY = "robot", "boundary"
WORLD, NODES, PLACES, RELATIONS = "world", "world/nodes", "world/places", "world/relations"
STAND, HANDS = "world/robot", "world/hands"
VERDICT, WATCHED = "verdict", "watched"
SAID, DONE, TOLD, SCOPED = "said", "executed", "graph/all", "graph/scoped"
PLAN_BEFORE, PLAN_AFTER = "plan/before", "plan/after"
ABOUT, ENDED = "about", "ended"

STAYS = "the plan stays"
_TEXT_PLACES = (TOLD, SCOPED, PLAN_BEFORE, PLAN_AFTER)


def camera(number: int) -> str:
    """The entity of a camera; its pictures are below it: rgb, depth, masks, masks_1, ..."""
    return f"{WORLD}/camera_{number}"


class RerunWriter:
    """Writes one run.

    Args:
        path: of the file; it appears when the run is over.

    Raises:
        InputError: the package is missing, or the file is there already.
    """

    def __init__(self, path: Path) -> None:
        need("a recording for Rerun", "viz")
        if path.exists():
            raise InputError(f"{path} is there already: name a new file")
        self._path, self._open = path, ExitStack()
        self._stream: Any = None
        self._time_s, self._position = 0.0, 0
        self._numbers: dict[str, int] = {}
        self._shown: set[str] = set()

    def begin(self, head: Head) -> None:
        """The run begins."""
        import rerun as rr

        self._stream = rr.RecordingStream("forestall", send_properties=False)
        if not rr.is_enabled(self._stream):
            raise InputError("Rerun is switched off by the environment variable RERUN: unset it")
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._partial = Path(self._open.enter_context(whole_file(self._path)).name)
        self._stream.save(self._partial)
        self._stream.send_recording_name(head.name)
        self._put(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        about = f"# {head.name}\n\ntask {head.task}, scene {head.scene}, domain {head.domain}\n\n"
        self._put(ABOUT, _markdown(about + head.goal), static=True)

    def look(self, observation: Observation) -> None:
        """Every picture with its camera, and where the robot and its hands are."""
        import rerun as rr

        self._at(observation.time_s, self._position)
        shown = {path: None for n, f in enumerate(observation.frames) for path in self._frame(n, f)}
        for gone in sorted(self._shown - shown.keys()):
            self._put(gone, rr.Clear(recursive=False))
        self._shown = set(shown)
        stand = [observation.robot_position_world_m]
        self._put(STAND, rr.Points3D(stand, labels=["robot"], radii=0.05))
        held = [f"{h.name}: {h.holding or 'empty'}" for h in observation.hands]
        at_m = np.reshape([h.position_world_m for h in observation.hands], (-1, 3))
        self._put(HANDS, rr.Points3D(at_m, labels=held, radii=0.02))

    def judged(
        self,
        boundary: BoundaryRecord,
        before: Sequence[Subtask],
        after: Sequence[Subtask] | None,
    ) -> None:
        """What was believed and said, and the plan before and after."""
        self._at(boundary.time_s, self._position)
        self._graph(boundary.graph)
        documents = (
            boundary.graph.text(),
            boundary.scoped.text(),
            _steps(before),
            STAYS if after is None else _steps(after),
        )
        for path, text in zip(_TEXT_PLACES, documents, strict=True):
            self._put(path, _plain(text))
        if boundary.verdict is not None:
            self._scores(VERDICT, boundary.verdict)
        for name, verdict in _by_detector(boundary.watched):
            self._scores([WATCHED, name], verdict)
        self._say(SAID, sentence_of(boundary), alarming=is_alarm(boundary))
        self._position += 1

    def executed(self, executed: Executed) -> None:
        """A subtask was carried out, and how it ended."""
        why = f": {executed.reason}" if executed.reason else ""
        self._at(self._time_s, max(0, self._position - 1))
        said = f"{executed.subtask} {executed.status.value}{why}"
        self._say(DONE, said, alarming=executed.status is not SkillStatus.SUCCEEDED)

    def finish(self, success: bool | None, why: str) -> None:
        """What came of the run; the file appears.

        Raises:
            OSError: it is not whole: where a disk is full the package does not say so.
        """
        from rerun.chunk import RrdReader

        came = {True: "success", False: "failed", None: "nobody scored it"}[success]
        self._put(ENDED, _plain(f"{came}: {why}" if why else came), static=True)
        self._stream.disconnect()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                RrdReader(self._partial).store()
        except (OSError, RuntimeError, ValueError, Warning) as error:
            self.abandon()
            raise OSError(errno.EIO, "it was not written whole", str(self._path)) from error
        self._open.close()

    def abandon(self) -> None:
        """Take away what was written."""
        if self._stream is not None:
            self._stream.disconnect()
        unfinished = InputError("abandoned")
        self._open.__exit__(type(unfinished), unfinished, None)

    def _frame(self, number: int, frame: Frame) -> list[str]:
        """Show a picture; where."""
        import rerun as rr

        place, k, pose = camera(number), frame.intrinsics, frame.camera_to_world
        self._put(
            place,
            rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]),
            rr.Pinhole(
                resolution=[k.width, k.height],
                focal_length=[k.fx, k.fy],
                principal_point=[k.cx, k.cy],
                camera_xyz=rr.ViewCoordinates.RDF,
            ),
        )
        pictures: dict[str, Any] = {"rgb": rr.Image(frame.rgb)}
        if not frame.colour_only:
            pictures["depth"] = rr.DepthImage(frame.depth_m, meter=1.0)
        detections = detections_of(frame) or ()
        numbers = self._numbered([_name(d) for d in detections])
        shape = (k.height, k.width)
        for index, layer in enumerate(layers_of(detections, shape) if detections else ()):
            masks = np.array([0, *numbers], np.uint16)[layer]
            pictures["masks" if index == 0 else f"masks_{index}"] = rr.SegmentationImage(masks)
        for name, picture in pictures.items():
            self._put(f"{place}/{name}", picture)
        return [place, *(f"{place}/{name}" for name in pictures)]

    def _graph(self, graph: SceneGraph) -> None:
        """Boxes of nodes, points of those without one, and lines of relations."""
        import rerun as rr

        boxed = [n for n in graph.nodes if n.box_m is not None]
        bare = [n for n in graph.nodes if n.box_m is None and n.centroid_m is not None]
        boxes = [n.box_m for n in boxed if n.box_m is not None]
        self._put(
            NODES,
            rr.Boxes3D(
                mins=_points(b.low for b in boxes),
                sizes=_points(b.size for b in boxes),
                labels=[n.id for n in boxed],
                class_ids=self._numbered([n.id for n in boxed]),
            ),
        )
        at_m = _points(n.centroid_m for n in bare if n.centroid_m is not None)
        self._put(PLACES, rr.Points3D(at_m, labels=[n.id for n in bare], radii=0.02))
        where = {n.id: at for n in graph.nodes if (at := _middle(n)) is not None}
        lines = [r for r in graph.relations if r.subject in where and r.object in where]
        strips = [[where[r.subject], where[r.object]] for r in lines]
        named = [str(r) for r in lines]
        self._put(RELATIONS, rr.LineStrips3D(strips, labels=named, radii=0.004))

    def _scores(self, place: str | list[object], verdict: Verdict) -> None:
        import rerun as rr

        path = [place] if isinstance(place, str) else place
        if verdict.score is not None:
            self._put([*path, "score"], rr.Scalars(verdict.score))
        self._put([*path, "threshold"], rr.Scalars(verdict.threshold))

    def _say(self, path: str, text: str, *, alarming: bool) -> None:
        import rerun as rr

        self._put(path, rr.TextLog(text, level="WARN" if alarming else "INFO"))

    def _numbered(self, names: Sequence[str]) -> list[int]:
        """Numbers of names, the same in the whole run, so that a thing keeps its colour.

        Raises:
            InputError: more than a mask can number.
        """
        import rerun as rr

        new = [name for name in dict.fromkeys(names) if name not in self._numbers]
        for name in new:
            self._numbers[name] = len(self._numbers) + 1
        if len(self._numbers) > MOST_DETECTIONS:
            raise InputError(f"more than {MOST_DETECTIONS} things in a run")
        if new:
            self._put(WORLD, rr.AnnotationContext([(k, n) for n, k in self._numbers.items()]))
        return [self._numbers[name] for name in names]

    def _at(self, time_s: float, position: int) -> None:
        self._time_s = time_s
        self._stream.set_time(ROBOT, duration=time_s)
        self._stream.set_time(BOUNDARY, sequence=position)

    def _put(self, path: str | list[object], *what: Any, static: bool = False) -> None:
        self._stream.log(path, *what, static=static)


def sentence_of(boundary: BoundaryRecord) -> str:
    """What was decided at a boundary and why, on one line."""
    decided = "not judged" if boundary.outcome is None else boundary.outcome.value
    verdict = boundary.verdict
    why = boundary.sentence or boundary.why or ("" if verdict is None else verdict.note)
    what = f"{in_words(boundary.when)} {boundary.subtask}: {decided}"
    return f"{what}: {why}" if why else what


def _by_detector(watched: Iterable[Verdict]) -> Iterable[tuple[str, Verdict]]:
    """Verdicts with names that are told apart."""
    names: Counter[str] = Counter()
    for verdict in watched:
        names[verdict.detector] += 1
        count = names[verdict.detector]
        yield verdict.detector if count == 1 else f"{verdict.detector} ({count})", verdict


def _name(detection: Detection) -> str:
    return detection.instance or detection.category


def _middle(node: ObjectNode) -> Vec3 | None:
    return node.centroid_m if node.box_m is None else node.box_m.centre


def _points(at_m: Iterable[Vec3]) -> Any:
    return np.reshape(list(at_m), (-1, 3))


def _steps(plan: Sequence[Subtask]) -> str:
    return "\n".join(map(str, plan)) or "nothing is left"


def _plain(text: str) -> Any:
    import rerun as rr

    return rr.TextDocument(text)


def _markdown(text: str) -> Any:
    import rerun as rr

    return rr.TextDocument(text, media_type="text/markdown")
