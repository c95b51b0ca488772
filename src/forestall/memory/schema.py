"""The tables of a memory file, and whether a file has these and no others.

Called by the store; calls nothing. A view may never end and a trigger does what nobody asked for,
so a file with other tables than these is not asked anything.
"""

from __future__ import annotations

import sqlite3
from contextlib import closing
from functools import cache

SCHEMA = """
CREATE TABLE demonstrations (
    id TEXT PRIMARY KEY,
    task TEXT NOT NULL,
    scene TEXT NOT NULL,
    seed INTEGER NOT NULL,
    version TEXT NOT NULL,
    perception TEXT NOT NULL,
    things BLOB NOT NULL,
    digest TEXT NOT NULL,
    recorded_at TEXT NOT NULL
) STRICT;
CREATE TABLE steps (
    demonstration TEXT NOT NULL REFERENCES demonstrations(id) ON DELETE CASCADE,
    position INTEGER NOT NULL,
    number INTEGER NOT NULL,
    subtask TEXT NOT NULL,
    graph BLOB NOT NULL,
    whole BLOB NOT NULL,
    image TEXT,
    PRIMARY KEY (demonstration, position)
) STRICT, WITHOUT ROWID;
CREATE INDEX demonstrations_by_task ON demonstrations(task);
"""

RECORDINGS = """
CREATE TABLE IF NOT EXISTS recordings (
    job TEXT PRIMARY KEY,
    demonstration TEXT NOT NULL REFERENCES demonstrations(id) ON DELETE CASCADE
) STRICT
"""
"""What was recorded for what; made with the first, so that a memory without it is read as well."""


def schema_of(connection: sqlite3.Connection) -> set[tuple[str, ...]]:
    """Tables, indexes, views and triggers, each with what made it."""
    rows = connection.execute(
        "SELECT type, name, sql FROM sqlite_master WHERE name NOT LIKE 'sqlite\\_%' ESCAPE '\\'"
    )
    return {tuple(map(str, row)) for row in rows}


@cache
def own_schemas() -> tuple[frozenset[tuple[str, ...]], frozenset[tuple[str, ...]]]:
    """What every memory has, and what one has that keeps what was recorded for what."""
    with closing(sqlite3.connect(":memory:")) as empty:
        empty.executescript(SCHEMA)
        least = frozenset(schema_of(empty))
        empty.execute(RECORDINGS)
        return least, frozenset(schema_of(empty))
