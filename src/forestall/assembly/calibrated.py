"""Gives a detector the thresholds of a calibration, if that was made with the same parts.

Called by the factories in `judging` and by `calibrating`; calls calibration.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from forestall.assembly.options import plain
from forestall.calibration.file import read_calibration
from forestall.calibration.fitted import CalibrationTable, JudgeThresholds
from forestall.errors import InputError
from forestall.kinds import RETRIEVER, TEXT_ENCODER
from forestall.seams.running import Parts
from forestall.types.demonstration import Demonstration

SET_BY_SCORE = "threshold"
"""The option that a calibration stands for, where a detector has a score and not a yes or no."""

TASK = "task"
"""What a run lends: the name of its task."""


def calibrated(parts: Parts, file: Path | None, judge: str, *used: Any) -> JudgeThresholds | None:
    """The thresholds of a file for a judge; None where there is no file.

    Args:
        parts: of the run.
        file: of `forestall calibrate`.
        judge: the detector's name.
        used: its options dataclasses.

    Raises:
        FileFormatError: the file cannot be read.
        InputError: it was made with other options or other demonstrations.
    """
    if file is None:
        return None
    table = read_calibration(file)
    if judge not in table.scores.judges:
        known = ", ".join(table.scores.judges)
        raise InputError(f"the calibration {file} is of {known}, not of {judge}: make one of it")
    own = options_of(parts, {k: v for one in used for k, v in asdict(one).items()})
    check_same(file, judge, table.options.get(judge, {}), own)
    check_memory(file, table, parts.demonstrations)
    return table.of(judge, _task(parts))


def options_of(parts: Parts, own: Mapping[str, Any]) -> dict[str, Any]:
    """Everything that a score depends on as plain data: a detector's options, and its references'.

    Args:
        parts: of the run.
        own: the detector's options.
    """
    found = {name: plain(value) for name, value in own.items() if name != "calibration"}
    found["retriever"] = parts.name(RETRIEVER)
    found |= {f"retriever {k}": plain(v) for k, v in parts.options(RETRIEVER).items()}
    found["text-encoder"] = parts.name(TEXT_ENCODER)
    return found


def check_same(file: Path, judge: str, made: Mapping[str, Any], own: Mapping[str, Any]) -> None:
    """See that a calibration was made with the options of this run.

    What the score is compared with is not among them, where the file does not name it.

    Raises:
        InputError: it was not; names the first option that differs.
    """
    for name in sorted({*made, *own} - ({SET_BY_SCORE} - {*made})):
        if made.get(name) != own.get(name):
            raise InputError(
                f"the calibration {file} of {judge} was made with {name} = {made.get(name)}, this "
                f"run has {own.get(name)}: run forestall calibrate with the same options"
            )


def check_memory(
    file: Path, table: CalibrationTable, demonstrations: Sequence[Demonstration]
) -> None:
    """See that a run compares with the demonstrations that its calibration was made with.

    The same runs that other eyes have seen (`forestall demos perceive`) are others.

    Raises:
        InputError: it does not.
    """
    if table.memory != digest_of_memory(demonstrations):
        raise InputError(
            f"the calibration {file} was made with {table.demonstrations} demonstrations, and this "
            f"run compares with {len(demonstrations)} that are others or were seen otherwise: run "
            "forestall calibrate on its memory"
        )


def digest_of_memory(demonstrations: Sequence[Demonstration]) -> str:
    """Sixteen hexadecimal digits of what demonstrations show and who saw it, in any order."""
    hasher = hashlib.blake2b(digest_size=8)
    for d in sorted(demonstrations, key=lambda d: d.id):
        wholes = (*(s.whole for s in d.steps), *(() if d.final is None else (d.final,)))
        steps = [(s.index, str(s.subtask)) for s in d.steps]
        head = (d.id, d.task, sorted(d.perception), steps)
        forms = [replace(g, subtask=None).to_json() for g in wholes]
        hasher.update(json.dumps([head, forms], sort_keys=True).encode())
    return hasher.hexdigest()


def _task(parts: Parts) -> str | None:
    try:
        return str(parts.lent(TASK))
    except InputError:  # a monitor of many tasks
        return None
