"""JSON and TOML of others as plain values: finite, unambiguous, not too deep and not too many.

Called by the readers of graphs, records, results, memories, tasks, domains and configurations;
calls `files`.
"""

from __future__ import annotations

import datetime
import json
import math
import re
import tomllib
from pathlib import Path
from typing import Any, NoReturn

from forestall.errors import FileFormatError
from forestall.reading.files import MOST_BYTES, read_text

MAX_DEPTH = 64
"""How deep lists and objects may nest; ours are at most twelve deep."""

MOST_VALUES = 4_000_000
"""How many values a document may have."""

MOST_TOML_BYTES = 2**20
"""How large a TOML or PDDL file may be; ours have at most 60 KiB."""

_LARGEST = 2**63
_UNUSUAL_NUMBER = re.compile(r"[0-9]{19}|[0-9][eE]\+?[0-9]{3}")
_BETWEEN_KEYS = re.compile(r"[=,{}\[\]\n]")


def read_json(path: Path, what: str, most: int = MOST_BYTES) -> Any:
    """The content of a JSON file.

    Args:
        path: of the file.
        what: it should be, e.g. "scene graph", for the sentence.
        most: bytes that it may have.

    Raises:
        FileFormatError: it cannot be read, or is no JSON as `parse_json` takes it; with the file.
    """
    text = read_text(path, what, most)
    if not text.strip():
        raise FileFormatError(f"{path} is empty: no {what}")
    try:
        return parse_json(text)
    except FileFormatError as error:
        raise FileFormatError(f"{path}: {error}") from error


def parse_json(text: str) -> Any:
    """Parse a JSON document.

    Raises:
        FileFormatError: damaged, or it holds what no file of ours does: a key twice in an object,
            a number that is not finite or has more than 64 bit, half of a character, more than
            `MAX_DEPTH` levels or `MOST_VALUES` values.
    """
    if text.count(",") + text.count("[") + text.count("{") > MOST_VALUES:
        raise FileFormatError(f"it has more than {MOST_VALUES} values")
    hooks: dict[str, Any] = {}
    if _UNUSUAL_NUMBER.search(text):
        hooks = {"parse_int": _whole, "parse_float": _decimal}
    try:
        data = json.loads(
            text, parse_constant=_no_constant, object_pairs_hook=_unambiguous, **hooks
        )
    except json.JSONDecodeError as error:
        raise FileFormatError(f"damaged or truncated (line {error.lineno}): {error.msg}") from error
    except _NumberError as error:
        line = text.count("\n", 0, max(text.find(error.digits), 0)) + 1
        raise FileFormatError(f"line {line}: {error}") from error
    except RecursionError as error:
        raise FileFormatError("damaged: it nests too deeply") from error
    except ValueError as error:
        raise FileFormatError(f"damaged: {error}") from error
    _check_depth(data)
    if "\\u" in text:
        _check_characters(data)
    return data


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises:
        FileFormatError: it cannot be read, or is no TOML as `parse_toml` takes it; with the file.
    """
    return parse_toml(read_text(path, what, MOST_TOML_BYTES), str(path))


def parse_toml(text: str, source: str) -> dict[str, Any]:
    """Parse a TOML document.

    Args:
        text: of the document.
        source: its name in errors.

    Raises:
        FileFormatError: damaged, or it holds a date, a number that is not finite or has more than
            64 bit, or more than `MAX_DEPTH` levels.
    """
    try:
        if any(part.count(".") >= MAX_DEPTH for part in _BETWEEN_KEYS.split(text)):
            raise FileFormatError(f"a key of more than {MAX_DEPTH} parts")  # quadratic to parse
        data = tomllib.loads(text)
        _check_depth(data)
        _check_toml(data, "")
    except FileFormatError as error:
        raise FileFormatError(f"{source}: {error}") from error
    except (ValueError, RecursionError) as error:  # TOMLDecodeError is a ValueError
        told = "it nests too deeply" if isinstance(error, RecursionError) else str(error)
        raise FileFormatError(f"{source}: not valid TOML: {told}") from error
    return data


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number in JSON")


def _unambiguous(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key {next(k for k in keys if keys.count(k) > 1)!r} is given twice")
    return found


class _NumberError(ValueError):
    def __init__(self, digits: str, why: str) -> None:
        shown = digits if len(digits) <= 24 else f"{digits[:21]}..."
        super().__init__(f"the number {shown} {why}")
        self.digits = digits


def _whole(digits: str) -> int:
    if len(digits) > 20 or not -_LARGEST <= int(digits) < _LARGEST:
        raise _NumberError(digits, "has more than 64 bit")
    return int(digits)


def _decimal(digits: str) -> float:
    number = float(digits)
    if not math.isfinite(number):
        raise _NumberError(digits, "is too large")
    return number


def _check_characters(data: Any) -> None:
    try:
        json.dumps(data, ensure_ascii=False).encode("utf-8")
    except UnicodeEncodeError as error:
        raise FileFormatError("damaged: it has half of a character") from error


def _check_depth(data: Any) -> None:
    level = [data]
    for _ in range(MAX_DEPTH):
        level = [
            inner
            for value in level
            if isinstance(value, dict | list)
            for inner in (value.values() if isinstance(value, dict) else value)
        ]
        if not level:
            return
    raise FileFormatError(f"damaged: it nests more than {MAX_DEPTH} deep")


def _check_toml(value: Any, place: str) -> None:
    if isinstance(value, dict):
        for key, inner in value.items():
            _check_toml(inner, f"{place}.{key}" if place else key)
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            _check_toml(inner, f"{place}[{number}]")
    elif isinstance(value, float) and not math.isfinite(value):
        raise FileFormatError(f"{place}: a finite number is expected, got {value}")
    elif isinstance(value, int) and not -_LARGEST <= value < _LARGEST:
        raise FileFormatError(f"{place}: the number has more than 64 bit")
    elif isinstance(value, datetime.date | datetime.time):
        raise FileFormatError(f"{place}: a date or time is nothing that is known here")
