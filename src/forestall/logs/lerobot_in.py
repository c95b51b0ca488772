"""Rows of a LeRobot episode: its subtasks, and its looks as observations.

Called by `lerobot_data`; calls `lerobot_meta` for files and `lerobot_video`. Rows are read twice,
the first time without pictures, the second time few at once.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.errors import FileFormatError, ForestallError, InputError
from forestall.logs.layout import Columns, Layout, Step, status_of
from forestall.logs.lerobot_meta import (
    MOST_CELL_BYTES,
    MOST_ROWS,
    Episode,
    Meta,
    groups_of,
    parquet,
    read_subtasks,
    told,
)
from forestall.logs.lerobot_out import (
    CAMERA,
    COLOUR,
    DEPTH,
    DETECTIONS,
    EXECUTED,
    HANDS,
    LANGUAGE,
    LOOK,
    MASKS,
    NAMED,
    POSE,
    STANDS,
    SUBTASK,
    TIME,
    UNSEEN,
)
from forestall.logs.lerobot_video import depth_m, frames_at
from forestall.logs.moments import Moment
from forestall.logs.outlined import labelled
from forestall.logs.told import Hands
from forestall.reading.files import inside
from forestall.reading.models import validated
from forestall.reading.pictures import FORMATS, MOST_PIXELS
from forestall.types.facts import category_of
from forestall.types.observation import (
    Detection,
    Frame,
    GripperState,
    Intrinsics,
    Observation,
    Pose,
    Vec3,
)
from forestall.types.recorded import Look

OWN = Columns(
    rgb=COLOUR,
    depth=DEPTH,
    masks=MASKS,
    detections=DETECTIONS,
    intrinsics=CAMERA,
    camera_to_world=POSE,
)
"""The columns of our own data sets."""

_SMALL = ("frame_index", "timestamp", "task_index", "subtask_index", LOOK, TIME, EXECUTED)
_FEW, _MANY = 4, 1024
"""Rows in memory at once, with pictures and without."""


@dataclass(frozen=True, slots=True)
class Row:
    """A row without its pictures; `look` is the look that it belongs to, by number."""

    number: int
    stamp_ns: int
    look: int
    cells: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Looking:
    """How the looks of one episode are made.

    Args:
        meta: of the data set.
        episode: which.
        cameras: in their order.
        layout: as it is read.
    """

    meta: Meta
    episode: Episode
    cameras: tuple[Columns, ...]
    layout: Layout

    def rows(self) -> list[Row]:
        """Every row of the episode, in order.

        Raises:
            FileFormatError: none, too many, or columns that are missing or of another type.
        """
        found = [self._row(n, cells) for n, cells in enumerate(self.cells(_SMALL, _MANY))]
        if not found:
            raise FileFormatError(f"{self.meta.data_file(self.episode)}: the episode has no rows")
        return found

    def steps(self, rows: Sequence[Row]) -> list[Step]:
        """Subtasks: ours, else those of language, of the subtask index, or of the task index."""
        if EXECUTED in rows[0].cells:
            return list(self._own_steps(rows))
        said = list(self._language(rows))
        if not said and "subtask_index" in rows[0].cells:
            said = list(_changes(rows, "subtask_index", read_subtasks(self.meta.folder)))
        if not said and len({row.cells.get("task_index") for row in rows}) > 1:
            said = list(_changes(rows, "task_index", self.meta.tasks))
        where = str(self.meta.data_file(self.episode))
        meant = [(at_ns, self.layout.subtask(text, where)) for at_ns, text in said]
        # The first row of a subtask may show what it did; the row before shows how it was found.
        return [Step(at_ns - 1, subtask) for at_ns, subtask in meant if subtask is not None]

    def looks(self, rows: Sequence[Row], moments: Sequence[Moment]) -> Iterator[Look]:
        """Each look with its pictures, a few rows in memory at a time."""
        wanted = {m.at_ns for m in moments}
        stamps = {row.look: row.stamp_ns for row in reversed(rows)}
        chosen = [row for row in rows if stamps[row.look] in wanted]
        seen = iter(self._observations(chosen))
        for moment in moments:
            observation = None if moment.at_ns is None else next(seen)
            yield Look(observation, moment.before, moment.done, moment.succeeded, moment.unshown)

    def _observations(self, rows: Sequence[Row]) -> Iterator[Observation]:
        frames: list[Frame] = []
        pictures = self._pictures(rows)
        for at, row in enumerate(rows):
            cells = next(pictures)
            where = f"{self.meta.data_file(self.episode)}: row {row.number} of the episode"
            try:
                frames += [self._frame(camera, cells) for camera in self.cameras]
                if at + 1 < len(rows) and rows[at + 1].look == row.look:
                    continue
                observation = _observation(row, cells, tuple(frames), where)
            except (ForestallError, KeyError, ValueError, TypeError) as error:
                if str(error).startswith(where):
                    raise
                raise FileFormatError(f"{where}: {error}") from error
            frames = []
            yield observation

    def _row(self, number: int, cells: dict[str, Any]) -> Row:
        if number >= MOST_ROWS:
            raise FileFormatError(f"{self.meta.folder}: more than {MOST_ROWS} rows in an episode")
        look = cells.get(LOOK)
        time_s = cells[TIME] if look is not None else number / self.meta.info.fps
        where = f"{self.meta.data_file(self.episode)}: row {number} of the episode"
        if look is not None and (not isinstance(look, int) or not isinstance(time_s, float)):
            raise FileFormatError(f"{where}: {LOOK} and {TIME} are not numbers")
        if not abs(time_s) < 1e10:
            raise FileFormatError(f"{where}: {TIME} is {time_s}")
        stamp_ns = look if look is not None else round(time_s * 1e9)
        return Row(number, stamp_ns, number if look is None else look, cells)

    def cells(self, names: Sequence[str], at_once: int = _FEW) -> Iterator[dict[str, Any]]:
        """Some columns of the episode's rows, as far as there are such."""
        file = self.meta.data_file(self.episode)
        name = file.relative_to(self.meta.folder).as_posix()
        with parquet(self.meta.folder, name) as opened:
            there = opened.schema_arrow.names
            if "episode_index" not in there:
                raise FileFormatError(f"{file}: the column 'episode_index' is missing")
            columns = ["episode_index", *(n for n in names if n in there)]
            index = self.episode.index
            groups = groups_of(opened, columns, file)
            groups = [g for g in groups if _may_have(opened.metadata, g, index)]
            batches = opened.iter_batches(at_once, groups, columns=columns, use_threads=False)
            for batch in batches:
                for cells in batch.to_pylist():
                    if cells["episode_index"] == index:
                        yield cells

    def _own_steps(self, rows: Sequence[Row]) -> Iterator[Step]:
        last_ns, done = 0, -1
        for row in rows:
            if row.look != done:
                where = f"{self.meta.data_file(self.episode)}: row {row.number}: {EXECUTED}"
                yield from self._told_steps(row.cells[EXECUTED], last_ns, where)
                last_ns, done = row.stamp_ns, row.look
        left = self.episode.about.get(UNSEEN, "[]")
        yield from self._told_steps(left, last_ns, f"episode {self.episode.index}: {UNSEEN}")

    def _told_steps(self, cell: Any, at_ns: int, where: str) -> Iterator[Step]:
        said = told(cell, where)
        if not isinstance(said, list) or not all(isinstance(one, dict) for one in said):
            raise FileFormatError(f"{where}: not a list of subtasks")
        for one in said:
            subtask = self.layout.subtask(str(one.get("subtask")), where)
            status, _ = status_of(str(one.get("status", "")), where)
            if subtask is not None:
                yield Step(at_ns, subtask, status, str(one.get("reason", "")))

    def _language(self, rows: Sequence[Row]) -> Iterator[tuple[int, str]]:
        """(time, text) of the subtasks in the column of language; every row has all of them."""
        first = next(self.cells([LANGUAGE]), {}).get(LANGUAGE)
        if not isinstance(first, list):
            return
        found = [
            (float(said["timestamp"]), said["content"])
            for said in first
            if isinstance(said, dict) and said.get("style") == SUBTASK and said.get("content")
        ]
        for time_s, text in sorted(found, key=lambda one: one[0]):
            if not abs(time_s) < 1e9:
                raise FileFormatError(f"{self.meta.folder}: {LANGUAGE} begins at {time_s} s")
            yield round(time_s * self.meta.info.fps) * 10**9 // int(self.meta.info.fps), text

    def _pictures(self, rows: Sequence[Row]) -> Iterator[dict[str, Any]]:
        """The cells of wanted rows, decoded videos among them."""
        features = self.meta.info.features
        named = [n for c in self.cameras for n in _names(c)]
        videos = [n for n in named if n in features and features[n].dtype == "video"]
        fps = self.meta.info.fps
        decoded = {
            key: frames_at(
                self.meta.video_file(self.episode, key),
                [self._starts(key) + row.number / fps for row in rows],
                0.5 / fps,
                features[key].depth,
            )
            for key in videos
        }
        wanted = {row.number for row in rows}
        plain = [n for n in named if n not in videos]
        for number, cells in enumerate(self.cells([*plain, HANDS, NAMED, STANDS])):
            if number in wanted:
                yield {**cells, **{key: next(frames) for key, frames in decoded.items()}}

    def _starts(self, key: str) -> float:
        value = self.episode.row.get(f"videos/{key}/from_timestamp")
        if not isinstance(value, float | int) or not 0 <= value < 1e9:
            raise FileFormatError(
                f"episode {self.episode.index}: 'videos/{key}/from_timestamp' is {value!r}"
            )
        return float(value)

    def _frame(self, camera: Columns, cells: dict[str, Any]) -> Frame:
        rgb = _pixels(self.meta, camera.rgb, cells, "RGB")
        shape = (int(rgb.shape[0]), int(rgb.shape[1]))
        depth = np.zeros(shape, np.float32)
        if camera.depth is not None:
            depth = self._depth(camera.depth, cells)
        k = _numbers(camera.intrinsics, cells, 4, "intrinsics (fx, fy, cx, cy)")
        pose: Pose = _numbers(camera.camera_to_world, cells, 16, "camera_to_world").reshape(4, 4)
        return Frame(
            rgb.astype(np.uint8),
            depth,
            Intrinsics(shape[1], shape[0], *(float(v) for v in k)),
            pose,
            detections=self._detections(camera, cells, shape),
            colour_only=camera.depth is None,
        )

    def _depth(self, key: str, cells: dict[str, Any]) -> npt.NDArray[np.float32]:
        feature = self.meta.info.features[key]
        raw = _pixels(self.meta, key, cells, None)
        if feature.dtype == "video":
            return depth_m(raw, feature.about, key)
        unit = feature.about.get("depth_unit") or ("m" if raw.dtype.kind == "f" else "mm")
        if unit not in ("m", "mm"):
            raise InputError(f"{key}: depth_unit is {unit!r}: m or mm")
        metres = raw.astype(np.float32) * np.float32(1 if unit == "m" else 0.001)
        return np.where(np.isfinite(metres) & (metres > 0), metres, 0).astype(np.float32)

    def _detections(
        self, camera: Columns, cells: dict[str, Any], shape: tuple[int, int]
    ) -> tuple[Detection, ...] | None:
        if camera.masks is None:
            return None
        parts = _pixels(self.meta, camera.masks, cells, "RGB").astype(np.int32)
        numbers = parts[..., 0] + 256 * parts[..., 1] + 65536 * parts[..., 2]
        if camera.detections is None:
            return labelled([numbers], camera.labels, shape)
        said = told(cells.get(camera.detections), camera.detections)
        if said is None:
            return None
        if numbers.shape != shape:
            raise InputError(f"{camera.masks} of {numbers.shape} beside a picture of {shape}")
        found = []
        for one in said if isinstance(said, list) else ():
            mask = np.isin(numbers, np.asarray(one["ids"], np.int32))
            kind = one.get("category") or category_of(one["instance"])
            if mask.any():
                found.append(Detection(kind, mask, one.get("instance"), one.get("score", 1.0)))
        return tuple(found)


