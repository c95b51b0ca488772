"""A study as it lies in its folder: items, who is shown what, and the file that holds both.

Read and written by everything else in this package; calls `reading`. `study.json` is written once,
before anybody is asked, and never changed: what people answer lies beside it (`answers.py`).
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import ConfigDict, TypeAdapter

from forestall.errors import FileFormatError, InputError
from forestall.files import replace_file
from forestall.reading.files import inside, read_text
from forestall.reading.models import validated_json

STUDY_NAME = "study.json"
PICTURES_NAME = "pictures"
ANSWERS_NAME = "answers"
CAUSE = "the true cause"
"""What is right in an attention check, in the place of a detector's name."""

Side = Literal["a", "b"]
_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True, slots=True)
class Explanation:
    """What one detector says.

    Args:
        detector: whose.
        text: in words.
        writer: who made the sentence of what the detector noticed: "templates" or "model".
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    detector: str
    text: str
    writer: str


@dataclass(frozen=True, slots=True)
class Item:
    """One failing boundary.

    Args:
        name: unique in the study.
        task: in words. `step`: what the robot is about to do, in words.
        cause: the true one, in words.
        expected: picture of what should be seen, a file of the folder.
        expected_from: where that picture comes from, in words.
        actual: picture of what is seen.
        explanations: one of each detector, ours first.
        source: where it comes from: folder of the run, task, scenario, seed, boundary.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    name: str
    task: str
    step: str
    cause: str
    expected: str
    expected_from: str
    actual: str
    explanations: tuple[Explanation, ...]
    source: dict[str, Any] = field(hash=False)

    def said_by(self, detector: str) -> str:
        """The explanation of a detector."""
        return next(e.text for e in self.explanations if e.detector == detector)


@dataclass(frozen=True, slots=True)
class Trial:
    """What one rater is shown once.

    Args:
        item: its name.
        against: the detector beside ours; in an attention check the item whose cause stands
            beside the true one.
        ours: the side of ours; in an attention check that of the true cause.
        check: whether it is an attention check.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    item: str
    against: str
    ours: Side
    check: bool = False


@dataclass(frozen=True)
class Study:
    """All of it.

    Args:
        ours: the detector that every other is compared with. `against`: the others.
        seed: of choice, order and sides.
        items: in order.
        raters: for each rater, what he is shown, in order.
        left_out: reason → how many boundaries or runs are no items because of it.
        version: of the software that made it.
        format: of the file.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT

    ours: str
    against: tuple[str, ...]
    seed: int
    items: tuple[Item, ...]
    raters: tuple[tuple[Trial, ...], ...]
    left_out: dict[str, int] = field(hash=False)
    version: str
    kind: Literal["human study"] = "human study"
    format: Literal[1] = 1

    def item(self, name: str) -> Item:
        """An item by its name."""
        return next(i for i in self.items if i.name == name)

    def texts(self, trial: Trial) -> tuple[str, str]:
        """What stands on the sides a and b."""
        item = self.item(trial.item)
        if trial.check:
            right, other = item.cause, self.item(trial.against).cause
        else:
            right, other = item.said_by(self.ours), item.said_by(trial.against)
        return (right, other) if trial.ours == "a" else (other, right)

    @cached_property
    def digest(self) -> str:
        """Sixteen hexadecimal digits of all of it: answers name the study that they are of."""
        text = json.dumps(asdict(self), sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


def write_study(folder: Path, study: Study) -> Path:
    """Write `study.json`.

    Returns:
        Its path.
    """
    path = folder / STUDY_NAME
    text = json.dumps(asdict(study), indent=1, ensure_ascii=False)
    replace_file(path, f"{text}\n".encode())
    return path


def read_study(folder: Path) -> Study:
    """The study of a folder.

    Raises:
        InputError: there is none; says how one is made.
        FileFormatError: the file does not hold one, or names what is not there.
    """
    path = folder / STUDY_NAME
    if not path.is_file():
        raise InputError(
            f"{folder} holds no study: make one with forestall study make {folder} --from RESULTS"
        )
    text = read_text(path, "study")
    try:
        study = validated_json(_study(), text)
        _check(study, folder)
    except FileFormatError as error:
        raise FileFormatError(f"{path}: {error}") from error
    return study


def _check(study: Study, folder: Path) -> None:
    """See that everything that is named is there."""
    items = {i.name: i for i in study.items}
    if len(items) < len(study.items):
        raise FileFormatError("two items have the same name")
    detectors = {study.ours, *study.against}
    for item in study.items:
        if lacking := detectors - {e.detector for e in item.explanations}:
            raise FileFormatError(f"{item.name} has no explanation of {min(lacking)}")
        for picture in (item.expected, item.actual):
            if not inside(folder, picture).is_file():
                raise FileFormatError(f"{item.name}: the picture {picture} is not there")
    for number, trials in enumerate(study.raters, 1):
        for trial in trials:
            known = items if trial.check else study.against
            if trial.item not in items or trial.against not in known:
                raise FileFormatError(
                    f"rater {number} is shown {trial.item} against {trial.against}: no such thing"
                )


@cache
def _study() -> TypeAdapter[Study]:
    return TypeAdapter(Study)
