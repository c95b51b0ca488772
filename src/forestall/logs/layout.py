"""How somebody else's log is laid out: topics or columns, and where its subtasks begin.

Read from a TOML file (`--layout`) and a CSV file (`--steps`); what neither says is found by the
names that recorders usually give. See docs/logs.md.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from forestall.errors import FileFormatError, InputError
from forestall.reading.documents import read_toml
from forestall.reading.files import read_text
from forestall.reading.models import validated
from forestall.types.episode import SkillStatus
from forestall.types.plan import Subtask

LOOK_AGE_S = 10.0
"""How old a look may be in a log that says what a look is, as `supervision.Limits.max_age_s`:
it was made for the subtask, and judging it takes its time."""

Row = tuple[float, float, float, float]
Matrix = tuple[Row, Row, Row, Row]
Intrinsic = tuple[float, float, float, float]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Topics(_Strict):
    """The topics of one camera.

    Args:
        rgb: colour, raw or compressed.
        info: its camera_info; None: beside `rgb`.
        depth: aligned to colour; None where there is none.
        masks: one number a pixel, 0 for nothing; several where masks overlap.
        detections: vision_msgs/Detection2DArray; the k-th one has the number k + 1 in `masks`.
        labels: number in `masks` → name, where there are no detections.
        frame: name of its optical frame; None: as its messages say.
    """

    rgb: str
    info: str | None = None
    depth: str | None = None
    masks: tuple[str, ...] = ()
    detections: str | None = None
    labels: dict[str, str] = {}
    frame: str | None = None


class McapLayout(_Strict):
    """Topics and frames of an MCAP file.

    Args:
        subtasks: std_msgs/String, one message where a subtask begins.
        outcomes: std_msgs/String, how it ended: succeeded, failed or refused, and why behind ":".
        looks: our own message that says which pictures are one look; "" reads none.
        cameras: None: found by their names.
        world: frame of the world, z up; None: map, world or odom, whichever there is first.
        base: frame of where the robot stands.
        hand: frame of the hand; None for none.
        holding: std_msgs/String, the name of what the hand holds, "" for nothing; None for none.
    """

    subtasks: str = "/subtask"
    outcomes: str = "/subtask/outcome"
    looks: str = "/look"
    cameras: tuple[Topics, ...] | None = None
    world: str | None = None
    base: str = "base_link"
    hand: str | None = None
    holding: str | None = None


class Columns(_Strict):
    """The columns of one camera of a LeRobot data set.

    Args:
        rgb: feature of its pictures or video.
        depth: feature of its depth.
        masks: feature of its masks, ids coded as r + 256 g + 65536 b.
        labels: id in `masks` → name.
        detections: column of text that says which id is what, as our own data sets have it.
        intrinsics: fx, fy, cx, cy in pixels; or the column that has them.
        camera_to_world: its pose where it stands still; or the column that has 16 numbers.
    """

    rgb: str
    depth: str | None = None
    masks: str | None = None
    labels: dict[str, str] = {}
    detections: str | None = None
    intrinsics: Intrinsic | str | None = None
    camera_to_world: Matrix | str | None = None


class LeRobotLayout(_Strict):
    """Columns of a LeRobot data set.

    Args:
        cameras: None: our own, or the first video or image feature.
        episodes: which ones; all by default.
    """

    cameras: tuple[Columns, ...] | None = None
    episodes: tuple[int, ...] | None = None


class Layout(_Strict):
    """How a log is read.

    Args:
        every_s: look so often between the boundaries of subtasks; None: at boundaries alone.
        stale_s: what was seen longer before a boundary does not show it: a subtask that begins then
            is not judged.
        subtasks: text in the log → subtask in the domain's words; "" for none at all.
        mcap: topics and frames.
        lerobot: columns.
    """

    every_s: float | None = Field(default=None, gt=0)
    stale_s: float = Field(default=1.0, gt=0)
    subtasks: dict[str, str] = {}
    mcap: McapLayout = McapLayout()
    lerobot: LeRobotLayout = LeRobotLayout()

    def subtask(self, said: str, where: str) -> Subtask | None:
        """What a text of the log means; None where it is said to mean nothing.

        Raises:
            FileFormatError: it is no subtask.
        """
        meant = self.subtasks.get(said, said)
        if not meant.strip():
            return None
        try:
            return Subtask.parse(meant)
        except InputError as error:
            raise FileFormatError(
                f"{where}: {error}; or say what it means in the layout: "
                f'[subtasks] "{said[:80]}" = "skill(Thing)"'
            ) from error


@dataclass(frozen=True, slots=True)
class Step:
    """A subtask that was carried out.

    Args:
        begins_ns: on the clock of the log.
        subtask: in the words of the log, as `Layout.subtask` reads them.
        status: how it ended.
        reason: why, in the words of the log.
    """

    begins_ns: int
    subtask: Subtask
    status: SkillStatus = SkillStatus.SUCCEEDED
    reason: str = ""


@dataclass(frozen=True, slots=True)
class CsvStep:
    """A row of a CSV file of steps; `episode` counts from 0."""

    time_s: float
    said: str
    outcome: str
    episode: int
    line: int


def read_layout(path: Path | None) -> Layout:
    """A layout file; the usual layout without one.

    Raises:
        FileFormatError: it cannot be read, or says something else.
    """
    if path is None:
        return Layout()
    return validated(Layout, read_toml(path, "layout of a log"), str(path))


def read_steps(path: Path) -> list[CsvStep]:
    """A CSV file with the columns time_s, subtask and, if wanted, outcome and episode.

    Raises:
        FileFormatError: another heading, a row that does not fit it, or times that run backwards.
    """
    rows = csv.DictReader(io.StringIO(read_text(path, "CSV file of steps")), strict=True)
    known = {"time_s", "subtask", "outcome", "episode"}
    try:
        head = {name.strip() for name in rows.fieldnames or ()}
        if not {"time_s", "subtask"} <= head <= known:
            raise FileFormatError(
                f"{path}: the first line names the columns: time_s, subtask and, if wanted, "
                "outcome, episode"
            )
        found = [_row(path, rows.line_num, row) for row in rows]
    except csv.Error as error:
        raise FileFormatError(f"{path}: line {rows.line_num}: {error}") from error
    for one, two in pairwise(found):
        if one.episode == two.episode and two.time_s < one.time_s:
            raise FileFormatError(f"{path}: line {two.line}: time_s runs backwards")
    return found


def _row(path: Path, line: int, row: dict[str | None, str | list[str] | None]) -> CsvStep:
    if None in row or None in row.values():
        raise FileFormatError(f"{path}: line {line} has not as many columns as the first one")
    said = {str(k).strip(): str(v).strip() for k, v in row.items()}
    try:
        time_s, episode = float(said["time_s"]), int(said.get("episode") or 0)
    except ValueError as error:
        raise FileFormatError(f"{path}: line {line}: time_s and episode are numbers") from error
    if not abs(time_s) < 1e10:
        raise FileFormatError(f"{path}: line {line}: time_s {time_s} is no time")
    return CsvStep(time_s, said["subtask"], said.get("outcome", ""), episode, line)


def status_of(said: str, where: str) -> tuple[SkillStatus, str]:
    """How a step ended, from "refused: it is locked"; "" is taken for succeeded.

    Raises:
        FileFormatError: another word.
    """
    word, _, why = said.partition(":")
    if not word.strip():
        return SkillStatus.SUCCEEDED, ""
    try:
        return SkillStatus(word.strip().lower()), why.strip()
    except ValueError as error:
        known = ", ".join(s.value for s in SkillStatus)
        raise FileFormatError(f"{where}: an outcome is {known}, not {word[:40]!r}") from error
