"""Demonstrations in one SQLite file.

Called by the command line, recording and retrieval; calls codec and images. The file is in WAL mode
and written in transactions: a process killed at any moment leaves either all of a demonstration or
nothing of it. Pictures lie beside the file, in `<file name>.images/`, and are complete before the
row that names them.
"""

from __future__ import annotations

import gc
import hashlib
import json
import os
import sqlite3
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType

from forestall.errors import MemoryFileError
from forestall.memory.codec import DamageError, Encoded, EncodedStep, decode, encode
from forestall.memory.images import ImageFolder
from forestall.memory.schema import RECORDINGS, SCHEMA, own_schemas, schema_of
from forestall.reading.files import MOST_BYTES
from forestall.types.demonstration import Demonstration
from forestall.types.observation import Rgb

APPLICATION_ID = 0x464F5245
"""Marks the file as a memory of forestall ("FORE")."""

SCHEMA_VERSION = 1

_MAGIC = b"SQLite format 3\x00"


def open_store(path: str | Path, create: bool = False, busy_timeout_s: float = 5.0) -> SqliteStore:
    """Open a memory file.

    Args:
        path: the file.
        create: make it when it is not there.
        busy_timeout_s: how long to wait for another process that is writing.

    Raises:
        MemoryFileError: no such file or folder, no memory, another schema version, damaged, or
            locked by another process.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise MemoryFileError(f"cannot open memory {path}: there is no folder {path.parent}")
    if path.is_dir():
        raise MemoryFileError(f"cannot open memory {path}: it is a folder")
    fresh = not path.exists() or path.stat().st_size == 0
    if fresh and not create:
        what = "is an empty file" if path.exists() else "does not exist"
        raise MemoryFileError(f"memory {path} {what}: make one with 'forestall demos add'")
    if not fresh:
        _check_header(path)
    writable = os.access(path if path.exists() else path.parent, os.W_OK)
    if fresh and not writable:
        raise MemoryFileError(f"cannot make memory {path}: {path.parent} is read-only")
    return SqliteStore(path, busy_timeout_s, writable)


class SqliteStore:
    """A memory file that is open (implements `DemonstrationStore`); made by `open_store`."""

    def __init__(self, path: Path, busy_timeout_s: float, writable: bool) -> None:
        self.path = path
        self.images = ImageFolder(path.with_name(path.name + ".images"))
        self._busy_timeout_s = busy_timeout_s
        self._writable = writable and os.access(path.parent, os.W_OK)
        with self._errors():
            self._connection = self._connect()
        try:
            self._prepare()
        except MemoryFileError:
            self._connection.close()
            raise

    def __enter__(self) -> SqliteStore:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; with the last connection its write-ahead log is folded in."""
        self._connection.close()

    def __len__(self) -> int:
        """How many demonstrations there are."""
        with self._errors():
            row = self._connection.execute("SELECT count(*) FROM demonstrations").fetchone()
        return int(row[0])

    def add(self, demonstration: Demonstration, job: str | None = None) -> str:
        """Store one successful run in one transaction; returns its id.

        A demonstration without an id gets one made of its task and content, so that adding the
        same run twice keeps it once.

        Args:
            demonstration: the run.
            job: what it was recorded for, so that nobody records it again.

        Raises:
            MemoryFileError: read-only, locked by another process, the disk is full, or the id
                belongs to another demonstration.
        """
        encoded = encode(demonstration)
        digest = encoded.digest
        name = demonstration.id or f"{demonstration.task}-{digest[:12]}"
        if not self._writable:
            raise MemoryFileError(f"memory {self.path} is read-only")
        with self._errors(), self._transaction():
            old = self._connection.execute(
                "SELECT digest FROM demonstrations WHERE id = ?", (name,)
            ).fetchone()
            if old is not None and old[0] != digest:
                raise MemoryFileError(f"memory {self.path} has another demonstration named {name}")
            if old is None:
                self._insert(name, digest, encoded)
            if job is not None:
                self._connection.execute(RECORDINGS)
                self._connection.execute(
                    "INSERT OR REPLACE INTO recordings VALUES (?, ?)", (job, name)
                )
        return name

    def holds(self, demonstration: Demonstration) -> bool:
        """Whether one with the same content is there, under whatever id."""
        with self._errors():
            row = self._connection.execute(
                "SELECT 1 FROM demonstrations WHERE digest = ?", (encode(demonstration).digest,)
            ).fetchone()
        return row is not None

    def recorded(self) -> frozenset[str]:
        """The jobs whose demonstrations are there."""
        with self._errors():
            made = "SELECT count(*) FROM sqlite_master WHERE name = 'recordings'"
            if not self._connection.execute(made).fetchone()[0]:
                return frozenset()
            rows = self._connection.execute("SELECT job FROM recordings").fetchall()
        return frozenset(row[0] for row in rows)

    def all(self) -> Sequence[Demonstration]:
        """Every demonstration in id order.

        Raises:
            MemoryFileError: the file is damaged.
        """
        with self._errors():
            self._connection.execute("BEGIN")
            try:
                heads = self._connection.execute(
                    "SELECT id, digest, task, scene, seed, version, perception, things "
                    "FROM demonstrations ORDER BY id"
                ).fetchall()
                steps: dict[str, list[EncodedStep]] = {}
                for row in self._connection.execute(
                    "SELECT demonstration, number, subtask, graph, whole, image "
                    "FROM steps ORDER BY demonstration, position"
                ):
                    steps.setdefault(row[0], []).append(EncodedStep(*row[1:]))
            finally:
                self._connection.execute("COMMIT")
            with _no_collection():
                return [
                    decode(
                        Encoded(
                            task=head["task"],
                            scene=head["scene"],
                            seed=head["seed"],
                            version=head["version"],
                            perception=head["perception"],
                            things=head["things"],
                            steps=tuple(steps.get(head["id"], ())),
                        ),
                        head["id"],
                        head["digest"],
                    )
                    for head in heads
                ]

    def required(self) -> Sequence[Demonstration]:
        """Like `all`, where references are needed.

        Raises:
            MemoryFileError: there are none, or the file is damaged.
        """
        found = self.all()
        if not found:
            raise MemoryFileError(
                f"memory {self.path} holds no demonstrations: add some with 'forestall demos add'"
            )
        return found

    def digest(self) -> str:
        """Hash of the content of all demonstrations, whenever and in whatever order recorded."""
        with self._errors():
            rows = [
                tuple(row)
                for row in self._connection.execute(
                    "SELECT id, digest FROM demonstrations ORDER BY id"
                )
            ]
        return hashlib.blake2b(json.dumps(rows).encode(), digest_size=16).hexdigest()

    def put_image(self, rgb: Rgb) -> str:
        """Keep a (H, W, 3) uint8 picture beside the file; returns its content hash."""
        if not self._writable:
            raise MemoryFileError(f"memory {self.path} is read-only")
        return self.images.put_image(rgb)

    def get_image(self, name: str) -> Rgb:
        """The picture with this hash."""
        return self.images.get_image(name)

    def _connect(self) -> sqlite3.Connection:
        uri = self.path.absolute().as_uri()
        if not self._writable:
            log = self.path.with_name(self.path.name + "-wal")
            settled = not log.exists() or log.stat().st_size == 0
            uri += "?mode=ro&immutable=1" if settled else "?mode=ro"
        connection = sqlite3.connect(
            uri, uri=True, timeout=self._busy_timeout_s, isolation_level=None
        )
        connection.row_factory = sqlite3.Row
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MOST_BYTES)
        connection.execute("PRAGMA trusted_schema = OFF")
        connection.execute("PRAGMA foreign_keys = ON")
        return connection

    def _prepare(self) -> None:
        """Check what the file is; write the schema into a new one."""
        with self._errors():
            if self._writable and self._marks() == (0, 0) and not self._tables():
                self._log_ahead()
                with self._transaction():
                    if not self._tables():
                        self._make()
            application, version = self._marks()
            if application != APPLICATION_ID:
                raise MemoryFileError(
                    f"{self.path} is a SQLite file, but not a memory of forestall"
                )
            if version != SCHEMA_VERSION:
                raise MemoryFileError(
                    f"memory {self.path} has schema version {version}, this version of forestall "
                    f"reads {SCHEMA_VERSION}: make it again from its runs"
                )
            least, most = own_schemas()
            if not least <= self._schema() <= most:
                raise MemoryFileError(
                    f"memory {self.path} is damaged: its tables are not those of a memory"
                )
            problem = self._connection.execute("PRAGMA quick_check(1)").fetchone()[0]
            if problem != "ok":
                raise MemoryFileError(f"memory {self.path} is damaged: {problem}")

    def _log_ahead(self) -> None:
        """Set the journal mode; of many that make one memory SQLite lets all but one fail here."""
        deadline = time.monotonic() + self._busy_timeout_s
        while True:
            try:
                self._connection.execute("PRAGMA journal_mode = WAL")
                return
            except sqlite3.OperationalError as error:
                if "locked" not in str(error) or time.monotonic() > deadline:
                    raise
                time.sleep(0.01)

    def _marks(self) -> tuple[int, int]:
        execute = self._connection.execute
        return (
            int(execute("PRAGMA application_id").fetchone()[0]),
            int(execute("PRAGMA user_version").fetchone()[0]),
        )

    def _tables(self) -> int:
        return int(self._connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0])

    def _schema(self) -> set[tuple[str, ...]]:
        return schema_of(self._connection)

    def _make(self) -> None:
        for statement in SCHEMA.strip().removesuffix(";").split(";\n"):
            self._connection.execute(statement)
        self._connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        self._connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

    def _insert(self, name: str, digest: str, encoded: Encoded) -> None:
        now = datetime.now(UTC).isoformat(timespec="seconds")
        self._connection.execute(
            "INSERT INTO demonstrations VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (
                name,
                encoded.task,
                encoded.scene,
                encoded.seed,
                encoded.version,
                encoded.perception,
                encoded.things,
                digest,
                now,
            ),
        )
        self._connection.executemany(
            "INSERT INTO steps VALUES (?, ?, ?, ?, ?, ?, ?)",
            [
                (name, i, s.index, s.subtask, s.graph, s.whole, s.image)
                for i, s in enumerate(encoded.steps)
            ],
        )

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._connection.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:  # an interrupt, too, leaves nothing half stored
            self._connection.execute("ROLLBACK")
            raise
        self._connection.execute("COMMIT")

    @contextmanager
    def _errors(self) -> Iterator[None]:
        """SQLite's errors as ours, each saying what is wrong with the file."""
        try:
            yield
        except DamageError as error:
            raise MemoryFileError(f"memory {self.path}: {error}") from error
        except UnicodeDecodeError as error:
            raise MemoryFileError(f"memory {self.path} is damaged: {error}") from error
        except sqlite3.Error as error:
            text = str(error)
            if "lock" in text or "busy" in text:
                raise MemoryFileError(
                    f"memory {self.path} is being written by another process "
                    f"(waited {self._busy_timeout_s:g} s): try again later"
                ) from error
            if "readonly" in text or "unable to open" in text:
                raise MemoryFileError(f"memory {self.path} cannot be written: {text}") from error
            if "full" in text:
                raise MemoryFileError(f"no space left for memory {self.path}: {text}") from error
            if "disk I/O" in text:
                raise MemoryFileError(
                    f"memory {self.path} cannot be read or written: {text}: is the disk full?"
                ) from error
            raise MemoryFileError(f"memory {self.path} is damaged: {text}") from error


@contextmanager
def _no_collection() -> Iterator[None]:
    """Hold the garbage collector: many objects, no cycles; it is three times faster."""
    held = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if held:
            gc.enable()


def _check_header(path: Path) -> None:
    try:
        with path.open("rb") as file:
            head = file.read(100)
    except OSError as error:
        raise MemoryFileError(f"cannot read memory {path}: {error.strerror}") from error
    if not head.startswith(_MAGIC[: len(head)]) or len(head) < len(_MAGIC):
        raise MemoryFileError(f"{path} is not a memory: it is not a SQLite file")
    if len(head) < 100:
        raise MemoryFileError(f"memory {path} is damaged: it is cut off after {len(head)} bytes")
