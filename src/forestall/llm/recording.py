"""Answers of a language model in a file, and a run repeated from it without a network.

Built by `assembly`. One line for each question, written at once: a run that was killed can be
repeated as far as it came. An answer is found by its request's key; the same question asked twice
has two lines, and their order counts.
"""

from __future__ import annotations

import json
from collections import defaultdict, deque
from dataclasses import asdict
from pathlib import Path
from typing import Any

from forestall.deadline import Deadline
from forestall.errors import FileFormatError, InputError
from forestall.files import naming
from forestall.reading.documents import parse_json
from forestall.reading.fields import Field
from forestall.reading.files import read_text
from forestall.seams.language import LanguageModel
from forestall.types.exchange import Exchange, Request

KIND = "forestall language model answers"
FORMAT = 1
_WHAT = "recording of a language model"
_ANSWER = (
    "answer", "problem", "images", "prompt_tokens", "answer_tokens", "cost", "seconds", "tries",
)  # fmt: skip


class RecordingModel:
    """Asks another model and writes down what came (implements `LanguageModel`).

    Args:
        model: that is asked.
        path: of the file, which must not be there: answers cost money and are not written over.

    Raises:
        InputError: the file is there already, or cannot be written.
    """

    def __init__(self, model: LanguageModel, path: Path | str) -> None:
        self._model, self._path = model, Path(path)
        self.name = model.name
        try:
            with self._path.open("x", encoding="utf-8", newline="\n") as file:
                file.write(_line({"kind": KIND, "format": FORMAT, "model": self.name}))
        except FileExistsError as error:
            raise InputError(
                f"{path} is there already: replay:{path} repeats its run; to record anew, name "
                "another file"
            ) from error
        except OSError as error:
            raise InputError(f"{path} cannot be written: {error.strerror}") from error

    def ask(self, request: Request, deadline: Deadline | None = None) -> Exchange:
        """As the model."""
        found = self._model.ask(request, deadline)
        data = asdict(found)
        said = {name: data[name] for name in _ANSWER}
        line = {"key": found.key, "request": request.to_json(), **said}
        with naming(self._path), self._path.open("a", encoding="utf-8", newline="\n") as file:
            file.write(_line(line))
        return found


class ReplayingModel:
    """Answers from a file (implements `LanguageModel`).

    Args:
        path: that a run with `record` wrote.

    Raises:
        FileFormatError: it is none, with file and line.
    """

    def __init__(self, path: Path | str) -> None:
        self._path = Path(path)
        self._answers: dict[str, deque[dict[str, Any]]] = defaultdict(deque)
        rows = read_text(self._path, _WHAT).splitlines()
        if not rows:
            raise FileFormatError(f"{path} is empty: no {_WHAT}")
        self.name = ""
        for number, row in enumerate(rows, 1):
            try:
                field = Field(parse_json(row))
                if number == 1:
                    self.name = _model_of(field)
                elif row.strip():
                    self._answers[field["key"].text()].append(_answer(field))
            except FileFormatError as error:
                if number == len(rows) > 1:  # the line that was being written when it was killed
                    break
                raise FileFormatError(f"{path}, line {number}: {error}") from error

    def ask(self, request: Request, deadline: Deadline | None = None) -> Exchange:
        """The next answer to this very request.

        Raises:
            InputError: there is none (any more); says to which request.
        """
        key = request.key(self.name)
        answers = self._answers.get(key)
        if not answers:
            text = next((t for r, t in reversed(request.messages) if r == "user"), "")
            about = " / ".join(text.split("\n"))
            more = "" if answers is None else ", all of its answers to it are used"
            raise InputError(
                f"{self._path} has no answer to the {request.purpose} request {key}{more}: "
                f"{about[:300]}"
            )
        return Exchange(
            purpose=request.purpose, model=self.name, key=key, messages=request.messages,
            **answers.popleft(),
        )  # fmt: skip


def _line(data: dict[str, Any]) -> str:
    return json.dumps(data, ensure_ascii=False, allow_nan=False) + "\n"


def _model_of(field: Field) -> str:
    if not isinstance(field.value, dict) or field.value.get("kind") != KIND:
        raise FileFormatError(f"this is no {_WHAT}")
    if field.value.get("format") != FORMAT:
        raise FileFormatError(
            f"it has format {field.value.get('format')!r}: this version reads {FORMAT}"
        )
    return field["model"].text()


def _answer(field: Field) -> dict[str, Any]:
    return {
        "answer": field.maybe("answer", Field.text),
        "problem": field["problem"].text(),
        "images": field["images"].whole(),
        "prompt_tokens": field.maybe("prompt_tokens", Field.whole),
        "answer_tokens": field.maybe("answer_tokens", Field.whole),
        "cost": field.maybe("cost", Field.number),
        "seconds": field["seconds"].number(),
        "tries": field["tries"].whole(),
    }
