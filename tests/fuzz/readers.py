"""Every reader: how a mutated input of it is made, and what is done with the input.

`make` writes one mutated input below a folder and returns what is to be read. `read` reads it and
goes on as the program does; it returns nothing, or an outcome of its own.
"""

from __future__ import annotations

import io
import json
import shutil
import sqlite3
import struct
import tomllib
import zipfile
import zlib
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any
from unittest import mock

import numpy as np
from PIL import Image

from . import live, logs, mutate, scene
from .make_corpus import CORPUS


@dataclass(frozen=True)
class Reader:
    """One reader; `make` may also give a value instead of a file."""

    make: Callable[[Path, Random], Any]
    read: Callable[[Any], str | None]


def _one(name: str, rng: Random) -> Path:
    return rng.choice(sorted((CORPUS / name).iterdir()))


def _copied(source: Path, folder: Path) -> Path:
    target = folder / source.name
    if source.is_dir():
        return shutil.copytree(source, target)
    shutil.copy(source, target)
    return target


def _document(name: str, write: Callable[[Any], bytes], load: Callable[[str], Any]) -> Any:
    """A file that is one document: its values are damaged, or its bytes."""

    def make(folder: Path, rng: Random) -> Path:
        path = _copied(_one(name, rng), folder)
        _damage(path, rng, write, load)
        return path

    return make


def _damage(
    path: Path, rng: Random, write: Callable[[Any], bytes], load: Callable[[str], Any]
) -> None:
    data = path.read_bytes()
    whole = rng.random() < 0.75
    path.write_bytes(
        write(mutate.tree(load(data.decode()), rng)) if whole else mutate.raw(data, rng)
    )


def _damage_lines(path: Path, rng: Random) -> None:
    """One line of a file of JSON lines."""
    if rng.random() < 0.25:
        path.write_bytes(mutate.raw(path.read_bytes(), rng))
        return
    lines = path.read_text().splitlines()
    at = rng.randrange(len(lines))
    lines[at] = json.dumps(mutate.tree(json.loads(lines[at]), rng))
    path.write_text("\n".join(lines) + "\n")


# --- files of several kinds -----------------------------------------------------------------------


def _record(folder: Path, rng: Random) -> Path:
    path = _copied(_one("record", rng), folder)
    whole, lines = path / "record.json", path / "boundaries.jsonl"
    if whole.exists() and rng.random() < 0.9:
        _damage(whole, rng, mutate.json_text, json.loads)
    elif lines.exists():
        whole.unlink(missing_ok=True)
        _damage_lines(lines, rng)
    if rng.random() < 0.1 and (images := sorted((path / "images").glob("*"))):
        images[0].write_bytes(mutate.raw(images[0].read_bytes(), rng))
    return path


def _results(folder: Path, rng: Random) -> Path:
    path = _copied(_one("results", rng), folder)
    which = rng.choice(("experiment.json", "episodes.jsonl", "episodes.jsonl", "effort.jsonl"))
    if which.endswith(".json"):
        _damage(path / which, rng, mutate.json_text, json.loads)
    else:
        _damage_lines(path / which, rng)
    return path


_TABLES = {
    "demonstrations": ("id", "task", "scene", "seed", "version", "perception", "things", "digest"),
    "steps": ("position", "number", "subtask", "graph", "whole", "image"),
}

_STATEMENTS = (
    "DROP TABLE steps",
    "DELETE FROM steps",
    "PRAGMA user_version = 7",
    "PRAGMA application_id = 7",
    "ALTER TABLE steps RENAME TO steps_",
    "CREATE VIEW v AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i FROM n) SELECT i FROM n",
    "CREATE TRIGGER t AFTER INSERT ON steps BEGIN DELETE FROM demonstrations; END",
)  # fmt: skip


