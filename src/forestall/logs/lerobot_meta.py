"""What a LeRobot data set says of itself: info.json, tasks, episodes, and where their rows are.

Called by `lerobot_data`; calls pyarrow. Layout v3.0 as in huggingface/lerobot,
src/lerobot/datasets/utils.py (paths, info.json) and dataset_metadata.py (episodes, tasks).
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from forestall.errors import FileFormatError
from forestall.logs.lerobot_out import ABOUT, INFO, TASKS
from forestall.reading.documents import parse_json, read_json
from forestall.reading.files import decoding, inside
from forestall.reading.models import validated

MOST_EPISODES = 100_000
MOST_ROWS = 1_000_000
"""Of one episode: nine hours at 30 pictures a second."""

MOST_READ_BYTES = 192 * 2**20
"""Of the columns that are read of a row group, unpacked: a page may have all of it, and is nearly
four times in memory while it is unpacked. LeRobot's own files have at most 100 MB by default."""

MOST_CELL_BYTES = 256 * 2**20

_PART = re.compile(r"\{(video_key|chunk_index|file_index)(?::0?(\d)d)?\}")
_CONVERT = "python -m lerobot.scripts.convert_dataset_v21_to_v30"


class Feature(BaseModel):
    """What info.json says of a column; other keys are not needed."""

    model_config = ConfigDict(extra="ignore")

    dtype: str
    shape: tuple[int, ...] = ()
    info: dict[str, Any] | None = None
    video_info: dict[str, Any] | None = None

    @property
    def about(self) -> dict[str, Any]:
        """What is said of its pictures."""
        return {**(self.video_info or {}), **(self.info or {})}

    @property
    def depth(self) -> bool:
        """Whether it is depth, however that is said."""
        return bool(self.about.get("is_depth_map") or self.about.get("video.is_depth_map"))

    @property
    def pictures(self) -> bool:
        """Whether it is pictures or a video."""
        return self.dtype in ("image", "video")


class Info(BaseModel):
    """meta/info.json."""

    model_config = ConfigDict(extra="ignore")

    codebase_version: str
    fps: float = Field(gt=0, le=100_000)
    features: dict[str, Feature]
    data_path: str
    video_path: str | None = None


@dataclass(frozen=True, slots=True)
class Episode:
    """One episode.

    Args:
        index: of it.
        row: of meta/episodes.
        task: what it is of, in words.
        about: what our own data sets say of a run.
    """

    index: int
    row: Mapping[str, Any]
    task: str
    about: Mapping[str, str]

    def number(self, name: str) -> int:
        """A whole number of its row.

        Raises:
            FileFormatError: there is none.
        """
        value = self.row.get(name)
        if not isinstance(value, int) or isinstance(value, bool) or value < 0:
            raise FileFormatError(f"episode {self.index}: {name!r} of meta/episodes is {value!r}")
        return value


@dataclass(frozen=True, slots=True)
class Meta:
    """A data set without its rows."""

    folder: Path
    info: Info
    tasks: Mapping[int, str]

    def data_file(self, episode: Episode) -> Path:
        """The parquet file that has the rows of an episode."""
        chunk, file = episode.number("data/chunk_index"), episode.number("data/file_index")
        return self._path("data_path", self.info.data_path, "", chunk, file)

    def video_file(self, episode: Episode, key: str) -> Path:
        """The video of one camera that has an episode."""
        template = self.info.video_path
        if template is None:
            raise FileFormatError(f"{self.folder / INFO}: {key} is a video, and video_path is null")
        chunk = episode.number(f"videos/{key}/chunk_index")
        file = episode.number(f"videos/{key}/file_index")
        return self._path("video_path", template, key, chunk, file)

    def _path(self, what: str, template: str, key: str, chunk: int, file: int) -> Path:
        numbers = {"chunk_index": chunk, "file_index": file}

        def put(part: re.Match[str]) -> str:
            if part[1] not in numbers:
                return key
            return f"{numbers[part[1]]:0{part[2] or 1}d}"

        name = _PART.sub(put, template)
        if "{" in name or "}" in name:
            raise FileFormatError(f"{self.folder / INFO}: {what} is {template!r}")
        return inside(self.folder, name)


def read_meta(folder: Path) -> Meta:
    """A data set's own description.

    Raises:
        FileFormatError: it is missing, of another version, or says what cannot be.
    """
    file = folder / INFO
    if not file.is_file():
        raise FileFormatError(f"{folder} is no LeRobot data set: it has no {INFO}")
    info = validated(Info, read_json(file, "description of a data set"), str(file))
    if not info.codebase_version.startswith("v3"):
        raise FileFormatError(
            f"{file}: version {info.codebase_version}: v3.0 is read; LeRobot converts older ones "
            f"({_CONVERT})"
        )
    tasks = _texts(folder, TASKS, "task") if (folder / TASKS).is_file() else {}
    return Meta(folder, info, tasks)


