"""Pickles of others: plain data and arrays come out, whatever else they name is refused."""

import os
import pickle
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from forestall.errors import FileFormatError
from forestall.reading import pickles
from forestall.reading.pickles import Made, read_pickle

ARRAYS: dict[str, npt.NDArray[Any]] = {
    "rows": np.arange(12, dtype=np.float32).reshape(3, 4),
    "part": np.arange(24, dtype=np.uint8).reshape(2, 3, 4)[:, :, :3],
    "columns": np.asfortranarray(np.arange(6, dtype=np.int64).reshape(2, 3)),
    "other end first": np.arange(3, dtype=">i4"),
    "flags": np.eye(2, dtype=bool),
    "nothing": np.zeros((0, 3)),
}


class Thing:
    """A class of somebody else's."""

    def __init__(self) -> None:
        self.number, self.me = 7, self


class Runs:
    """What runs a program when Python's own unpickler reads it."""

    def __init__(self, call: Any, *said: Any) -> None:
        self.call, self.said = call, said

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        return self.call, self.said


def kept(tmp_path: Path, value: Any, protocol: int = pickle.HIGHEST_PROTOCOL) -> Path:
    path = tmp_path / "a.pickle"
    path.write_bytes(value if isinstance(value, bytes) else pickle.dumps(value, protocol))
    return path


@pytest.mark.parametrize("protocol", [4, 5])
def test_builtins_come_out_as_they_went_in(tmp_path: Path, protocol: int) -> None:
    shared = [1]
    value = {
        "a": [None, True, 1.5, -3, 2**70, "é", b"\0"],
        (1, 2): {3, 4},
        "b": frozenset(("x",)),
        "again": (shared, shared),
        7: (),
    }
    found = read_pickle(kept(tmp_path, value, protocol), "test")
    assert found == value
    assert found["again"][0] is found["again"][1]


@pytest.mark.parametrize("protocol", [4, 5])
@pytest.mark.parametrize("name", ARRAYS)
def test_arrays_of_numbers_are_read(tmp_path: Path, name: str, protocol: int) -> None:
    found = read_pickle(kept(tmp_path, {"it": ARRAYS[name]}, protocol), "test")["it"]
    assert found.dtype == ARRAYS[name].dtype.newbyteorder("=")
    assert np.array_equal(found, ARRAYS[name])


def test_numbers_of_numpy_become_numbers(tmp_path: Path) -> None:
    found = read_pickle(kept(tmp_path, [np.uint32(7), np.float64(0.5), np.bool_(True)]), "test")
    assert found == [7, 0.5, True]
    assert [type(v) for v in found] == [int, float, bool]


def test_an_admitted_object_is_its_name_and_what_is_said_of_it(tmp_path: Path) -> None:
    name = f"{Thing.__module__}.Thing"
    found = read_pickle(kept(tmp_path, Thing()), "test", (name,))
    assert isinstance(found, Made)
    assert (found.name, found.state["number"]) == (name, 7)
    assert found.state["me"] is found


EVIL = {
    "the shell": Runs(os.system, "touch ran"),
    "deep inside": {"a": [{"b": (1, Runs(os.system, "touch ran"))}]},
    "a program": Runs(subprocess.check_output, ["touch", "ran"]),
    "eval": Runs(eval, "open('ran', 'w')"),
    "getattr": b"cbuiltins\ngetattr\n(cos\nsystem\nVx\ntR.",
    "a class that nobody admitted": Thing(),
    "objects in an array": np.array([Runs(os.system, "touch ran")], dtype=object),
    "an array of structures": np.zeros(2, dtype=[("a", "i4")]),
    "by name, protocol 0": b"cos\nsystem\n(Vtouch ran\ntR.",
    "by an instance, protocol 0": b"(Vtouch ran\nios\nsystem\n.",
    "a name of numpy's that reads files": b"cnumpy\nload\n(Vran\ntR.",
    "an extension": b"\x82\x01.",
    "something kept elsewhere": b"Vran\nQ.",
}


