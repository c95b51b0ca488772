"""Commands that get killed, each with what must be true of its files meanwhile and at the end.

Used by `test_kills`. All of them work in symbolic worlds, or on pictures that cost nothing to draw:
what is tested is what they leave behind.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

import numpy as np

from forestall.memory.store import open_store
from forestall.records.record import RECORD_NAME, read_record
from forestall.training import shards
from forestall.training.scenes import Picture
from forestall.types.episode import EpisodeEnd
from forestall.types.observation import Frame, Intrinsics

MARK = "FORESTALL_TEST_VICTIM"
"""An environment variable by which the processes of one command know each other."""

FORESTALL = (sys.executable, "-m", "forestall")


@dataclass(frozen=True)
class Victim:
    """A command and its files.

    Args:
        arguments: of the interpreter; "{out}" stands for the files.
        shared: whether two of them may write at once; else the second is refused.
    """

    arguments: tuple[str, ...]
    shared: bool = False

    def start(self, folder: Path) -> Started:
        mark = uuid4().hex
        environment = os.environ | {MARK: mark, "FORESTALL_CACHE": str(folder / "cache")}
        command = [a.format(out=folder / "out") for a in self.arguments]
        process = subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        return Started(process, mark)

    def finished(self, folder: Path) -> frozenset[str]:
        """What is finished, by name; checks that all of it is whole."""
        raise NotImplementedError


@dataclass(frozen=True)
class Started:
    """A command that runs."""

    process: subprocess.Popen[str]
    mark: str

    def kill(self, after_s: float) -> bool:
        """Kill it after a while, its workers not with it; whether it was still running."""
        try:
            self.process.wait(after_s)
        except subprocess.TimeoutExpired:
            self.process.send_signal(signal.SIGKILL)
            self.process.communicate()
            return True
        return False

    def end(self) -> tuple[int, str]:
        """Wait for it; its exit code and what it said of itself."""
        _, said = self.process.communicate(timeout=300)
        return self.process.returncode, said

    def left_over(self, patience_s: float = 20.0) -> list[int]:
        """Processes that it started and that are still there after so long."""
        deadline = time.monotonic() + patience_s
        while (found := list(marked(self.mark))) and time.monotonic() < deadline:
            time.sleep(0.05)
        return found


def marked(mark: str) -> Iterator[int]:
    """Processes whose environment says that they belong to a command."""
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                inherited = (entry / "environ").read_bytes()
                state = (entry / "stat").read_text().rpartition(")")[2].split()[0]
            except OSError:
                continue
            if f"{MARK}={mark}".encode() in inherited and state != "Z":
                yield int(entry.name)


class Recording(Victim):
    """Demonstrations, two at a time."""

    def finished(self, folder: Path) -> frozenset[str]:
        memory = folder / "out"
        if not memory.exists():
            return frozenset()
        with open_store(memory, create=True) as store:
            names = [d.id for d in store.all()]
            assert len(store.recorded()) == len(names)
        return frozenset(names)


class Run(Victim):
    """One run with its record and its page; the demonstrations of its task are made before."""

    def finished(self, folder: Path) -> frozenset[str]:
        out, done = folder / "out", set()
        for memory in (folder / "cache" / "memory").glob("*.db"):
            with open_store(memory) as store:
                assert len(store.required()) == 4
            done.add("demonstrations")
        if (out / RECORD_NAME).exists():
            assert read_record(out).end is EpisodeEnd.PLAN_FINISHED
            done.add("record")
        elif out.exists() and (out / "boundaries.jsonl").exists():
            lines = (out / "boundaries.jsonl").read_text("utf-8")
            if "\n" in lines:
                assert read_record(out).end is EpisodeEnd.UNFINISHED
        if (out / "index.html").exists():
            assert "record" in done, "a page without the record that it shows"
            done.add("page")
        return frozenset(done)


class Episodes(Victim):
    """An experiment of eight episodes, two at a time."""

    def finished(self, folder: Path) -> frozenset[str]:
        file = folder / "out" / "episodes.jsonl"
        whole = file.read_text("utf-8").rpartition("\n")[0] if file.exists() else ""
        rows = [json.loads(line) for line in whole.splitlines()]
        assert not any(r["error"] for r in rows)
        names = [f"{r['task']} {r['strategy']} {r['seed']}" for r in rows]
        assert len(names) == len(set(names)), "an episode is there twice"
        return frozenset(names)


class Pictures(Victim):
    """The encoder's pictures, four shards, two at a time."""

    def finished(self, folder: Path) -> frozenset[str]:
        out = folder / "out"
        for split in ("train", "test"):
            if list((out / split).glob("*.npz")):
                crops = shards.read(out, split)
                assert len(crops.pixels) == len(crops.frame)
        return frozenset(str(p.relative_to(out)) for p in out.rglob("*.npz"))


class Blank:
    """Draws one grey picture for each scene, and takes its time."""

    def __init__(self, *_: object) -> None:
        self.shown: set[str] = set()

    def pictures(self, seed: int) -> Iterator[Picture]:
        time.sleep(0.01)
        grey = np.full((48, 64, 3), seed % 256, np.uint8)
        depth, eye = np.ones((48, 64), np.float32), np.eye(4)
        ids = np.full((48, 64), -1, np.int32)
        camera = Intrinsics.from_vertical_fov(64, 48, 60.0)
        yield Picture(seed, 0, Frame(grey, depth, camera, eye, ids, ()), {})


def make_shard(*arguments: object) -> Path:
    """As `shards.make_shard`, of blank pictures."""
    setattr(shards, "Artist", Blank)  # noqa: B010 - not what the type says
    return drawn(*arguments)  # type: ignore[arg-type]


drawn = shards.make_shard


def main(arguments: Sequence[str]) -> int:
    """`forestall` with blank pictures."""
    from forestall.cli.main import call

    setattr(shards, "make_shard", make_shard)  # noqa: B010
    return call(arguments)


VICTIMS = {
    "recording": Recording(
        (*FORESTALL, "demos", "record", "{out}", "--task", "glue-peg", "hand-over-washer",
         "--kitchens", "3", "--jobs", "2"), shared=True
    ),
    "run": Run(
        (*FORESTALL, "run", "hand-over-washer", "--scenario", "tray-full", "--out", "{out}")
    ),
    "experiment": Episodes(
        (*FORESTALL, "bench", "episodes", "--task", "glue-peg", "--strategy", "none", "proactive",
         "--seeds", "0:4", "--jobs", "2", "--out", "{out}")
    ),
    "pictures": Pictures(
        (sys.executable, str(Path(__file__)), "encoder", "pictures", "--out", "{out}", "--train",
         "60", "--development", "20", "--test", "20", "--unseen", "20", "--jobs", "2")
    ),
}  # fmt: skip

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))
    import victims  # by the name under which workers find it

    sys.exit(victims.main(sys.argv[1:]))
