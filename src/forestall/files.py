"""Files that are whole or not there, and folders that one process writes at a time.

Called by whatever keeps something; calls only errors. Partial files have names that nobody else
makes: process ids are no such names, since processes of two containers share them.
"""

from __future__ import annotations

import os
import re
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO
from uuid import uuid4

from forestall.errors import InputError

LOCK = ".lock"
HOLDER = ".lock.holder"
_PARTIAL = re.compile(r"^\.[0-9a-f]{32}\.part$")


@contextmanager
def whole_file(path: Path) -> Iterator[IO[bytes]]:
    """Write a file that appears complete or not at all.

    Raises:
        OSError: it cannot be written; names the file.
    """
    partial = path.with_name(f".{uuid4().hex}.part")
    with naming(path):
        try:
            with partial.open("xb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            os.replace(partial, path)
        except BaseException:  # an interrupt, too, leaves no half file
            partial.unlink(missing_ok=True)
            raise


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Say which file could not be written; a full disk does not say it by itself.

    Raises:
        OSError: with the file's name.
    """
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


def replace_file(path: Path, data: bytes) -> None:
    """Write a file so that it is never seen half written."""
    with whole_file(path) as file:
        file.write(data)


def make_folder(folder: Path) -> None:
    """Make a folder that something is to be written to, unless it is there.

    Raises:
        InputError: it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{folder} cannot be written to ({error.strerror}): name another folder"
        ) from error


@contextmanager
def alone(
    folder: Path, name: str = "", waits: Callable[[str], None] | None = None
) -> Iterator[None]:
    """Keep other processes out of a folder, or out of one thing in it.

    The lock is one of the system: it goes with the process, however that ends. Partial files that
    a killed process left in the folder are taken away when all of it is locked.

    Args:
        folder: must be there.
        name: of the thing; all of the folder by default.
        waits: told who holds it, and then it is waited for; without it, that is an error.

    Raises:
        InputError: another process holds it; says which, and since when.
        OSError: nothing can be written there.
    """
    from filelock import FileLock, Timeout

    holder = folder / f"{name}{HOLDER}"
    lock = FileLock(folder / f"{name}{LOCK}")
    try:
        lock.acquire(timeout=0)
    except Timeout:
        who = _holder(holder)
        if waits is None:
            raise InputError(
                f"{folder} is being written by {who}: wait until it has ended, or name another "
                "folder"
            ) from None
        waits(who)
        lock.acquire()
    try:
        since = time.strftime("%Y-%m-%d %H:%M:%S")
        me = f"process {os.getpid()} on {socket.gethostname()}, since {since}"
        replace_file(holder, me.encode())
        if not name:
            _tidy(folder)
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()


def _holder(file: Path) -> str:
    """Who said last that they hold a lock; between locking and saying so nobody has."""
    try:
        return file.read_text("utf-8")[:200] or "another process"
    except (OSError, UnicodeDecodeError):
        return "another process"


def _tidy(folder: Path) -> None:
    for place, folders, names in os.walk(folder):
        for name in names:
            if _PARTIAL.match(name):
                Path(place, name).unlink(missing_ok=True)
        folders[:] = [f for f in folders if not Path(place, f, LOCK).exists()]


__all__ = ["LOCK", "alone", "make_folder", "naming", "replace_file", "whole_file"]