def _memory(folder: Path, rng: Random) -> Path:
    path = _copied(_one("memory", rng), folder)
    how = rng.random()
    if how < 0.3:
        path.write_bytes(mutate.raw(path.read_bytes(), rng))
        return path
    with closing(sqlite3.connect(path, isolation_level=None)) as file:
        if how < 0.4:
            file.execute(rng.choice(_STATEMENTS))
        elif how < 0.55:
            file.execute("PRAGMA writable_schema = ON")
            file.execute("UPDATE sqlite_master SET sql = replace(sql, ' STRICT', '')")
        if how < 0.7:
            _damage_column(path, rng)
        else:
            _damage_content(file, rng)
    return path


def _damage_column(path: Path, rng: Random) -> None:
    with closing(sqlite3.connect(path, isolation_level=None)) as file:
        table = rng.choice(list(_TABLES))
        column = rng.choice(_TABLES[table])
        value = mutate.value(rng)
        if isinstance(value, str):
            value = value.encode("utf-8", "replace").decode()
        if not isinstance(value, str | float | type(None)) and not (
            isinstance(value, int) and abs(value) < 2**63
        ):
            value = repr(value).encode()[:1000]
        try:
            file.execute(f"UPDATE OR REPLACE {table} SET {column} = ?", (value,))
        except sqlite3.Error:
            return


def _damage_content(file: sqlite3.Connection, rng: Random) -> None:
    """What is packed in a row, with a digest that fits: nothing but the content is wrong."""
    from forestall.memory.codec import Encoded, EncodedStep

    head = file.execute(
        "SELECT id, task, scene, seed, version, perception, things FROM demonstrations"
    ).fetchone()
    steps = file.execute(
        "SELECT number, subtask, graph, whole, image FROM steps WHERE demonstration = ?", head[:1]
    ).fetchall()
    fields: Any = list(head[1:])
    which = rng.choice(("things", "things", "graph", "whole", "subtask", "perception"))
    if which == "things":
        fields[5] = _packed(fields[5], rng)
    elif which == "perception":
        fields[4] = json.dumps(mutate.tree(json.loads(fields[4]), rng))
    else:
        at = {"subtask": 1, "graph": 2, "whole": 3}[which]
        step = list(steps[0])
        step[at] = rng.choice(mutate.TEXTS[6:]) if at == 1 else _packed(step[at], rng)
        step[1] = step[1].encode("utf-8", "replace").decode()
        steps[0] = tuple(step)
    packed = tuple(EncodedStep(*s) for s in steps)
    task, place, seed, version, perception, things = fields
    encoded = Encoded(task, place, seed, version, perception, things, packed)
    file.execute(
        "UPDATE demonstrations SET perception = ?, things = ?, digest = ? WHERE id = ?",
        (fields[4], fields[5], encoded.digest, head[0]),
    )
    file.execute(
        "UPDATE steps SET subtask = ?, graph = ?, whole = ? "
        "WHERE demonstration = ? AND position = 0",
        (*steps[0][1:4], head[0]),
    )  # fmt: skip


def _packed(blob: bytes, rng: Random) -> bytes:
    how = rng.random()
    if how < 0.05:
        return zlib.compress(b"[" + b"0," * 10**6 + b"0]") if how < 0.03 else b"\x00"
    return zlib.compress(json.dumps(mutate.tree(json.loads(zlib.decompress(blob)), rng)).encode())


_HEADS = (
    "{'descr': '<f4', 'fortran_order': False, 'shape': (1000000, 1000000)}",
    "{'descr': '|O', 'fortran_order': False, 'shape': (90, 120)}",
    "{'descr': '<f4', 'fortran_order': False, 'shape': (-90, 120)}",
    "{'descr': '<f4', 'fortran_order': False, 'shape': (10800,)}",
    "{'descr': '>f8', 'fortran_order': True, 'shape': (90, 120)}",
    "{'descr': '<c8', 'fortran_order': False, 'shape': (90, 120)}",
    "{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (90, 120)}",
    "{'descr': '<M8[s]', 'fortran_order': False, 'shape': (90, 120)}",
    "(" * 100,
)


def _npy(rng: Random) -> bytes:
    head = rng.choice(_HEADS).encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + bytes(90 * 120 * 4)


