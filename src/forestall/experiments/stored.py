"""What the files of a folder of results may say, as pydantic checks it.

Called by `folder`; calls `reading`. What is found there may have been cut off, edited or made by
another version; what does not fit is one sentence with file, line and key.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from forestall.errors import FileFormatError
from forestall.reading.documents import parse_json
from forestall.reading.files import read_packed_text, read_text

ABOUT = "experiment.json"
ROWS = "episodes.jsonl"
"""Files of a folder of results: what it is, and a line for each finished piece of work."""

MOST_ROWS_BYTES = 2**30
"""How large the file of rows may be: about 200,000 episodes."""


PACKED = ".xz"
"""Ending of a file of rows that was packed when all of them were there."""


class _Model(BaseModel):
    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False)


class _Part(_Model):
    name: str
    given: dict[str, Any]
    defaulted: dict[str, Any]


class _Settings(_Model):
    parts: dict[str, _Part]


class AnyAbout(_Model):
    """experiment.json of any kind of results."""

    kind: str
    version: str
    sources: str
    settings: _Settings | None = None


class ExperimentAbout(AnyAbout):
    """experiment.json of the paper's experiments."""

    split: str
    rounds: int
    settings: _Settings


class Asked(_Model):
    """How many episodes of one kind a call wanted, those that were there included.

    Args:
        set: of cases.
        profile: of the household.
        strategy: who watches.
        setup: all that is known of who watches, in one word.
        episodes: how many.
    """

    set: str
    profile: str
    strategy: str
    setup: str
    episodes: int = Field(ge=1)


class Call(_Model):
    """One line of effort.jsonl: what a call of the command did, and where."""

    jobs: int
    engine: str
    machine: str
    python: str
    date: str
    episodes: int = Field(ge=0)
    seconds: float = Field(ge=0)


class ExperimentCall(Call):
    """The same of one of the paper's experiments, with what it was for.

    Args:
        asked: what it wanted.
        before: how many of these episodes were there when it began, None where nobody wrote that.
    """

    asked: list[Asked]
    before: int | None = Field(default=None, ge=0)


def lines_of(file: Path) -> tuple[list[tuple[str, Any]], str, str]:
    """The lines of a file with one JSON value a line, each with its place.

    Args:
        file: as it is written; one that ends in .xz is packed and was finished before.

    Returns:
        (place, value) of every whole line; their text; half a last line, which a kill may leave.

    Raises:
        FileFormatError: the file cannot be read, or a whole line is no JSON.
    """
    read = read_packed_text if file.suffix == PACKED else read_text
    whole, newline, half = read(file, "list of results", MOST_ROWS_BYTES).rpartition("\n")
    found = []
    for number, line in enumerate((whole + newline).split("\n")[:-1], 1):
        place = f"{file}, line {number}"
        try:
            found.append((place, parse_json(line)))
        except FileFormatError as error:
            raise FileFormatError(f"{place}: {error}") from error
    return found, whole + newline, half
