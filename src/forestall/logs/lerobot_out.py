"""A run as a LeRobot data set of one episode, format v3.0 (implements `writing.LogWriter`).

Called by the listener; calls pyarrow. Layout as in huggingface/lerobot,
src/lerobot/datasets/utils.py and docs/source/lerobot-dataset-v3.mdx. A row is one picture. Colour
and masks are PNG in the parquet file, depth is a float32 TIFF in metres, which is how that package
keeps raw depth (image_writer.py): all of it to the last bit. Videos are not written: they lose.
"""

from __future__ import annotations

import io
import json
import shutil
import uuid
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from forestall.errors import InputError
from forestall.files import replace_file
from forestall.logs.needed import needed
from forestall.logs.outlines import detections_of, numbered
from forestall.logs.told import hand_json
from forestall.logs.writing import Executed, Head
from forestall.types.observation import Frame, Observation

VERSION = "v3.0"
FPS = 10
"""Rows are numbered so: a row has no time of its own in this format. `TIME` has the real one."""

COLOUR, DEPTH = "observation.images.head", "observation.images.head_depth"
MASKS, DETECTIONS = "observation.images.head_masks", "observation.detections"
CAMERA, POSE = "observation.intrinsics", "observation.camera_to_world"
LOOK, TIME, STANDS = "observation.look", "observation.time_s", "observation.robot_position"
HANDS, NAMED, EXECUTED = "observation.hands", "observation.named", "observation.executed"
LANGUAGE, SUBTASK = "language_persistent", "subtask"
ABOUT = "forestall"
"""Column of the episodes that says what a run was of."""

UNSEEN = "executed after the last look"
"""An entry of it."""

DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
DATA = "data/chunk-000/file-000.parquet"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"
INFO, TASKS = "meta/info.json", "meta/tasks.parquet"

_STANDARD = ("timestamp", "frame_index", "episode_index", "index", "task_index")
_SPOOL = ".rows"


