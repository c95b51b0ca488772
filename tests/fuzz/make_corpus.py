"""Makes the corpus anew: `python -m tests.fuzz.make_corpus`. Nothing in it is anybody's data."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

from experiments.episodes import computed_row
from forestall.experiments.conduct import Experiment, conduct
from forestall.experiments.runs import Choice
from forestall.memory.store import open_store
from forestall.perception.folder import write_observation
from forestall.records.record import RunRecorder, write_record
from forestall.types.plan import Subtask
from report import records as made
from report.graphs import observed_graph

from . import scene

CORPUS = Path(__file__).parent / "corpus"
SEEDS = Path(__file__).parent / "seeds"
PDDL = Path(__file__).parents[1] / "domain" / "pddl"


def main() -> None:
    """Write every file of the corpus."""
    shutil.rmtree(CORPUS, ignore_errors=True)
    for make in (graphs, records, results, memories, observations, texts):
        make()


def folder(*names: str) -> Path:
    """A folder of the corpus."""
    path = CORPUS.joinpath(*names)
    path.mkdir(parents=True, exist_ok=True)
    return path


def graphs() -> None:
    """Two scene graphs, one with features, and demonstrations that a person wrote."""
    graph = observed_graph(Subtask.parse("put_in(Plate-1, Microwave-1)"))
    nodes = tuple(replace(n, feature=bytes([1, 255, 3, 127])) for n in graph.nodes)
    for name, found in (("plain", graph), ("featured", replace(graph, nodes=nodes))):
        (folder("graph") / f"{name}.json").write_text(json.dumps(found.to_json()))
    short = {
        "objects": {"peg-1": {"grade": "fine", "box": [[0, 0, 0], [0.1, 0.1, 0.1]]}, "hole-2": {}},
        "relations": [["peg-1", "held_by", "gripper"], "hole-2 part_of peg-1"],
        "unseen": ["hole-2"],
    }
    steps = [{"subtask": "insert(peg-1, hole-2)", "scene": short}]
    written = {"task": "insert-peg", "steps": [*steps, ["grasp(peg-1)", short]], "final": short}
    (folder("demonstration") / "short.json").write_text(json.dumps(written))


def records() -> None:
    """A finished run, and what a killed one leaves."""
    record = made.potato_record()
    small = replace(record, boundaries=record.boundaries[6:9])
    write_record(folder("record", "finished"), small)
    made.follow(RunRecorder(folder("record", "killed")), small, 2)


def results() -> None:
    """A folder of an experiment with a few episodes."""
    out = folder("results", "all")
    choice = Choice("proactive", "development", limit=1)
    conduct(Experiment(choice, 1, "inline"), out, lambda *a: None, computed_row, lambda *a: None)
    for lock in out.glob(".*"):
        lock.unlink()
    calls = [json.loads(line) for line in (out / "effort.jsonl").read_text().splitlines()]
    plain = {"machine": "a machine", "python": "3.11", "date": "2026-01-01", "seconds": 2.5}
    (out / "effort.jsonl").write_text("".join(json.dumps(c | plain) + "\n" for c in calls))


def memories() -> None:
    """A memory of two demonstrations of the observation's scene."""
    path = folder("memory") / "memory.db"
    with open_store(path, create=True) as store:
        scene.memory(store)
    for left in path.parent.glob("memory.db-*"):
        left.unlink()


def observations() -> None:
    """The same observation with masks in one PNG, and with one array for each."""
    write_observation(folder("observation", "ids"), scene.observation())
    write_observation(folder("observation", "masks"), scene.with_masks(scene.observation()))


def texts() -> None:
    """Task, scenario, domain and configuration files."""
    for name in ("task", "scenario", "config", "domain"):
        shutil.copy(SEEDS / f"{name}.toml", folder(name))
    for stem in ("ferry", "coffee"):
        for file in PDDL.glob(f"{stem}.*pddl"):
            shutil.copy(file, folder("pddl"))


if __name__ == "__main__":
    main()