def _may_have(about: Any, group: int, episode: int) -> bool:
    """Whether a row group may have rows of an episode, by its statistics if it has some."""
    columns = about.row_group(group)
    for number in range(columns.num_columns):
        column = columns.column(number)
        if column.path_in_schema == "episode_index" and column.is_stats_set:
            said = column.statistics
            return not said.has_min_max or bool(said.min <= episode <= said.max)
    return True


def _names(camera: Columns) -> Iterator[str]:
    for name in (camera.rgb, camera.depth, camera.masks, camera.detections):
        if name is not None:
            yield name
    for column in (camera.intrinsics, camera.camera_to_world):
        if isinstance(column, str):
            yield column


def _observation(
    row: Row, cells: dict[str, Any], frames: tuple[Frame, ...], where: str
) -> Observation:
    time_s = row.cells.get(TIME) if LOOK in row.cells else row.stamp_ns / 1e9
    hands: tuple[GripperState, ...] = (GripperState.untold(),)
    named: tuple[tuple[str, Vec3], ...] = ()
    if HANDS in cells:
        said = {"hands": told(cells[HANDS], HANDS), "named": told(cells.get(NAMED, "[]"), NAMED)}
        given = validated(Hands, said, where)
        hands, named = given.states(), given.named
    stands = cells.get(STANDS)
    if stands is None:
        stands = [*frames[-1].camera_to_world[:2, 3].tolist(), 0.0]
    x, y, z = (float(v) for v in stands)
    return Observation(frames, hands[0], float(time_s or 0.0), (x, y, z), None, hands[1:], named)