def _array(rng: Random) -> np.ndarray[Any, Any]:
    kind = rng.choice(("f4", "f8", "i8", "u2", "?", "c8", "U3"))
    shape = rng.choice(((90, 120), (120, 90), (90, 120, 3), (10800,), (0, 0), (1, 1), ()))
    fill = rng.choice((0, 1, 2, 1e30, -1, np.nan, np.inf)) if kind[0] in "fc" else 1
    return np.full(shape, fill, dtype=kind)


def _observation(folder: Path, rng: Random) -> Path:
    path = _copied(_one("observation", rng), folder)
    if rng.random() < 0.55:
        _damage(path / "observation.json", rng, mutate.json_text, json.loads)
        return path
    file = rng.choice([f for f in sorted(path.iterdir()) if f.suffix != ".json"])
    how = rng.random()
    if how < 0.4:
        file.write_bytes(mutate.raw(file.read_bytes(), rng))
    elif how < 0.5:
        file.unlink()
    elif file.suffix == ".npy":
        buffer = io.BytesIO()
        np.save(buffer, _array(rng))
        file.write_bytes(_npy(rng) if rng.random() < 0.5 else buffer.getvalue())
    elif file.suffix == ".npz":
        with zipfile.ZipFile(file, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_BZIP2))) as out:
            for name in ("m0.npy", "m1.npy", "m2", "../m2.npy"):
                buffer = io.BytesIO()
                np.save(buffer, _array(rng))
                out.writestr(name, rng.choice((buffer.getvalue(), _npy(rng), b"")))
    else:
        mode = rng.choice(("L", "RGB", "RGBA", "1", "P", "I;16", "F", "LA", "CMYK"))
        size = rng.choice(((120, 90), (90, 120), (1, 1), (4000, 3000)))
        kind = {"F": "TIFF", "CMYK": "JPEG"}.get(mode, rng.choice(("PNG", "GIF")))
        image = Image.new(mode, size, rng.choice((0, 1)))
        (image if kind != "GIF" or mode == "L" else image.convert("L")).save(file, kind)
    return path


def _pddl(folder: Path, rng: Random) -> Path:
    for file in (CORPUS / "pddl").iterdir():
        shutil.copy(file, folder)
    names = sorted(p for p in folder.glob("*.pddl") if ".problem" not in p.name)
    path = rng.choice(names)
    problem = path.with_suffix(".problem.pddl")
    target = problem if rng.random() < 0.3 and problem.exists() else path
    words = target.read_text().replace("(", " ( ").replace(")", " ) ").split()
    for _ in range(rng.choice((1, 1, 2, 4))):
        at = rng.randrange(len(words))
        action = rng.randrange(4)
        if action == 0:
            del words[at]
        elif action == 1:
            words[at] = rng.choice((*words, *mutate.TEXTS))
        elif action == 2:
            words.insert(at, rng.choice((*words, "(" * 3000, "not", "forall", ":requirements")))
        else:
            words = words[:at] + words[at : at + 20] * 2 + words[at + 20 :]
    text = " ".join(words).encode("utf-8", "surrogatepass")
    target.write_bytes(mutate.raw(text, rng) if rng.random() < 0.1 else text)
    return path


# --- what is done with them -----------------------------------------------------------------------


def _read_graph(path: Path) -> None:
    from forestall.assembly.stored import read_graph, read_scene
    from forestall.comparison.score import ScoreConfig, compare
    from forestall.embeddings.hashed import HashedTextEncoder
    from forestall.errors import FileFormatError

    known = read_graph(CORPUS / "graph" / "plain.json")
    found = read_graph(path)
    found.to_networkx()
    json.dumps(found.to_json())
    encoder = HashedTextEncoder()
    compare(found, known, ScoreConfig(), encoder, scene.domain())
    compare(known, found, ScoreConfig(), encoder, scene.domain())
    with suppress(FileFormatError):  # what the domain does not know can be compared all the same
        read_scene(path, scene.domain())