def read_subtasks(folder: Path) -> Mapping[int, str]:
    """Texts of meta/subtasks.parquet by `subtask_index`; none where there is no such file."""
    name = "meta/subtasks.parquet"
    return _texts(folder, name, "subtask") if (folder / name).is_file() else {}


def read_episodes(meta: Meta, wanted: Sequence[int] | None = None) -> Iterator[Episode]:
    """Each episode in the order of the files.

    Raises:
        FileFormatError: no file of them, one that cannot be read, or too many.
    """
    folder = meta.folder / "meta/episodes"
    files = sorted(folder.glob("*/*.parquet"))
    if not files:
        raise FileFormatError(f"{folder} has no file chunk-*/file-*.parquet")
    count = 0
    for file in files:
        name = file.relative_to(meta.folder).as_posix()
        with parquet(meta.folder, name) as opened:
            columns = [c for c in opened.schema_arrow.names if not c.startswith("stats/")]
            groups = groups_of(opened, columns, file)
            for batch in opened.iter_batches(256, groups, columns=columns):
                for row in batch.to_pylist():
                    count += 1
                    if count > MOST_EPISODES:
                        raise FileFormatError(f"{file}: more than {MOST_EPISODES} episodes")
                    if wanted is None or row.get("episode_index") in wanted:
                        yield _episode(row, file)


def _episode(row: dict[str, Any], file: Path) -> Episode:
    index = row.get("episode_index")
    if not isinstance(index, int):
        raise FileFormatError(f"{file}: a row without 'episode_index'")
    tasks = row.get("tasks")
    texts = [t for t in tasks if isinstance(t, str)] if isinstance(tasks, list) else []
    about: dict[str, str] = {}
    if isinstance(row.get(ABOUT), str):
        said = parse_json(row[ABOUT])
        about = {str(k): str(v) for k, v in said.items()} if isinstance(said, dict) else {}
    return Episode(index, row, texts[0] if texts else "", about)


@contextmanager
def parquet(folder: Path, name: str) -> Iterator[Any]:
    """A parquet file of a data set, open.

    Raises:
        FileFormatError: no such file in the folder, or a damaged one.
    """
    import pyarrow.parquet as pq

    file = inside(folder, name)
    if not file.is_file():
        raise FileFormatError(f"{file} is missing: the data set names it")
    with (
        decoding(file, "a parquet file"),
        pq.ParquetFile(
            file,
            buffer_size=2**20,
            thrift_string_size_limit=2**26,
            thrift_container_size_limit=2**20,
        ) as opened,
    ):
        yield opened


def groups_of(opened: Any, columns: Collection[str], file: Path) -> list[int]:
    """The row groups of a file, whose columns may be read.

    Raises:
        FileFormatError: in one of them the columns claim more than `MOST_READ_BYTES`.
    """
    about = opened.metadata
    for group in range(about.num_row_groups):
        claimed = 0
        for number in range(about.num_columns):
            column = about.row_group(group).column(number)
            name = column.path_in_schema
            if any(name == c or name.startswith(f"{c}.") for c in columns):
                claimed += max(0, column.total_uncompressed_size)
        if claimed > MOST_READ_BYTES:
            raise FileFormatError(
                f"{file}: row group {group} claims {claimed} bytes in the columns "
                f"{', '.join(columns)}; at most {MOST_READ_BYTES} are read: write smaller groups"
            )
    return list(range(about.num_row_groups))


def _texts(folder: Path, name: str, what: str) -> dict[int, str]:
    """Number → text of a table of texts; the text may be an index that pandas did not name."""
    with parquet(folder, name) as opened:
        if opened.metadata.num_rows > MOST_EPISODES:
            raise FileFormatError(f"{folder / name}: more than {MOST_EPISODES} rows")
        groups_of(opened, opened.schema_arrow.names, folder / name)
        table = opened.read()
    column = next((c for c in (what, "__index_level_0__") if c in table.column_names), None)
    if column is None or f"{what}_index" not in table.column_names:
        raise FileFormatError(
            f"{folder / name}: columns {what!r} and '{what}_index' are expected, there are "
            f"{', '.join(table.column_names)}"
        )
    numbers, texts = table[f"{what}_index"].to_pylist(), table[column].to_pylist()
    return {int(n): str(t) for n, t in zip(numbers, texts, strict=True)}


def told(value: Any, where: str) -> Any:
    """What a cell of text says.

    Raises:
        FileFormatError: no JSON.
    """
    if not isinstance(value, str):
        raise FileFormatError(f"{where}: a text is expected, not {type(value).__name__}")
    try:
        return parse_json(value)
    except FileFormatError as error:
        raise FileFormatError(f"{where}: {error}") from error
