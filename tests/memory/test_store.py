from __future__ import annotations

import json
import os
import signal
import sqlite3
import subprocess
import sys
import zlib
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from threading import Barrier

import numpy as np
import pytest
from demonstration_samples import demonstration, with_id

from forestall.errors import InputError, MemoryFileError
from forestall.memory.codec import DamageError, decode, encode
from forestall.memory.store import SCHEMA_VERSION, SqliteStore, open_store
from forestall.types.demonstration import Demonstration, View
from forestall.types.facts import GRIPPER
from forestall.types.feature import quantised
from forestall.types.graph import SceneGraph

PLAN = ("navigate_to_obj(Mug-1)", "pick_up(Mug-1)", "put_in(Mug-1, Sink-1)")
ONE = demonstration("make-coffee", 3, PLAN)
TWO = demonstration("warm-water", 4, PLAN[:2])


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "demos.db"


def filled(path: Path) -> Path:
    with open_store(path, create=True) as store:
        store.add(ONE)
        store.add(TWO)
    return path


def test_what_is_stored_comes_back(path: Path) -> None:
    with open_store(path, create=True) as store:
        names = [store.add(d) for d in (TWO, ONE)]
        assert len(store) == 2
    with open_store(path) as store:
        found = store.all()
    assert [d.id for d in found] == sorted(names)
    assert [replace(d, id="") for d in found] == [ONE, TWO]
    assert found[0].steps[2].graph.text() == ONE.steps[2].graph.text()
    assert hash(found[0].steps[0].whole) == hash(ONE.steps[0].whole)


def with_features(sample: Demonstration) -> Demonstration:
    """Every object of every graph with an image feature of its own."""

    def seen(graph: SceneGraph) -> SceneGraph:
        nodes = (
            n if n.id == GRIPPER else replace(n, feature=quantised([len(n.id), i + 1, -2]))
            for i, n in enumerate(graph.nodes)
        )
        return replace(graph, nodes=tuple(nodes))

    steps = (replace(s, graph=seen(s.graph), whole=seen(s.whole)) for s in sample.steps)
    return replace(sample, steps=tuple(steps))


def test_image_features_come_back(path: Path) -> None:
    pictured = with_features(ONE)
    with open_store(path, create=True) as store:
        names = [store.add(ONE), store.add(pictured)]
        assert names[0] != names[1]
    with open_store(path) as store:
        found = {d.id: replace(d, id="") for d in store.all()}
    assert [found[n] for n in names] == [ONE, pictured]
    node = found[names[1]].steps[0].graph.get("Mug-1")
    assert node is not None and node.feature is not None


def test_of_what_is_not_there_nothing_is_written() -> None:
    """So that what was stored before there were any is read and hashed as before."""
    things = json.loads(zlib.decompress(encode(ONE).things))
    assert things["format"] == 1
    assert things.keys() == {"format", "nodes", "relations"}
    keys = {key for node in things["nodes"] for key in node}
    assert keys == {
        *("box_m", "category", "centroid_m", "id", "last_seen_s", "pixels", "seen", "states")
    }


def with_views(sample: Demonstration) -> Demonstration:
    """The second step with a picture and a caption, the third with a caption, and a last look."""
    first, second, third = sample.steps
    picture = View(quantised([1, -3, 2]), "A clean mug.", "two-tower", "listing (stand-in)")
    steps = (first, replace(second, view=picture), replace(third, view=View(caption="Ein Becher")))
    seen = replace(third.whole, relations=(), subtask=None)
    return replace(sample, steps=steps, final=seen)


def test_views_and_the_last_look_come_back(path: Path) -> None:
    viewed = with_views(ONE)
    with open_store(path, create=True) as store:
        names = [store.add(viewed), store.add(replace(viewed, final=None)), store.add(TWO)]
        assert len(set(names)) == 3
    with open_store(path) as store:
        found = {d.id: replace(d, id="") for d in store.all()}
    assert found[names[0]] == viewed
    assert found[names[1]] == replace(viewed, final=None)
    assert found[names[0]].after(1) == viewed.steps[2].whole
    assert found[names[0]].after(2) == viewed.final
    assert found[names[1]].after(2) is None


@pytest.mark.parametrize(
    "views",
    [
        [None],
        [None, None, {"image": None, "caption": 3, "encoder": "", "captioner": ""}],
        [None, None, {"image": "no base64!", "caption": "", "encoder": "e", "captioner": ""}],
        [None, None, {"image": "AAAA", "caption": "", "encoder": "e", "captioner": ""}],
        [None, None, {"image": None}],
        [None, None, "a view"],
    ],
)
def test_damaged_views(views: object) -> None:
    things_damaged("views", views)


