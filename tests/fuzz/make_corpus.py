"""Makes the corpus anew: `python -m tests.fuzz.make_corpus`. Nothing in it is anybody's data."""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

CORPUS = Path(__file__).parent / "corpus"
TESTS = Path(__file__).parents[1]


def main() -> None:
    """Write every file of the corpus."""
    sys.path.insert(0, str(TESTS))
    shutil.rmtree(CORPUS, ignore_errors=True)
    for make in (graphs, records, results, memories, observations, texts):
        make()
    sizes = [p.stat().st_size for p in CORPUS.rglob("*") if p.is_file()]
    print(f"{len(sizes)} files, {sum(sizes) / 1024:.0f} KiB")


def folder(*names: str) -> Path:
    """A folder of the corpus."""
    path = CORPUS.joinpath(*names)
    path.mkdir(parents=True, exist_ok=True)
    return path


def graphs() -> None:
    """Two scene graphs, one with features."""
    from report.graphs import observed_graph

    from forestall.types.plan import Subtask

    graph = observed_graph(Subtask.parse("put_in(Plate-1, Microwave-1)"))
    nodes = tuple(replace(n, feature=bytes([1, 255, 3, 127])) for n in graph.nodes)
    for name, found in (("plain", graph), ("featured", replace(graph, nodes=nodes))):
        (folder("graph") / f"{name}.json").write_text(json.dumps(found.to_json()))


def records() -> None:
    """A finished run, and what a killed one leaves."""
    from report import records as made

    from forestall.records.record import LINES_NAME, RECORD_NAME, RunRecorder, write_record

    record = made.potato_record()
    small = replace(record, boundaries=record.boundaries[6:9])
    write_record(folder("record", "finished"), small)
    killed = folder("record", "killed")
    recorder = RunRecorder(killed)
    made.play(recorder, small) if hasattr(made, "play") else None
    if not (killed / LINES_NAME).exists():
        lines = [{"event": "start", **_head(folder("record", "finished") / RECORD_NAME)}]
        data = json.loads((folder("record", "finished") / RECORD_NAME).read_text())
        lines += [{"event": "boundary", "boundary": b, "alarm": None} for b in data["boundaries"]]
        lines += [{"event": "executed", "time_s": 3.0, "executed": e} for e in data["executed"][:2]]
        (killed / LINES_NAME).write_text("".join(json.dumps(x) + "\n" for x in lines))


def _head(file: Path) -> dict[str, object]:
    data = json.loads(file.read_text())
    later = ("boundaries", "executed", "events", "final", "alarms", "compute_s", "end", "success")
    return {k: v for k, v in data.items() if k not in later}


def results() -> None:
    """A folder of an experiment with a few episodes."""
    from experiments.episodes import computed_row
    from forestall.experiments.conduct import Experiment, conduct
    from forestall.experiments.runs import Choice

    out = folder("results", "all")
    choice = Choice("proactive", "development", limit=1)
    conduct(Experiment(choice, 1, "inline"), out, lambda *a: None, computed_row, lambda *a: None)
    for lock in out.glob(".*"):
        lock.unlink()


def memories() -> None:
    """A memory of two demonstrations of the observation's scene."""
    from forestall.memory.store import open_store

    from .scene import demonstrations

    path = folder("memory") / "memory.db"
    with open_store(path, create=True) as store:
        for demonstration in demonstrations():
            store.add(demonstration)
    for left in path.parent.glob("memory.db-*"):
        left.unlink()


def observations() -> None:
    """The same observation with masks in one PNG, and with one array for each."""
    from forestall.perception.folder import write_observation

    from .scene import observation, with_masks

    write_observation(folder("observation", "ids"), observation())
    write_observation(folder("observation", "masks"), with_masks(observation()))
    for place in ("ids", "masks"):
        depth = CORPUS / "observation" / place / "depth.npy"
        np.save(depth, np.load(depth))


def texts() -> None:
    """Task, scenario, domain and configuration files."""
    from domain.pddl_corpus import FOLDER
    from domain.test_load_errors import GOOD

    (folder("domain") / "bench.toml").write_text(GOOD)
    for name in ("task.toml", "scenario.toml", "config.toml"):
        shutil.copy(Path(__file__).parent / "seeds" / name, folder(name.removesuffix(".toml")))
    names = sorted(p.stem for p in FOLDER.glob("*.annotations.toml"))
    for name in (names or ["x"])[:2]:
        stem = name.removesuffix(".annotations")
        for file in FOLDER.glob(f"{stem}.*"):
            shutil.copy(file, folder("pddl"))


if __name__ == "__main__":
    main()