class LeRobotWriter:
    """Writes one run.

    Args:
        path: of the data set's folder; it appears when the run is over.

    Raises:
        InputError: a package is missing, or the folder is there already.
    """

    def __init__(self, path: Path) -> None:
        needed("pyarrow")
        if path.exists():
            raise InputError(f"{path} is there already: name a new folder")
        self._path = path
        self._partial = path.with_name(f".{uuid.uuid4().hex}.part")
        self._spool: Any = None
        self._since: list[dict[str, str]] = []
        self._begun: list[tuple[str, int]] = []
        self._rows = self._looks = 0
        self._shape: tuple[int, int] | None = None

    def begin(self, head: Head) -> None:
        """The run begins; rows are spooled until it is over."""
        import pyarrow as pa

        self._head = head
        self._partial.mkdir(parents=True)
        self._spool = pa.ipc.new_stream(str(self._partial / _SPOOL), _schema(spooled=True))

    def look(self, observation: Observation) -> None:
        """One row for each picture.

        Raises:
            InputError: no picture, or one of another size than the ones before.
        """
        import pyarrow as pa

        if not observation.frames:
            raise InputError("a look without a picture cannot be in a LeRobot data set")
        self._begun += [(done["subtask"], self._rows) for done in self._since]
        shared = {
            LOOK: self._looks,
            TIME: observation.time_s,
            STANDS: list(observation.robot_position_world_m),
            HANDS: json.dumps([hand_json(h) for h in (observation.gripper, *observation.others)]),
            NAMED: json.dumps(observation.told),
            EXECUTED: json.dumps(self._since),
        }
        for frame in observation.frames:
            row = {**shared, **self._frame(frame), **self._numbers()}
            self._spool.write_batch(pa.RecordBatch.from_pylist([row], schema=_schema(spooled=True)))
            self._rows += 1
        self._looks, self._since = self._looks + 1, []

    def executed(self, executed: Executed) -> None:
        """A subtask was carried out since the last look."""
        said = {"subtask": str(executed.subtask), "status": executed.status.value}
        self._since.append({**said, "reason": executed.reason})

    def finish(self, success: bool | None, why: str) -> None:
        """Every row with the subtasks of the episode, and what the set is of; it appears."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        self._spool.close()
        target = self._partial / DATA
        target.parent.mkdir(parents=True)
        language = [
            {"role": "user", "content": said, "style": SUBTASK, "timestamp": row / FPS}
            for said, row in self._begun
        ]
        schema = _schema()
        with (
            pa.OSFile(str(self._partial / _SPOOL)) as spool,
            pq.ParquetWriter(target, schema, compression="snappy") as writer,
        ):
            for batch in pa.ipc.open_stream(spool):
                rows = [{**row, LANGUAGE: language} for row in batch.to_pylist()]
                writer.write_table(pa.Table.from_pylist(rows, schema=schema))
        (self._partial / _SPOOL).unlink()
        about = {**asdict(self._head), "success": json.dumps(success), "why": why}
        self._meta({**about, UNSEEN: json.dumps(self._since)})
        self._partial.rename(self._path)

    def abandon(self) -> None:
        """Take away what was written."""
        if self._spool is not None:
            self._spool.close()
        shutil.rmtree(self._partial, ignore_errors=True)

    def _frame(self, frame: Frame) -> dict[str, Any]:
        shape = (frame.intrinsics.height, frame.intrinsics.width)
        if self._shape not in (None, shape):
            raise InputError(f"pictures of {shape} after ones of {self._shape}: one size is kept")
        self._shape = shape
        found = detections_of(frame)
        numbers, ids = numbered(found or (), shape)
        said = None
        if found is not None:
            said = [
                {"category": d.category, "instance": d.instance, "score": d.score, "ids": own}
                for d, own in zip(found, ids, strict=True)
            ]
        k = frame.intrinsics
        return {
            COLOUR: _image(frame.rgb, "PNG"),
            DEPTH: _image(frame.depth_m, "TIFF"),
            MASKS: _image(_coded(numbers), "PNG"),
            DETECTIONS: json.dumps(said),
            CAMERA: [k.fx, k.fy, k.cx, k.cy],
            POSE: frame.camera_to_world.ravel().tolist(),
        }

    def _numbers(self) -> dict[str, Any]:
        number = self._rows
        return {
            "timestamp": number / FPS,
            "frame_index": number,
            "episode_index": 0,
            "index": number,
            "task_index": 0,
        }

    def _meta(self, about: dict[str, str]) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        task = self._head.goal or self._head.task
        episode = {
            "episode_index": 0,
            "tasks": [task],
            "length": self._rows,
            "data/chunk_index": 0,
            "data/file_index": 0,
            "dataset_from_index": 0,
            "dataset_to_index": self._rows,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
            ABOUT: json.dumps(about),
        }
        target = self._partial / EPISODES
        target.parent.mkdir(parents=True)
        pq.write_table(pa.Table.from_pylist([episode]), target)
        tasks = pa.table({"task_index": pa.array([0], pa.int64()), "task": [task]})
        pq.write_table(tasks.replace_schema_metadata(_PANDAS), self._partial / TASKS)
        info = {
            "codebase_version": VERSION,
            "robot_type": None,
            "total_episodes": 1,
            "total_frames": self._rows,
            "total_tasks": 1,
            "chunks_size": 1000,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": FPS,
            "splits": {"train": "0:1"},
            "data_path": DATA_PATH,
            "video_path": None,
            "features": dict(_features(self._shape or (0, 0))),
        }
        replace_file(self._partial / INFO, (json.dumps(info, indent=4) + "\n").encode())


_PANDAS = {
    "pandas": json.dumps(
        {
            "index_columns": ["task"],
            "column_indexes": [],
            "columns": [
                {
                    "name": name,
                    "field_name": name,
                    "pandas_type": kind,
                    "numpy_type": stored,
                    "metadata": None,
                }
                for name, kind, stored in (
                    ("task_index", "int64", "int64"),
                    ("task", "unicode", "object"),
                )
            ],
        }
    )
}
"""Tasks are read with pandas, their text being the index."""


def _features(shape: tuple[int, int]) -> Iterator[tuple[str, dict[str, Any]]]:
    """What info.json says of the columns."""
    names = ["height", "width", "channels"]
    depth = {"is_depth_map": True, "depth_unit": "m"}
    yield COLOUR, {"dtype": "image", "shape": [*shape, 3], "names": names}
    yield DEPTH, {"dtype": "image", "shape": [*shape, 1], "names": names, "info": depth}
    yield MASKS, {"dtype": "image", "shape": [*shape, 3], "names": names}
    for name, size in ((CAMERA, 4), (POSE, 16), (STANDS, 3), (TIME, 1)):
        yield name, {"dtype": "float64", "shape": [size], "names": None}
    for name in (DETECTIONS, HANDS, NAMED, EXECUTED):
        yield name, {"dtype": "string", "shape": [1], "names": None}
    yield LOOK, {"dtype": "int64", "shape": [1], "names": None}
    yield LANGUAGE, {"dtype": "language", "shape": [1], "names": None}
    for name in _STANDARD:
        dtype = "float32" if name == "timestamp" else "int64"
        yield name, {"dtype": dtype, "shape": [1], "names": None}


def _schema(*, spooled: bool = False) -> Any:
    """The columns of the data; spooled ones are without what only the end knows."""
    import pyarrow as pa

    image = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
    text, number, real = pa.string(), pa.int64(), pa.float64()
    language = pa.struct(
        [
            pa.field("role", text, nullable=False),
            pa.field("content", text),
            pa.field("style", text),
            pa.field("timestamp", pa.float32(), nullable=False),
            pa.field("camera", text),
            pa.field("tool_calls", pa.list_(text)),
        ]
    )
    fields = [(name, image) for name in (COLOUR, DEPTH, MASKS)]
    fields += [(n, pa.list_(real, size)) for n, size in ((CAMERA, 4), (POSE, 16), (STANDS, 3))]
    fields += [(name, text) for name in (DETECTIONS, HANDS, NAMED, EXECUTED)]
    fields += [(TIME, real), (LOOK, number)]
    fields += [(n, pa.float32() if n == "timestamp" else number) for n in _STANDARD]
    if not spooled:
        fields.append((LANGUAGE, pa.list_(language)))
    return pa.schema(fields)


def _image(pixels: Any, kind: str) -> dict[str, Any]:
    """A picture in a cell; 8 bit as PNG, float32 as packed TIFF."""
    from PIL import Image

    buffer = io.BytesIO()
    image = Image.fromarray(np.ascontiguousarray(pixels))
    how = {"compress_level": 3} if kind == "PNG" else {"compression": "tiff_adobe_deflate"}
    image.save(buffer, kind, **how)
    return {"bytes": buffer.getvalue(), "path": None}


def _coded(numbers: Any) -> Any:
    """(H, W, 3) uint8: r + 256 g + 65536 b is the number."""
    parts = [(numbers >> shift).astype(np.uint8) for shift in (0, 8, 16)]
    return np.stack(parts, axis=-1)
