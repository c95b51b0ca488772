"""Logs of robots: damaged as files, and message by message or cell by cell with sums that fit.

A log of two looks is written once for a process by the writers themselves; where an extra is not
installed, its reader is left out.
"""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from random import Random

from forestall.assembly.registry import data_set, log
from forestall.errors import FileFormatError
from forestall.extras import present
from forestall.logs.writing import Executed, Head
from forestall.types.episode import SkillStatus
from forestall.types.recorded import Unread

from . import mutate, scene

HEAD = Head("one", "fetch-plate", "table-1", "The plate is held.", "household")
WITHOUT_LOOKS = '[mcap]\nlooks = ""\n'
"""A layout by which our own log is read as a stranger's: by stamps, transforms and camera_info."""

FOLDER, MCAP, ROBOT, LEROBOT = "log-folder", "mcap", "mcap-robot", "lerobot"
KINDS: Mapping[str, str] = {FOLDER: "folder", MCAP: "mcap", ROBOT: "mcap", LEROBOT: "lerobot"}


@cache
def written(kind: str) -> dict[str, bytes]:
    """The files of a log that is read: path below its place, "" for the place itself → bytes."""
    grasp = Executed(scene.GRASP, SkillStatus.SUCCEEDED)
    seen = scene.with_masks(scene.observation())
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "log"
        writer = log(kind)(place)
        writer.begin(HEAD)
        writer.look(seen)
        writer.executed(grasp)
        writer.look(replace(seen, time_s=4.0))
        writer.finish(True, "")
        if place.is_file():
            return {"": place.read_bytes()}
        files = sorted(p for p in place.rglob("*") if p.is_file())
        return {p.relative_to(place).as_posix(): p.read_bytes() for p in files}


def put(files: Mapping[str, bytes], place: Path) -> Path:
    """Write the files of a log."""
    for name, data in files.items():
        path = place / name if name else place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return place


def read(name: str, place: Path) -> None:
    """Every look of every run, as `import` reads them; why a run cannot be used is raised."""
    how: dict[str, Path] = {}
    if name == ROBOT:
        how["layout"] = place.with_suffix(".toml")
        how["layout"].write_text(WITHOUT_LOOKS)
    for run in data_set(KINDS[name])(place, **how).runs(scene.domain()):
        if isinstance(run, Unread):
            raise FileFormatError(run.why)
        for look in run.looks():
            repr(look)


def make(name: str, folder: Path, rng: Random) -> Path:
    """One damaged log."""
    files = dict(written(KINDS[name]))
    which = rng.choice(sorted(files))
    how = rng.random()
    other = rng.choice(sorted(files))
    if which.endswith(".json") and how < 0.6:
        files[which] = mutate.json_text(mutate.tree(json.loads(files[which]), rng))
    elif which == "" and how < 0.6:
        files[which] = messages(files[which], rng)
    elif which.endswith(".parquet") and how < 0.6:
        files[which] = cells(files[which], rng)
    elif how < 0.65 and which:
        del files[which]
    elif how < 0.75 and which:
        files[which] = files[other]
    else:
        files[which] = mutate.raw(files[which], rng)
    return put(files, folder / "log")


def messages(data: bytes, rng: Random) -> bytes:
    """An MCAP file written anew with something of it changed: no sum gives it away."""
    from mcap.reader import NonSeekingReader
    from mcap.writer import CompressionType, Writer

    whole = NonSeekingReader(io.BytesIO(data))
    rows = [list(row) for row in whole.iter_messages(log_time_order=False)]
    about = {m.name: dict(m.metadata) for m in NonSeekingReader(io.BytesIO(data)).iter_metadata()}
    told = [(s, c.topic, c.message_encoding, m.log_time, m.data) for s, c, m in rows]
    at = rng.randrange(len(told))
    schema, topic, encoding, time_ns, body = told[at]
    action = rng.randrange(8)
    if action < 4:
        body = mutate.raw(body, rng)
    elif action == 4:
        body = rng.choice(told)[4]
    elif action == 5:
        topic = rng.choice([t for _, t, _, _, _ in told])
    elif action == 6:
        time_ns = rng.choice((0, 1, 2**62, 2**63 - 1))
    else:
        name = sorted(about)[0]
        about[name][rng.choice(sorted(about[name]))] = rng.choice(mutate.TEXTS[:10])
    told[at] = (schema, topic, encoding, time_ns, body)
    spoilt = rng.choice([s.name for s, *_ in told]) if rng.random() < 0.15 else None
    out = io.BytesIO()
    packed = rng.choice((CompressionType.NONE, CompressionType.ZSTD))
    writer = Writer(out, compression=packed, use_chunking=rng.random() < 0.7)
    writer.start()
    schemas: dict[str, int] = {}
    channels: dict[tuple[str, str], int] = {}
    for schema, topic, encoding, time_ns, body in told:
        if schema.name not in schemas:
            text = mutate.raw(schema.data, rng) if schema.name == spoilt else schema.data
            schemas[schema.name] = writer.register_schema(schema.name, schema.encoding, text)
        key = (topic, schema.name)
        if key not in channels:
            channels[key] = writer.register_channel(topic, encoding, schemas[schema.name])
        writer.add_message(channels[key], time_ns, body, time_ns)
    for name, said in about.items():
        text = {k: v.encode("utf-8", "replace").decode() for k, v in said.items()}
        writer.add_metadata(name, text)
    writer.finish()
    return out.getvalue()


def cells(data: bytes, rng: Random) -> bytes:
    """A parquet file written anew with something of its rows changed; as it was where nothing fits.

    What does not fit a column changes the type of the column.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(io.BytesIO(data))
    rows = table.to_pydict()
    name = rng.choice(table.column_names)
    action = rng.randrange(6)
    if action == 0:
        table = table.drop_columns([name])
    elif action == 1:
        table = table.slice(0, rng.randrange(table.num_rows + 1))
    elif action == 2:
        table = pa.concat_tables([table] * rng.choice((2, 3)))
    else:
        index = table.column_names.index(name)
        values = list(rows[name])
        at = rng.randrange(len(values))
        if isinstance(values[at], bytes):
            values[at] = mutate.raw(values[at], rng)
        elif isinstance(values[at], dict) and isinstance(values[at].get("bytes"), bytes):
            values[at] = {**values[at], "bytes": mutate.raw(values[at]["bytes"], rng)}
        else:
            damaged = mutate.tree({"": values[at]}, rng)
            values[at] = damaged.get("") if isinstance(damaged, dict) else damaged
        made = [table.schema.field(name).type, None] if action < 5 else [None]
        for kind in made:
            with suppress(pa.ArrowException, OverflowError, UnicodeError, TypeError, ValueError):
                column = pa.array(values if kind or action < 5 else values[:1] * len(values), kind)
                table = table.set_column(index, name, column)
                break
    out = io.BytesIO()
    pq.write_table(table, out)
    return out.getvalue()


def readers() -> dict[str, tuple[Callable[[Path, Random], Path], Callable[[Path], None]]]:
    """Name → how its input is made and what is done with it; of what is installed."""
    needs = {MCAP: ("mcap", "mcap_ros2"), ROBOT: ("mcap", "mcap_ros2"), LEROBOT: ("pyarrow",)}

    def pair(name: str) -> tuple[Callable[[Path, Random], Path], Callable[[Path], None]]:
        return (lambda folder, rng: make(name, folder, rng)), (lambda place: read(name, place))

    return {name: pair(name) for name in KINDS if all(map(present, needs.get(name, ())))}