@pytest.mark.parametrize("how", EVIL)
def test_what_else_it_names_is_refused_and_nothing_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FileFormatError) as error:
        read_pickle(kept(tmp_path, EVIL[how]), "stored event")
    assert not (tmp_path / "ran").exists()
    assert "a.pickle" in str(error.value)


@pytest.mark.parametrize(
    ("how", "name"),
    [
        ("the shell", f"{os.system.__module__}.system"),
        ("deep inside", f"{os.system.__module__}.system"),
        ("eval", "builtins.eval"),
        ("a name of numpy's that reads files", "numpy.load"),
        ("by an instance, protocol 0", "os.system"),
    ],
)
def test_the_refusal_says_the_name(tmp_path: Path, how: str, name: str) -> None:
    with pytest.raises(FileFormatError, match=f"names '{name}'.*nothing in it was run"):
        read_pickle(kept(tmp_path, EVIL[how]), "stored event")


def test_an_admitted_class_is_not_called(tmp_path: Path) -> None:
    """A name that is admitted makes objects, and no calls."""
    path = kept(tmp_path, b"cos\nsystem\n(Vtouch ran\ntR.")
    with pytest.raises(FileFormatError, match=r"it calls os\.system"):
        read_pickle(path, "test", ("os.system",))


def _array(shape: tuple[int, ...], raw: bytes) -> bytes:
    """A pickle of an array that says that it has a shape, over bytes that it has."""
    good = pickle.dumps(np.zeros(4, np.uint8), 5)
    return good.replace(b"K\x04\x85", pickle.dumps(shape, 2)[2:-1]).replace(b"\0\0\0\0", raw)


HUGE: dict[str, bytes] = {
    "an array that has no bytes": _array((2**40,), b"\0\0\0\0"),
    "bytes that are not there": b"\x80\x04\x8e" + struct.pack("<Q", 2**40) + b"x.",
    "an array of bytes that are not there": b"\x80\x05\x96" + struct.pack("<Q", 2**40) + b"x.",
    "a frame that is not there": b"\x80\x04\x95" + struct.pack("<Q", 2**40) + b"N",
    "a place in the memo that is far away": b"\x80\x04]r" + struct.pack("<I", 2**31) + b".",
    "an integer of a million digits": b"\x80\x02\x8b" + struct.pack("<i", 2**20) + b"\1" * 2**20,
}


@pytest.mark.parametrize("how", HUGE)
def test_what_it_claims_is_not_allocated(tmp_path: Path, how: str) -> None:
    path = kept(tmp_path, HUGE[how])
    if how == "a place in the memo that is far away":
        assert read_pickle(path, "test") == []
        return
    with pytest.raises(FileFormatError, match=r"a\.pickle cannot be read as test"):
        read_pickle(path, "test")


def test_a_key_that_would_take_forever_to_hash_is_refused(tmp_path: Path) -> None:
    doubled = b"N" + b"2\x86" * 60  # a tuple of the last one twice, sixty times over
    with pytest.raises(FileFormatError, match="a key in it"):
        read_pickle(kept(tmp_path, b"\x80\x04}" + doubled + b"Ns."), "test")


def test_every_cut_is_told(tmp_path: Path) -> None:
    whole = pickle.dumps({"a": [1, "two", np.arange(3)], "b": Thing}, 5)
    for length in range(len(whole) - 1):
        with pytest.raises(FileFormatError, match=r"a\.pickle"):
            read_pickle(kept(tmp_path, whole[:length]), "test")


def test_too_many_opcodes_and_too_many_bytes_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(FileFormatError, match="larger than"):
        read_pickle(kept(tmp_path, "x" * 100), "test", most=50)
    monkeypatch.setattr(pickles, "MOST_OPCODES", 50)
    with pytest.raises(FileFormatError, match="more than 50 opcodes"):
        read_pickle(kept(tmp_path, list(range(100))), "test")


@pytest.mark.parametrize("odd", [b".", b"\x80\x04N0.", b"(N.", b"a.", b"Na.", b"h\x07.", b"]Ns."])
def test_what_no_pickle_would_say_is_told(tmp_path: Path, odd: bytes) -> None:
    with pytest.raises(FileFormatError, match="cannot be read as test"):
        read_pickle(kept(tmp_path, odd), "test")