@pytest.mark.parametrize("final", [{}, "a graph", {"nodes": [3, 1], "relations": [], "hidden": []}])
def test_a_damaged_last_look(final: object) -> None:
    things_damaged("final", final)


def things_damaged(key: str, content: object) -> None:
    encoded = encode(with_views(ONE))
    things = json.loads(zlib.decompress(encoded.things))
    things[key] = content
    bad = replace(encoded, things=zlib.compress(json.dumps(things).encode()))
    with pytest.raises(DamageError):
        decode(bad, "x", bad.digest)


@pytest.mark.parametrize("feature", ["no base64!", "", "AAAA", 5])
def test_a_damaged_feature(feature: object) -> None:
    encoded = encode(ONE)
    things = json.loads(zlib.decompress(encoded.things))
    things["nodes"][0]["feature"] = feature
    bad = replace(encoded, things=zlib.compress(json.dumps(things).encode()))
    with pytest.raises(DamageError, match="demonstration x is damaged"):
        decode(bad, "x", bad.digest)


def test_one_file_is_left_when_it_is_closed(path: Path) -> None:
    filled(path)
    assert [p.name for p in path.parent.glob("demos*")] == ["demos.db"]
    moved = path.with_name("moved.db")
    os.replace(path, moved)
    with open_store(moved) as store:
        assert len(store.required()) == 2


def test_the_same_run_is_kept_once(path: Path) -> None:
    with open_store(path, create=True) as store:
        assert store.add(ONE) == store.add(ONE)
        assert len(store) == 1


def test_an_id_belongs_to_one_demonstration(path: Path) -> None:
    with open_store(path, create=True) as store:
        assert store.add(with_id(ONE, "first")) == "first"
        with pytest.raises(MemoryFileError, match="another demonstration named first"):
            store.add(with_id(TWO, "first"))
        assert [d.task for d in store.all()] == ["make-coffee"]


def test_digest_tells_contents_apart_and_not_their_order(tmp_path: Path) -> None:
    digests = []
    for i, order in enumerate(((ONE, TWO), (TWO, ONE), (ONE,))):
        with open_store(tmp_path / f"{i}.db", create=True) as store:
            for d in order:
                store.add(d)
            digests.append(store.digest())
    assert digests[0] == digests[1] != digests[2]


def test_no_folder_no_file_empty_file(tmp_path: Path) -> None:
    with pytest.raises(MemoryFileError, match="there is no folder"):
        open_store(tmp_path / "no" / "demos.db", create=True)
    with pytest.raises(MemoryFileError, match="does not exist"):
        open_store(tmp_path / "demos.db")
    (tmp_path / "empty.db").touch()
    with pytest.raises(MemoryFileError, match="is an empty file"):
        open_store(tmp_path / "empty.db")
    with pytest.raises(MemoryFileError, match="it is a folder"):
        open_store(tmp_path)
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == ["empty.db"]


def test_no_demonstrations_where_they_are_needed(path: Path) -> None:
    with open_store(path, create=True) as store:
        assert store.all() == []
        with pytest.raises(MemoryFileError, match="holds no demonstrations: add some"):
            store.required()


@pytest.mark.parametrize("content", [b"SQL", b"not a database at all, but long enough" * 9])
def test_not_a_sqlite_file(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    for create in (False, True):
        with pytest.raises(MemoryFileError, match="not a memory: it is not a SQLite file"):
            open_store(path, create)
    assert path.read_bytes() == content


def test_somebody_elses_database(path: Path) -> None:
    with sqlite3.connect(path) as other:
        other.execute("CREATE TABLE recipes (name TEXT)")
    other.close()
    for create in (False, True):
        with pytest.raises(MemoryFileError, match="not a memory of forestall"):
            open_store(path, create)


def test_another_schema_version(path: Path) -> None:
    filled(path)
    with sqlite3.connect(path) as other:
        other.execute(f"PRAGMA user_version = {SCHEMA_VERSION + 1}")
    other.close()
    with pytest.raises(MemoryFileError, match=r"has schema version 2, this version .* reads 1"):
        open_store(path)


@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.95])
def test_cut_off_file(path: Path, share: float) -> None:
    filled(path)
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])
    with pytest.raises(MemoryFileError, match="damaged"), open_store(path) as store:
        store.all()


def test_overwritten_pages(path: Path) -> None:
    filled(path)
    content = bytearray(path.read_bytes())
    content[4096:12288] = bytes(8192)
    path.write_bytes(bytes(content))
    with pytest.raises(MemoryFileError, match="damaged"), open_store(path) as store:
        store.all()


