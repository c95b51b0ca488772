"""Factory of what a language model expects, and the file that keeps what it said.

Named in `tables`, called through `parts`; calls diagnosis and comparison. The file stands beside
the memory or wherever it is told to: people read it, and may take out what is wrong. It is
evidence of its own: recording, mining and counting of demonstrations never read it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from forestall.comparison.expectations import LEAST_SHOWN, WEIGHT, Expected
from forestall.diagnosis.expecting import ModelExpectations
from forestall.domain.model import Domain
from forestall.errors import FileFormatError, ForestallError, InputError, UnknownNameError
from forestall.files import naming
from forestall.kinds import LLM
from forestall.llm.answers import expected_fact
from forestall.reading.documents import read_toml
from forestall.reading.fields import Field
from forestall.seams.running import Parts
from forestall.types.facts import Literal, category_of
from forestall.types.plan import Subtask

TABLE = "expected"
KEYS = ("before", "task", "facts", "why", "source", "model")
SOURCE = "model"

_HEAD = """\
# What a language model expects before subtasks that no demonstration shows. It weighs less than any
# demonstration, and has no say where there is one. Take out what is wrong; what is not here is
# asked again.
"""


def model(
    parts: Parts, *, weight: float = WEIGHT, attempts: int = 2, file: Path | None = None
) -> ModelExpectations:
    """A language model writes what should hold before subtasks that no demonstration shows.

    Args:
        parts: llm, domain.
        weight: of a fact that it expects; below 2/3, what one demonstration weighs.
        attempts: answers that are asked for.
        file: keeps what it said, for further runs; without it, it is known in this run alone.
    """
    if not 0 < weight < LEAST_SHOWN:
        raise InputError(
            f"weight {weight:g} of what a language model expects: it must be above 0 and below "
            f"{LEAST_SHOWN:.2f}, which is the weight of one demonstration"
        )
    if attempts < 1:
        raise InputError(f"attempts is {attempts}: at least 1 is needed")
    domain = parts.domain
    kept = read_expected(file, domain) if file is not None and file.exists() else ()
    return ModelExpectations(
        parts.part(LLM),
        domain,
        weight,
        attempts=attempts,
        known=kept,
        keep=None if file is None else partial(keep, file),
    )


def beside(memory: Path) -> Path:
    """The file of expectations that belongs to a memory, where nobody names another."""
    return memory.with_name(f"{memory.name}.expected.toml")


def read_expected(path: Path, domain: Domain) -> tuple[Expected, ...]:
    """A file of expectations.

    Raises:
        FileFormatError: it cannot be read, or says what means nothing in the domain; with the
            place.
    """
    data = read_toml(path, "file of expectations")
    try:
        for key in data:
            if key != TABLE:
                raise UnknownNameError("table of expectations", key, (TABLE,))
        return tuple(_read(e, domain) for e in Field(data.get(TABLE, []), TABLE).items())
    except ForestallError as error:
        raise FileFormatError(f"{path}: {error}") from error


def keep(path: Path, said: Sequence[Expected]) -> None:
    """Add to a file; what stands there stays as it is.

    Raises:
        OSError: it cannot be written; names the file.
    """
    with naming(path), path.open("a", encoding="utf-8", newline="\n") as file:
        file.write(("" if file.tell() else _HEAD) + "".join(map(_written, said)))


def _read(entry: Field, domain: Domain) -> Expected:
    for key in entry.value if isinstance(entry.value, dict) else ():
        if key not in KEYS:
            raise InputError(f"{entry.place}: {UnknownNameError('key', str(key), KEYS)}")
    before = entry["before"].parsed(Subtask.parse)
    domain.check(before)
    for name in before.args:
        domain[name]
    if (source := entry["source"].text()) != SOURCE:
        raise InputError(f"{entry.place}.source is {source!r}: only {SOURCE!r} is evidence here")
    return Expected(
        before.skill,
        tuple(category_of(domain.canonical(a)) for a in before.args),
        entry["task"].text(),
        entry["facts"].tuple_of(lambda f: _fact(f, before, domain)),
        entry["model"].text(),
        entry["why"].text(),
    )


def _fact(field: Field, before: Subtask, domain: Domain) -> Literal:
    try:
        return expected_fact(field.text(), before, domain)
    except ForestallError as error:
        raise InputError(f"{field.place}: {error}") from error


def _written(expected: Expected) -> str:
    pairs = {
        "before": str(Subtask(expected.skill, expected.args)),
        "task": expected.task,
        "facts": [str(f) for f in expected.facts],
        "why": expected.why,
        "source": SOURCE,
        "model": expected.model,
    }
    lines = [f"{k} = {json.dumps(v, ensure_ascii=False)}" for k, v in pairs.items()]
    return "\n".join(("", f"[[{TABLE}]]", *lines, ""))
