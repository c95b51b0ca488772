"""One mutated input through its reader, and many of them through processes with a time limit."""

from __future__ import annotations

import multiprocessing
import resource
import shutil
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from random import Random

from forestall.errors import ForestallError

from .readers import READERS

READ, REFUSED, TRACEBACK, HANG, DIED, WRONG = (
    "read", "refused", "traceback", "hang", "died", "wrong proceed",
)  # fmt: skip
OUTCOMES = (READ, REFUSED, TRACEBACK, HANG, DIED, WRONG)
GOOD = (READ, REFUSED)

MEMORY_BYTES = 6 * 2**30
MOST_SENTENCE = 1500


@dataclass(frozen=True)
class Case:
    """Input `number` of a reader with a seed: always the same."""

    reader: str
    seed: int
    number: int


@dataclass(frozen=True)
class Result:
    """What came of a case; `text` is the sentence, or where the traceback ends."""

    case: Case
    outcome: str
    text: str = ""


def run_case(case: Case, keep: Path | None = None) -> Result:
    """Make the input, read it, clean up.

    Args:
        case: which one.
        keep: where the input is left, if it is a file.
    """
    reader = READERS[case.reader]
    rng = Random(f"{case.seed}/{case.reader}/{case.number}")
    folder = Path(tempfile.mkdtemp(prefix="forestall-fuzz-"))
    try:
        given = reader.make(folder, rng)
        if keep is not None:
            shutil.copytree(folder, keep, dirs_exist_ok=True)
        return _outcome(case, lambda: reader.read(given))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _outcome(case: Case, read: object) -> Result:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = read()  # type: ignore[operator]
        return Result(case, found or READ)
    except ForestallError as error:
        text = str(error)
        one = "\n" not in text and 0 < len(text) <= MOST_SENTENCE
        return Result(
            case, REFUSED if one else TRACEBACK, text if one else f"no sentence: {text!r:.200}"
        )
    except Exception as error:  # noqa: BLE001 - that is what is looked for
        ours = [f for f in traceback.extract_tb(error.__traceback__) if "forestall" in f.filename]
        last = ours[-1] if ours else traceback.extract_tb(error.__traceback__)[-1]
        where = f"{last.filename.rpartition('forestall/')[2]}:{last.lineno}"
        return Result(case, TRACEBACK, f"{type(error).__name__} {where} {str(error)[:120]!r}")


def run_all(cases: list[Case], jobs: int, limit_s: float) -> Iterator[Result]:
    """Every case, in whatever order they end; a worker that hangs or dies is replaced.

    Args:
        cases: to run.
        jobs: processes.
        limit_s: seconds that one input may take.
    """
    todo = list(reversed(cases))
    workers: dict[Connection, _Worker] = {}
    while todo or workers:
        while todo and len(workers) < jobs:
            worker = _Worker()
            workers[worker.link] = worker
            worker.give(todo.pop(), limit_s)
        ready = wait(list(workers), timeout=0.2)
        for link in list(workers):
            worker = workers[link]
            if link in ready:
                result = worker.answer()
            elif time.monotonic() > worker.until:
                worker.process.kill()
                result = Result(worker.case, HANG, f"over {limit_s:g} s")
            else:
                continue
            yield result
            alive = worker.process.is_alive() and result.outcome not in (HANG, DIED)
            if alive and todo:
                worker.give(todo.pop(), limit_s)
                continue
            worker.process.kill()
            worker.process.join()
            del workers[link]


class _Worker:
    """One process that is given a case at a time."""

    case: Case
    until: float

    def __init__(self) -> None:
        context = multiprocessing.get_context("fork")
        self.link, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self.process.start()
        theirs.close()

    def give(self, case: Case, limit_s: float) -> None:
        self.case, self.until = case, time.monotonic() + limit_s
        self.link.send(case)

    def answer(self) -> Result:
        try:
            found = self.link.recv()
            assert isinstance(found, Result)
            return found
        except EOFError:
            return Result(self.case, DIED, "the process ended")


def _serve(link: Connection) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    while True:
        link.send(run_case(link.recv()))
