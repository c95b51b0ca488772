"""Opening files of others: within a budget, within their folder. Called by all of `reading`."""

from __future__ import annotations

import lzma
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from forestall.errors import FileFormatError, ForestallError

MOST_BYTES = 64 * 2**20
"""How large a document may be; ours are a few MiB at most."""


def read_bytes(path: Path, what: str, most: int = MOST_BYTES) -> bytes:
    """The content of a file.

    Args:
        path: of a regular file; pipes and devices, which may never end, are refused.
        what: it should be, e.g. "scene graph", for the sentence.
        most: bytes that it may have.

    Raises:
        FileFormatError: no such file, not readable, or larger than that.
    """
    try:
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):
            kind = "a folder" if stat.S_ISDIR(mode) else "no regular file"
            raise FileFormatError(f"cannot read {what} {path}: it is {kind}")
        with path.open("rb") as file:
            data = file.read(most + 1)
    except (OSError, ValueError) as error:  # a path with a null character is a ValueError
        why = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise FileFormatError(f"cannot read {what} {path}: {why}") from error
    if len(data) > most:
        raise FileFormatError(f"{path} is larger than the {_size(most)} that a {what} may have")
    return data


def read_text(path: Path, what: str, most: int = MOST_BYTES, torn: str = "strict") -> str:
    """The content of a UTF-8 text file, without a byte order mark.

    Args:
        path: of the file.
        what: it should be.
        most: bytes that it may have.
        torn: "replace" where a character may be cut in half by a kill.

    Raises:
        FileFormatError: as `read_bytes`, or it is no text.
    """
    try:
        return read_bytes(path, what, most).decode("utf-8-sig", torn)
    except UnicodeDecodeError as error:
        raise FileFormatError(
            f"{path} is no {what}: it is not UTF-8 text (byte {error.start})"
        ) from error


def read_packed_text(path: Path, what: str, most: int = MOST_BYTES) -> str:
    """The content of a UTF-8 text file that was packed with xz.

    Args:
        path: of the file.
        what: it should be.
        most: bytes that it may have, packed and unpacked.

    Raises:
        FileFormatError: as `read_text`, or it is damaged or no such file.
    """
    unpacker = lzma.LZMADecompressor(lzma.FORMAT_XZ)
    try:
        data = unpacker.decompress(read_bytes(path, what, most), max_length=most + 1)
    except lzma.LZMAError as error:
        raise FileFormatError(f"{path} is no {what} packed with xz: {error}") from error
    if len(data) > most:
        raise FileFormatError(f"{path} unpacks to more than the {_size(most)} of a {what}")
    if not unpacker.eof:
        raise FileFormatError(f"{path} is cut off: it is no whole {what}")
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        raise FileFormatError(
            f"{path} is no {what}: it is not UTF-8 text (byte {error.start})"
        ) from error


def inside(folder: Path, name: str) -> Path:
    """A file that something in a folder names; it may not lead out of the folder.

    Raises:
        FileFormatError: it is absolute, climbs up, or is a link to elsewhere.
    """
    path = folder / name if is_inside(name) else None
    try:
        if path is not None and path.resolve().is_relative_to(folder.resolve()):
            return path
    except (OSError, RuntimeError, ValueError):  # links in a circle, a name too long
        pass
    raise FileFormatError(f"{name!r} is no file inside the folder {folder}")


def is_inside(name: str) -> bool:
    """Whether a name can only mean something inside the folder that names it."""
    path = PurePosixPath(name)
    climbs = path.is_absolute() or ".." in path.parts or not path.parts
    return not climbs and not any(c in name for c in "\\:\0")


@contextmanager
def decoding(path: Path, what: str) -> Iterator[None]:
    """Around a decoder of others: whatever it makes of damaged bytes becomes one sentence.

    Raises:
        FileFormatError: the decoder failed, in whatever way.
    """
    try:
        yield
    except ForestallError:
        raise
    except Exception as error:  # decoders of others raise anything over damaged bytes
        told = " ".join(str(error).split())[:200] or type(error).__name__
        raise FileFormatError(f"{path} cannot be read as {what}: {told}") from error


def _size(most: int) -> str:
    return f"{most / 2**20:g} MiB"
