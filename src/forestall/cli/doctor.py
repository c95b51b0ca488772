"""`forestall doctor`: what works on this machine, and what to install for the rest."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from forestall.cli.flags import Json
from forestall.extras import EXTRAS, how, installed

if TYPE_CHECKING:
    from forestall.types.world import Working


def doctor(*, as_json: Json = False) -> int:
    """Try every part and say what works; exit code 1 when something needed does not.

    Args:
        as_json: print JSON.
    """
    rows = [*_needed(), *_optional()]
    ok = all(r["works"] for r in rows if r["needed"])
    if as_json:
        print(json.dumps({"ok": ok, "parts": rows}, indent=2))
        return 0 if ok else 1
    for row in rows:
        mark = "ok     " if row["works"] else ("MISSING" if row["needed"] else "absent ")
        print(f"{mark}  {row['part']}: {row['detail']}")
        if not row["works"] and row["hint"]:
            print(f"         {row['hint']}")
    print("everything needed works" if ok else "something needed does not work (see MISSING)")
    return 0 if ok else 1


def _row(part: str, works: bool, needed: bool, detail: str, hint: str = "") -> dict[str, Any]:
    return {"part": part, "works": works, "needed": needed, "detail": detail, "hint": hint}


def _needed() -> list[dict[str, Any]]:
    import sqlite3
    import tempfile
    from pathlib import Path

    from forestall.config import cache_dir
    from forestall.errors import ForestallError
    from forestall.memory.store import open_store

    of_world = [_row(w.what, w.works, w.needed, w.detail, w.hint) for w in _world()]
    rows = [r for r in of_world if r["needed"]]
    with tempfile.TemporaryDirectory() as folder:
        try:
            with open_store(Path(folder) / "probe.db", create=True):
                pass
            rows.append(_row("memory", True, True, f"SQLite {sqlite3.sqlite_version}"))
        except ForestallError as error:
            rows.append(_row("memory", False, True, str(error), "free space or use another folder"))
    if installed("perception"):
        rows.append(_encoder())
    folder_ok, detail = _writable(cache_dir())
    rows.append(
        _row("cache folder", folder_ok, True, detail, "set FORESTALL_CACHE to a writable folder")
    )
    rows += [r for r in of_world if not r["needed"]]
    return rows


def _world() -> Sequence[Working]:
    """What the world of the shipped tasks says of this machine, where it is installed."""
    if not installed("kitchen"):
        return ()
    from forestall.assembly.configuration import run_config
    from forestall.assembly.make import make_world
    from forestall.tasks.files import load_task, task_names

    name = task_names()[0]
    return make_world(run_config(name), load_task(name).domain).check()


def _encoder() -> dict[str, Any]:
    """Whether the shipped encoder can be read and run."""
    import time

    import numpy as np

    from forestall.embeddings.twotower import TwoTowerEncoder
    from forestall.errors import ModelFileError

    started = time.perf_counter()
    try:
        encoder = TwoTowerEncoder()
        encoder.encode(["a thing"])
        encoder.encode_image(np.zeros((48, 64, 3), dtype=np.uint8))
    except ModelFileError as error:
        return _row("image-text encoder", False, True, str(error))
    detail = f"{encoder.name} (read in {1000 * (time.perf_counter() - started):.0f} ms)"
    return _row("image-text encoder", True, True, detail)


def _writable(folder: Any) -> tuple[bool, str]:
    import tempfile

    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(b"x")
    except OSError as error:
        return False, str(error)
    return True, str(folder)


def _optional() -> list[dict[str, Any]]:
    rows = []
    for extra, brings in EXTRAS.items():
        works = installed(extra)
        detail = brings.what if works else f"not installed ({brings.what})"
        rows.append(_row(f"extra [{extra}]", works, False, detail, how(extra)))
    return rows
