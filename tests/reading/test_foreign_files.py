"""Pictures, arrays and paths of others: read within budgets and inside their folder."""

import io
import os
import struct
import zipfile
import zlib
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from PIL import Image

from forestall.errors import FileFormatError
from forestall.reading import arrays, pictures
from forestall.reading.arrays import read_npy, read_npz
from forestall.reading.files import inside, is_inside, read_bytes
from forestall.reading.pictures import read_picture
from forestall.reading.printing import one_line, printable


def png_that_claims(width: int, height: int) -> bytes:
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = [(b"IHDR", head), (b"IDAT", zlib.compress(b"\0" * 100)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in chunks
    )


def npy_head(head: str, content: bytes = b"") -> bytes:
    text = head.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + content


def test_a_picture_is_read_and_converted(tmp_path: Path) -> None:
    Image.fromarray(np.full((3, 4), 7, dtype=np.uint8)).save(tmp_path / "a.png")
    assert read_picture(tmp_path / "a.png").size == (4, 3)
    assert np.asarray(read_picture(tmp_path / "a.png", "RGB")).shape == (3, 4, 3)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is not a picture"),
        (b"no picture", "is not a picture"),
        (png_that_claims(10**5, 10**5), "bomb"),
        (png_that_claims(12_000, 10_000), "12000 x 10000 pixels"),
        (png_that_claims(100, 100), "cannot be read as a picture"),
    ],
)
def test_what_is_no_picture_is_named(tmp_path: Path, content: bytes, says: str) -> None:
    file = tmp_path / "a.png"
    file.write_bytes(content)
    with pytest.raises(FileFormatError, match=says) as caught:
        read_picture(file)
    assert str(file) in str(caught.value)


def test_a_picture_beyond_its_budget_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Image.new("RGB", (10, 10)).save(tmp_path / "a.png")
    monkeypatch.setattr(pictures, "MOST_PIXELS", 99)
    with pytest.raises(FileFormatError, match="10 x 10"):
        read_picture(tmp_path / "a.png")


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("kind", ["<f4", ">f8", "?", "u2"])
def test_arrays_come_back(tmp_path: Path, kind: str, order: Literal["C", "F"]) -> None:
    array = np.array(np.arange(6).reshape(2, 3), dtype=kind, order=order)
    np.save(tmp_path / "a.npy", array)
    read = read_npy(tmp_path / "a.npy")
    assert np.array_equal(read, array) and read.dtype.isnative and read.flags.writeable
    np.savez_compressed(tmp_path / "a.npz", one=array, two=array[:1])
    assert np.array_equal(read_npz(tmp_path / "a.npz")["two"], array[:1])


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "a.npy cannot be read as a numpy array"),
        (
            npy_head("{'descr': '<f4', 'fortran_order': False, 'shape': (1000000, 1000000)}"),
            "needs",
        ),
        (npy_head("{'descr': '<f4', 'fortran_order': False, 'shape': (-1,)}"), "shape"),
        (npy_head("{'descr': '|O', 'fortran_order': False, 'shape': (1,)}"), "object"),
        (npy_head("{'descr': '<U4', 'fortran_order': False, 'shape': (1,)}"), "plain numbers"),
        (npy_head("("), "cannot be read"),
        (npy_head("__import__('os').abort()"), "cannot be read"),
        (b"\x93NUMPY\x02\x00" + struct.pack("<I", 9000) + b"(" * 9000, "cannot be read"),
    ],
)
def test_a_damaged_array_is_one_sentence(tmp_path: Path, content: bytes, says: str) -> None:
    file = tmp_path / "a.npy"
    file.write_bytes(content)
    with pytest.raises(FileFormatError, match=says) as caught:
        read_npy(file)
    assert "\n" not in str(caught.value)


def test_archives_keep_to_their_budget(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "a.npz"
    np.savez_compressed(file, one=np.zeros(10**6))
    monkeypatch.setattr(arrays, "MOST_ARRAY_BYTES", 10**6)
    with pytest.raises(FileFormatError, match="unpacked; at most"):
        read_npz(file)
    monkeypatch.setattr(arrays, "MOST_ARRAYS", 0)
    with pytest.raises(FileFormatError, match="1 arrays; at most 0"):
        read_npz(file)


def test_an_archive_is_zip_of_arrays(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    buffer = io.BytesIO()
    np.save(buffer, np.zeros(3))
    with zipfile.ZipFile(file, "w", compression=zipfile.ZIP_BZIP2) as archive:
        archive.writestr("one.npy", buffer.getvalue())
    with pytest.raises(FileFormatError, match="unknown way"):
        read_npz(file)
    file.write_bytes(b"PK\x03\x04 and so on")
    with pytest.raises(FileFormatError, match=r"numpy archive \(.npz\)"):
        read_npz(file)


@pytest.mark.parametrize("name", ["/etc/hosts", "../a.png", "a/../../b", "C:\\a", "a\0b", "", "."])
def test_a_name_that_leaves_its_folder_is_refused(tmp_path: Path, name: str) -> None:
    assert not is_inside(name)
    with pytest.raises(FileFormatError, match="no file inside the folder"):
        inside(tmp_path, name)


def test_links_out_of_the_folder_and_in_circles_are_refused(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (tmp_path / "secret.png").write_text("x")
    (folder / "out.png").symlink_to(tmp_path / "secret.png")
    (folder / "round.png").symlink_to(folder / "round.png")
    (folder / "in.png").write_text("x")
    (folder / "also.png").symlink_to(folder / "in.png")
    assert inside(folder, "also.png") == folder / "also.png"
    with pytest.raises(FileFormatError, match=r"out\.png"):
        inside(folder, "out.png")
    with pytest.raises(FileFormatError, match=r"round\.png"):
        read_bytes(folder / "round.png", "thing")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes on this system")
def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileFormatError, match="no regular file"):
        read_bytes(tmp_path / "pipe", "thing")


def test_what_steers_a_terminal_is_written_out() -> None:
    assert printable("Tasse-1 größer, マグ") == "Tasse-1 größer, マグ"
    assert printable("a\x1b[2J\x07b\x9b") == r"a\x1b[2J\x07b\x9b"
    assert printable("\u202eexe.mug\u2028") == r"\u202eexe.mug\u2028"
    assert printable("\ud800") == r"\ud800"
    assert printable("two\nlines\tand tabs") == "two\nlines\tand tabs"
    assert one_line("two\nlines \x1b[0m") == r"two lines \x1b[0m"