def _pixels(meta: Meta, key: str, cells: dict[str, Any], mode: str | None) -> npt.NDArray[Any]:
    """The picture in a cell: a frame of a video, bytes, or the name of a file of the set."""
    from PIL import Image

    cell = cells.get(key)
    if isinstance(cell, np.ndarray):
        return cell
    if not isinstance(cell, dict):
        raise InputError(f"column {key!r}: a picture is expected, not {type(cell).__name__}")
    data = cell.get("bytes")
    if data is None and isinstance(cell.get("path"), str):
        data = inside(meta.folder, cell["path"]).read_bytes()
    if not isinstance(data, bytes) or len(data) > MOST_CELL_BYTES:
        raise InputError(f"column {key!r}: a cell without a picture, or one that is too large")
    try:
        image = Image.open(io.BytesIO(data), formats=FORMATS)
        if image.width * image.height > MOST_PIXELS:
            raise InputError(f"column {key!r}: a picture of {image.width} x {image.height} pixels")
        return np.asarray(image if mode is None else image.convert(mode))
    except InputError:
        raise
    except Exception as error:  # decoders of Pillow raise anything over damaged bytes
        raise InputError(f"column {key!r}: a picture that cannot be read: {error}") from error


def _numbers(said: Any, cells: dict[str, Any], count: int, what: str) -> npt.NDArray[np.float64]:
    """What a layout says itself, or the column that it names."""
    if said is None:
        raise InputError(
            f"{what} of a camera is not said: say it in a layout ([[lerobot.cameras]], "
            "docs/logs.md)"
        )
    values = np.asarray(cells.get(said) if isinstance(said, str) else said, np.float64).ravel()
    if values.shape != (count,) or not np.isfinite(values).all():
        raise InputError(f"{what} has to be {count} numbers")
    return values


def _changes(rows: Sequence[Row], name: str, texts: Any) -> Iterator[tuple[int, str]]:
    """(time, text) wherever an index changes."""
    last = None
    for row in rows:
        value = row.cells.get(name)
        if value != last and value is not None:
            if value not in texts:
                raise FileFormatError(f"row {row.number}: {name} {value!r} has no text")
            yield row.stamp_ns, texts[value]
        last = value
