"""A calibration as a TOML file: what was measured and with what; thresholds follow from it.

Called by the command line and assembly; calls `reading` and `files`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from forestall.calibration.conformal import NOT_JUDGED
from forestall.calibration.fitted import CalibrationTable
from forestall.calibration.scores import Column, Parts, Scores
from forestall.errors import FileFormatError, InputError
from forestall.files import replace_file
from forestall.reading.documents import MOST_TOML_BYTES, read_toml
from forestall.reading.fields import Field

FORMAT = 2

_OF_IDS = 1
"""The format whose `memory` told demonstrations by their ids alone, whoever had seen them."""

UNJUDGED = "-"
"""Stands where a run has no score."""

_KEYS = (
    "format", "level", "parts", "irreversible", "by_task", "memory", "demonstrations", "held_out",
    "columns", "looks", "options", "groups",
)  # fmt: skip


def write_calibration(path: Path, table: CalibrationTable) -> None:
    """Write a file that reads back equal.

    Raises:
        InputError: it would be larger than a file of this kind may be.
        OSError: it cannot be written; names the file.
    """
    data = calibration_toml(table).encode()
    if len(data) > MOST_TOML_BYTES:
        raise InputError(f"{path} would have more than {MOST_TOML_BYTES} bytes: use fewer runs")
    replace_file(path, data)


def read_calibration(path: Path) -> CalibrationTable:
    """Read what `write_calibration` wrote.

    Raises:
        FileFormatError: it cannot be read, or is no calibration; with file and place.
    """
    data = read_toml(path, "calibration")
    try:
        return _table(Field(data))
    except InputError as error:
        raise FileFormatError(f"{path}: {error}") from error


def calibration_toml(table: CalibrationTable) -> str:
    """The text of the file."""
    scores = table.scores
    lines = [
        "# A calibration of forestall (docs/calibration.md): the smallest score of each judge in",
        f'# each good run, "{UNJUDGED}" where it judged nothing. Thresholds follow from these.',
        f"format = {FORMAT}",
        f"level = {_value(table.level)}",
        f"parts = {_value(table.parts.value)}",
        f"irreversible = {_value(table.irreversible)}",
        f"by_task = {_value(table.by_task)}",
        f"memory = {_value(table.memory)}",
        f"demonstrations = {table.demonstrations}",
        f"held_out = {_value(table.held_out)}",
        "columns = [",
        *(
            f"  {{ judge = {_value(c.judge)}, part = {_value(c.part)}, share = {c.share!r} }},"
            for c in scores.columns
        ),
        "]",
    ]
    if table.looks:
        lines += ["", "[looks]", *(f"{_key(j)} = {n}" for j, n in table.looks.items())]
    for judge, options in table.options.items():
        lines += ["", f"[options.{_key(judge)}]"]
        lines += [f"{_key(k)} = {_value(v)}" for k, v in options.items()]
    for task in dict.fromkeys(scores.tasks):
        lines += ["", "[[groups]]", f"task = {_value(task)}", "runs = ["]
        lines += [
            f"  {{ run = {_value(run)}, scores = {_row(row)} }},"
            for run, own, row in zip(scores.runs, scores.tasks, scores.extremes, strict=True)
            if own == task
        ]
        lines.append("]")
    return "\n".join(lines) + "\n"


def _row(row: tuple[float, ...]) -> str:
    return f"[{', '.join(_value(UNJUDGED if s == NOT_JUDGED else s) for s in row)}]"


def _value(value: Any) -> str:
    if value is None:
        return "{ none = true }"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    return json.dumps(str(value), ensure_ascii=False)


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _value(key)


def _table(field: Field) -> CalibrationTable:
    for key in field.value:
        if key not in _KEYS:
            raise FileFormatError(f"unknown key {key!r}: known are {', '.join(_KEYS)}")
    if field["format"].value == _OF_IDS:
        raise FileFormatError(
            f"format {_OF_IDS} does not say what the demonstrations showed: run forestall "
            "calibrate again"
        )
    if field["format"].value != FORMAT:
        field["format"].fail(f"{FORMAT}, as this version writes it,")
    columns = field["columns"].tuple_of(_column)
    rows = [row for group in field["groups"].items() for row in _runs(group, len(columns))]
    return CalibrationTable(
        Scores(
            columns,
            tuple(run for _, run, _ in rows),
            tuple(task for task, _, _ in rows),
            tuple(extremes for _, _, extremes in rows),
        ),
        field["level"].number(),
        field["parts"].member(Parts),
        field["irreversible"].tuple_of(Field.name),
        field["by_task"].flag(),
        dict(field.optional("options", lambda f: f.pairs(_options)) or ()),
        field["memory"].text(),
        field["demonstrations"].whole(),
        field["held_out"].flag(),
        dict(field.optional("looks", lambda f: f.pairs(Field.whole)) or ()),
    )


def _column(field: Field) -> Column:
    return Column(field["judge"].name(), field["part"].text(), field["share"].number())


def _runs(field: Field, columns: int) -> Iterator[tuple[str, str, tuple[float, ...]]]:
    task = field["task"].text()
    for run in field["runs"].items():
        row = run["scores"].tuple_of(_score)
        if len(row) != columns:
            run["scores"].fail(f"a list of {columns} scores, one for each column,")
        yield task, run["run"].name(), row


def _score(field: Field) -> float:
    return NOT_JUDGED if field.value == UNJUDGED else field.number()


def _options(field: Field) -> Mapping[str, Any]:
    return dict(field.pairs(lambda option: _plain(option.value)))


def _plain(value: Any) -> Any:
    if value == {"none": True}:
        return None
    return tuple(_plain(v) for v in value) if isinstance(value, list) else value