def _read_demonstration(path: Path) -> str | None:
    from forestall import Monitor

    return live.judged_by(Monitor.from_demonstrations(str(path)))


def _read_memory(path: Path) -> None:
    from forestall.memory.store import open_store

    with open_store(path) as store:
        for demonstration in store.all():
            for step in demonstration.steps:
                json.dumps([step.graph.to_json(), step.whole.to_json(), str(step.subtask)])
        store.digest()


def _read_record(path: Path) -> None:
    from forestall.records.codec import record_to_json
    from forestall.records.record import read_record
    from forestall.report.page import write_page

    record = read_record(path)
    json.dumps(record_to_json(record), allow_nan=False)
    write_page(record, path / "index.html", path)


def _read_results(path: Path) -> None:
    from forestall.experiments.results import summary_of
    from forestall.statistics import intervals
    from forestall.statistics.findings import findings
    from forestall.statistics.tables import tables

    caches = (intervals._draws, intervals._weights)
    with mock.patch.object(intervals, "RESAMPLES", 20):
        for cache in caches:
            cache.cache_clear()
        try:
            data = summary_of(path)[0]
            tables(data)
            findings(data)
        finally:  # other tests of the same process draw as often as is said
            for cache in caches:
                cache.cache_clear()


def _read_observation(path: Path) -> None:
    from forestall.perception.folder import read_observation

    observation, _ = read_observation(path, scene.domain())
    seer = scene.perceiver()
    seer.scope(seer.perceive(observation), scene.GRASP)


def _read_task(path: Path) -> None:
    from forestall.tasks.files import load_task
    from forestall.worlds.kitchen.catalogue import catalogue

    loaded = load_task(str(path))
    catalogue(loaded.domain)
    repr(loaded)


def _read_scenario(path: Path) -> None:
    from forestall.assembly.configuration import run_config
    from forestall.assembly.make import prepare
    from forestall.tasks.faults import apply_scene_faults

    prepared = prepare(run_config("heat-potato", str(path)))
    apply_scene_faults(prepared.loaded.task.scene, prepared.faults, prepared.loaded.domain)


def _read_domain(path: Path) -> None:
    from forestall.domain.load import load_domain
    from forestall.domain.pddl_out import domain_pddl
    from forestall.domain.sheet import skill_sheet
    from forestall.domain.toml_out import domain_toml
    from forestall.planning.pddl_problem import read_problem

    domain = load_domain(str(path))
    domain_toml(domain)
    skill_sheet(domain)
    domain_pddl(domain, without_processes=True, without_makers=True)
    problem = path.with_suffix(".problem.pddl")
    if problem.exists():
        read_problem(problem.read_text(encoding="utf-8", errors="replace"), domain)


def _read_config(path: Path) -> None:
    from forestall.assembly.configuration import read_file, run_config

    given, run = read_file(path)
    json.dumps(run_config("heat-potato", given=given, **run).to_json())


_TOML: tuple[Any, Any] = (mutate.toml_text, tomllib.loads)

READERS: dict[str, Reader] = {
    "graph": Reader(_document("graph", mutate.json_text, json.loads), _read_graph),
    "demonstration": Reader(
        _document("demonstration", mutate.json_text, json.loads), _read_demonstration
    ),
    "memory": Reader(_memory, _read_memory),
    "observation": Reader(_observation, _read_observation),
    "record": Reader(_record, _read_record),
    "results": Reader(_results, _read_results),
    "task": Reader(_document("task", *_TOML), _read_task),
    "scenario": Reader(_document("scenario", *_TOML), _read_scenario),
    "domain": Reader(_document("domain", *_TOML), _read_domain),
    "config": Reader(_document("config", *_TOML), _read_config),
    "pddl": Reader(_pddl, _read_domain),
    "seen": Reader(lambda _, rng: live.observation(rng), live.judge),
    "scene": Reader(lambda _, rng: live.dictionary(rng), live.check),
    **{name: Reader(*pair) for name, pair in logs.readers().items()},
}
"""By name; "seen" and "scene" are observations and scenes in memory, handed to a monitor."""