def test_a_changed_cell_does_not_fit_its_hash(path: Path) -> None:
    filled(path)
    with sqlite3.connect(path) as other:
        other.execute("UPDATE steps SET subtask = 'pick_up(Pan-1)' WHERE position = 1")
    other.close()
    with open_store(path) as store, pytest.raises(MemoryFileError, match="does not fit its hash"):
        store.all()


@pytest.mark.parametrize("column", ["things", "perception"])
def test_content_that_cannot_be_read(column: str) -> None:
    encoded = encode(ONE)
    bad = replace(encoded, **{column: b"\x00" if column == "things" else "{"})  # type: ignore[arg-type]
    with pytest.raises(DamageError, match="is damaged"):
        decode(bad, "x", bad.digest)


def test_locked_by_another_writer(path: Path) -> None:
    filled(path)
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    try:
        with open_store(path, busy_timeout_s=0.05) as store:
            assert len(store.all()) == 2, "reading goes on while another writes"
            with pytest.raises(MemoryFileError, match=r"being written by another process \(waited"):
                store.add(replace(ONE, seed=9))
    finally:
        other.execute("ROLLBACK")
        other.close()
    with open_store(path) as store:
        store.add(replace(ONE, seed=9))
        assert len(store) == 3


def test_read_only(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    filled(path)
    monkeypatch.setattr("forestall.memory.store.os.access", lambda *_: False)
    with open_store(path) as store:
        assert len(store.all()) == 2
        with pytest.raises(MemoryFileError, match="is read-only"):
            store.add(replace(ONE, seed=9))
        with pytest.raises(MemoryFileError, match="is read-only"):
            store.put_image(np.zeros((2, 2, 3), np.uint8))
    with pytest.raises(MemoryFileError, match="is read-only"):
        open_store(path.with_name("new.db"), create=True)


def test_a_failed_insert_leaves_nothing(path: Path) -> None:
    class Broken(SqliteStore):
        def _insert(self, *arguments: object) -> None:
            super()._insert(*arguments)  # type: ignore[arg-type]
            raise sqlite3.OperationalError("database or disk is full")

    filled(path)
    broken = Broken(path, 1.0, True)
    with broken, pytest.raises(MemoryFileError, match="no space left"):
        broken.add(replace(ONE, seed=9))
    with open_store(path) as store:
        assert len(store.all()) == 2


WRITER = """
import sys
sys.path.insert(0, {tests!r})
from dataclasses import replace
from demonstration_samples import demonstration
from forestall.memory.store import open_store
plan = ["pick_up(Mug-1)", "put_in(Mug-1, Sink-1)"] * 20
with open_store({path!r}, create=True) as store:
    for seed in range(10000):
        store.add(demonstration("t", seed, plan))
        print(seed, flush=True)
"""


def test_a_writer_killed_in_the_middle_loses_nothing_finished(path: Path) -> None:
    code = WRITER.format(tests=str(Path(__file__).parent), path=str(path))
    writer = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert writer.stdout is not None
    finished = -1
    while finished < 7:
        finished = int(writer.stdout.readline())
    writer.send_signal(signal.SIGKILL)
    finished = max([finished, *(int(x) for x in writer.stdout.read().splitlines())])
    writer.wait()
    writer.stdout.close()
    with open_store(path) as store:
        seeds = sorted(d.seed for d in store.all())
        assert seeds == list(range(len(seeds)))
        assert len(seeds) > finished
        assert all(len(d.steps) == 40 for d in store.all())
        store.add(ONE)
        assert len(store) == len(seeds) + 1


def picture(seed: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    return np.random.default_rng(seed).integers(0, 255, (5, 7, 3), np.uint8)


def test_pictures_come_back_and_are_kept_once(path: Path) -> None:
    with open_store(path, create=True) as store:
        names = [store.put_image(picture(i)) for i in (0, 1, 0)]
        assert names[0] == names[2] != names[1]
        np.testing.assert_array_equal(store.get_image(names[1]), picture(1))
        files = [p for p in store.images.folder.rglob("*") if p.is_file()]
        assert sorted(p.stem for p in files) == sorted(set(names))
        stored = demonstration("t", 1, PLAN, image=names[0])
        store.add(stored)
        assert store.all()[0].steps[0].image == names[0]


def test_missing_damaged_and_misnamed_pictures(path: Path) -> None:
    with open_store(path, create=True) as store:
        with pytest.raises(MemoryFileError, match="is not in"):
            store.get_image("0" * 32)
        with pytest.raises(MemoryFileError, match="not the name of a stored picture"):
            store.get_image("../../etc/passwd")
        with pytest.raises(InputError, match="uint8"):
            store.put_image(np.zeros((2, 2, 3), np.float32))
        one, two = (store.put_image(picture(i)) for i in range(2))
        files = {p.stem: p for p in store.images.folder.rglob("*.png")}
        files[one].write_bytes(files[two].read_bytes())
        with pytest.raises(MemoryFileError, match="content is not what it says"):
            store.get_image(one)
        files[two].write_bytes(files[two].read_bytes()[:40])
        with pytest.raises(MemoryFileError, match="is damaged"):
            store.get_image(two)


def test_pictures_where_no_folder_can_be(path: Path) -> None:
    with open_store(path, create=True) as store:
        store.images.folder.write_text("a file in the way")
        with pytest.raises(MemoryFileError, match="cannot keep a picture"):
            store.put_image(picture(0))


def test_a_new_memory_is_opened_by_many_at_once(tmp_path: Path) -> None:
    for round_ in range(8):
        path, ready = tmp_path / f"{round_}.db", Barrier(8)

        def write(seed: int, path: Path = path, ready: Barrier = ready) -> None:
            ready.wait()
            with open_store(path, create=True) as store:
                store.add(demonstration("t", seed, PLAN))

        with ThreadPoolExecutor(8) as threads:
            list(threads.map(write, range(8)))
        with open_store(path) as store:
            assert [d.seed for d in store.all()] and len(store) == 8


def test_one_that_was_killed_before_its_tables_were_made_is_made(path: Path) -> None:
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA journal_mode = WAL")
    with open_store(path) as store:
        assert len(store) == 0


def test_what_something_was_recorded_for_is_kept_with_it_or_not_at_all(path: Path) -> None:
    filled(path)
    with open_store(path) as store:
        assert store.recorded() == frozenset()
        store.add(replace(ONE, seed=9), "a job")
        store.add(replace(ONE, seed=9), "the same, asked otherwise")
        assert len(store) == 3
    with open_store(path) as store:
        assert store.recorded() == {"a job", "the same, asked otherwise"}

    class Broken(SqliteStore):
        def _insert(self, *arguments: object) -> None:
            raise sqlite3.OperationalError("disk I/O error")

    with Broken(path, 1.0, True) as broken, pytest.raises(MemoryFileError, match="disk full"):
        broken.add(replace(ONE, seed=10), "another job")
    with open_store(path) as store:
        assert len(store.recorded()) == 2


@pytest.mark.parametrize(
    "change",
    [
        "DROP TABLE steps",
        "CREATE TRIGGER t AFTER INSERT ON steps BEGIN DELETE FROM demonstrations; END",
        "CREATE VIEW v AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i FROM n) SELECT 1",
        "ALTER TABLE steps ADD COLUMN more TEXT",
    ],
)
def test_tables_that_are_not_ours_are_not_asked(path: Path, change: str) -> None:
    """A view may never end, a trigger does what nobody asked for."""
    filled(path)
    with sqlite3.connect(path) as other:
        other.execute(change)
    other.close()
    with pytest.raises(MemoryFileError, match="its tables are not those of a memory"):
        open_store(path)


def test_a_column_of_another_type_is_named() -> None:
    encoded = encode(ONE)
    with pytest.raises(DamageError, match="its column things holds a str"):
        decode(replace(encoded, things="{}"), "x", encoded.digest)  # type: ignore[arg-type]


def test_what_unpacks_to_more_than_a_document_may_have_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bomb = replace(encode(ONE), things=zlib.compress(b"[" + b"0," * 10**6 + b"0]"))
    monkeypatch.setattr("forestall.memory.codec.MOST_BYTES", 10**6)
    with pytest.raises(DamageError, match="unpacks to more than 1000000 bytes"):
        decode(bomb, "x", bomb.digest)


@pytest.mark.parametrize(
    ("key", "content", "says"),
    [
        ("nodes", [[1]], r"things.nodes\[0\]: an object"),
        ("nodes", [{"id": "A-1", "category": "A", "states": "x"}], r"nodes\[0\].states"),
        ("nodes", [{"id": "A-1", "category": "A", "pixels": 1.5}], r"nodes\[0\].pixels"),
        ("relations", [["a", "b"]], r"relations\[0\]: subject, predicate"),
        ("relations", 7, "relations: a list"),
        ("format", None, "graphs of format None"),
    ],
)
def test_content_whose_hash_fits_is_looked_at_all_the_same(
    key: str, content: object, says: str
) -> None:
    encoded = encode(ONE)
    things = json.loads(zlib.decompress(encoded.things)) | {key: content}
    bad = replace(encoded, things=zlib.compress(json.dumps(things).encode()))
    with pytest.raises(DamageError, match=says):
        decode(bad, "x", bad.digest)
