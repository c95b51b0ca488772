"""Pickles of others as plain data: no name in them is looked up, so that nothing of them can run.

Python's own unpickler imports what a pickle names and calls it. This one reads the opcodes
(`pickletools`) and builds builtins, arrays of numbers and, of classes that the caller admits by
name, `Made`: the name with what the pickle says of the object. Every other name is refused before
anything is made of it. Called by readers of data sets; calls `files`, `pickled_arrays`.
"""

from __future__ import annotations

import io
import pickletools
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from forestall.errors import FileFormatError
from forestall.reading.files import MOST_BYTES, decoding, read_bytes
from forestall.reading.pickled_arrays import NAMES, PickledType, array_of, fill

MOST_OPCODES = 1_000_000
"""What a pickle of one event has is a tenth of it."""

MOST_INTEGER_BITS = 512
MOST_TEXT = 2**20
_MARK = object()
_SCALARS = (str, int, float, bool, bytes, type(None))


@dataclass(slots=True, eq=False)
class Made:
    """An object of a class that was admitted; the class itself is nowhere here.

    Args:
        name: "module.Class".
        state: its attributes.
        items: what it holds under keys, if it is a mapping.
    """

    name: str
    state: dict[str, Any] = field(default_factory=dict)
    items: dict[Any, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class _Named:
    """A name that was admitted, and nothing behind it."""

    name: str


def read_pickle(
    path: Path, what: str, admitted: Collection[str] = (), most: int = MOST_BYTES
) -> Any:
    """The content of a pickle.

    Args:
        path: of the file.
        what: it should be, e.g. "stored event", for the sentence.
        admitted: classes whose objects it may have, as "module.Class"; numpy's arrays, scalars and
            types of numbers always are.
        most: bytes that it may have.

    Returns:
        Builtins, arrays, and `Made`; the same object wherever the pickle has the same object.

    Raises:
        FileFormatError: another name, with it; not readable, cut off, too large, or too much in it.
    """
    data = read_bytes(path, what, most)
    with decoding(path, what):
        return _Machine(frozenset(admitted), what, path).run(data)


class _Machine:
    """The stack and the memo of one pickle."""

    def __init__(self, admitted: frozenset[str], what: str, path: Path) -> None:
        self._admitted, self._what, self._path = admitted, what, path
        self._stack: list[Any] = []
        self._memo: dict[int, Any] = {}

    def run(self, data: bytes) -> Any:
        """Whatever stands on the stack at the end."""
        for count, (opcode, argument, _) in enumerate(pickletools.genops(io.BytesIO(data))):
            if count >= MOST_OPCODES:
                raise ValueError(f"it has more than {MOST_OPCODES} opcodes")
            name = opcode.name
            if name == "STOP":
                if len(self._stack) != 1:
                    raise ValueError("it ends with something left over")
                return self._pop()
            if name in _IGNORED:
                continue
            if name in _LITERALS:
                self._stack.append(_checked(argument))
            elif name in _MADE:
                self._stack.append(_MADE[name]())
            elif (step := _STEPS.get(name)) is not None:
                step(self, argument)
            else:
                raise ValueError(f"it has an opcode that no {self._what} needs: {name}")
        raise ValueError("it is cut off")

    # --- stack and memo --------------------------------------------------------------------------

    def _pop(self) -> Any:
        if not self._stack or self._stack[-1] is _MARK:
            raise ValueError("something is taken from an empty stack")
        return self._stack.pop()

    def _top(self) -> Any:
        if not self._stack or self._stack[-1] is _MARK:
            raise ValueError("something is asked of an empty stack")
        return self._stack[-1]

    def _since_mark(self) -> list[Any]:
        for at in range(len(self._stack) - 1, -1, -1):
            if self._stack[at] is _MARK:
                found = self._stack[at + 1 :]
                del self._stack[at:]
                return found
        raise ValueError("there is no mark")

    def _do_mark(self, _: Any) -> None:
        self._stack.append(_MARK)

    def _do_pop(self, _: Any) -> None:
        if not self._stack:
            raise ValueError("something is taken from an empty stack")
        self._stack.pop()

    def _do_pop_mark(self, _: Any) -> None:
        self._since_mark()

    def _do_dup(self, _: Any) -> None:
        self._stack.append(self._top())

    def _do_put(self, at: int) -> None:
        self._memo[at] = self._top()

    def _do_memoize(self, _: Any) -> None:
        self._memo[len(self._memo)] = self._top()

    def _do_get(self, at: int) -> None:
        if at not in self._memo:
            raise ValueError(f"it asks for number {at}, which it has not stored")
        self._stack.append(self._memo[at])

    # --- containers ------------------------------------------------------------------------------

    def _do_list(self, _: Any) -> None:
        self._stack.append(self._since_mark())

    def _do_append(self, _: Any) -> None:
        value = self._pop()
        self._list().append(value)

    def _do_appends(self, _: Any) -> None:
        values = self._since_mark()
        self._list().extend(values)

    def _list(self) -> list[Any]:
        top = self._top()
        if not isinstance(top, list):
            raise ValueError("something is appended to what is no list")
        return top

    def _do_tuple(self, _: Any) -> None:
        self._stack.append(tuple(self._since_mark()))

    def _tuple_of(self, count: int) -> None:
        values = [self._pop() for _ in range(count)]
        self._stack.append(tuple(reversed(values)))

    def _do_dict(self, _: Any) -> None:
        found: dict[Any, Any] = {}
        self._fill(found, self._since_mark())
        self._stack.append(found)

    def _do_set_item(self, _: Any) -> None:
        value, key = self._pop(), self._pop()
        self._fill(self._top(), [key, value])

    def _do_set_items(self, _: Any) -> None:
        pairs = self._since_mark()
        self._fill(self._top(), pairs)

    def _fill(self, into: Any, pairs: list[Any]) -> None:
        held = into.items if isinstance(into, Made) else into
        if not isinstance(held, dict) or len(pairs) % 2:
            raise ValueError("pairs are put into what has none")
        for key, value in zip(pairs[::2], pairs[1::2], strict=True):
            held[_key(key)] = value

    def _do_add_items(self, _: Any) -> None:
        values = self._since_mark()
        top = self._top()
        if not isinstance(top, set):
            raise ValueError("something is added to what is no set")
        top.update(_key(v) for v in values)

    def _do_frozen_set(self, _: Any) -> None:
        self._stack.append(frozenset(_key(v) for v in self._since_mark()))

    # --- names and what is made of them ----------------------------------------------------------

    def _do_global(self, argument: str) -> None:
        module, _, name = argument.partition(" ")
        self._admit(module, name)

    def _do_stack_global(self, _: Any) -> None:
        name, module = self._pop(), self._pop()
        self._admit(module, name)

    def _admit(self, module: Any, name: Any) -> None:
        full = f"{module}.{name}"
        if full not in NAMES and full not in self._admitted:
            raise FileFormatError(
                f"{self._path} is refused: its pickle names {full[:120]!r}, which no {self._what} "
                "needs; nothing in it was run"
            )
        self._stack.append(_Named(full))

    def _do_reduce(self, _: Any) -> None:
        given, called = self._pop(), self._pop()
        if not isinstance(called, _Named) or not isinstance(given, tuple):
            raise ValueError("it calls what is no name")
        made = array_of(called.name, tuple(_bare(g) for g in given))
        if made is None:
            raise ValueError(f"it calls {called.name}")
        self._stack.append(made)

    def _do_new_object(self, _: Any) -> None:
        given, kind = self._pop(), self._pop()
        if not isinstance(kind, _Named) or kind.name not in self._admitted or given != ():
            raise ValueError("it makes an object of what is no admitted class, or with arguments")
        self._stack.append(Made(kind.name))

    def _do_build(self, _: Any) -> None:
        state = self._pop()
        top = self._top()
        if isinstance(top, PickledType) and isinstance(state, tuple):
            top.build(state)
        elif isinstance(top, np.ndarray) and isinstance(state, tuple):
            fill(top, state)
        elif isinstance(top, Made) and isinstance(state, dict):
            if not all(isinstance(k, str) for k in state):
                raise ValueError(f"an attribute of {top.name} has no name")
            top.state.update(state)
        else:
            raise ValueError("a state is given to what has none")


_Step = Callable[[_Machine, Any], None]

_IGNORED = frozenset(("PROTO", "FRAME"))
_LITERALS = frozenset(
    ("INT", "BININT", "BININT1", "BININT2", "LONG", "LONG1", "LONG4", "FLOAT", "BINFLOAT",
     "UNICODE", "SHORT_BINUNICODE", "BINUNICODE", "BINUNICODE8", "SHORT_BINBYTES", "BINBYTES",
     "BINBYTES8", "BYTEARRAY8")
)  # fmt: skip
_MADE: dict[str, Callable[[], Any]] = {
    "NONE": lambda: None,
    "NEWTRUE": lambda: True,
    "NEWFALSE": lambda: False,
    "EMPTY_LIST": list,
    "EMPTY_DICT": dict,
    "EMPTY_TUPLE": tuple,
    "EMPTY_SET": set,
}
_STEPS: dict[str, _Step] = {
    "MARK": _Machine._do_mark,
    "POP": _Machine._do_pop,
    "POP_MARK": _Machine._do_pop_mark,
    "DUP": _Machine._do_dup,
    "PUT": _Machine._do_put,
    "BINPUT": _Machine._do_put,
    "LONG_BINPUT": _Machine._do_put,
    "MEMOIZE": _Machine._do_memoize,
    "GET": _Machine._do_get,
    "BINGET": _Machine._do_get,
    "LONG_BINGET": _Machine._do_get,
    "LIST": _Machine._do_list,
    "APPEND": _Machine._do_append,
    "APPENDS": _Machine._do_appends,
    "TUPLE": _Machine._do_tuple,
    "TUPLE1": lambda machine, _: machine._tuple_of(1),
    "TUPLE2": lambda machine, _: machine._tuple_of(2),
    "TUPLE3": lambda machine, _: machine._tuple_of(3),
    "DICT": _Machine._do_dict,
    "SETITEM": _Machine._do_set_item,
    "SETITEMS": _Machine._do_set_items,
    "ADDITEMS": _Machine._do_add_items,
    "FROZENSET": _Machine._do_frozen_set,
    "GLOBAL": _Machine._do_global,
    "INST": _Machine._do_global,
    "STACK_GLOBAL": _Machine._do_stack_global,
    "REDUCE": _Machine._do_reduce,
    "NEWOBJ": _Machine._do_new_object,
    "BUILD": _Machine._do_build,
}


def _checked(value: Any) -> Any:
    if isinstance(value, int) and value.bit_length() > MOST_INTEGER_BITS:
        raise ValueError("an integer in it is too long")
    if isinstance(value, str) and len(value) > MOST_TEXT:
        raise ValueError("a text in it is too long")
    return value


def _key(value: Any) -> Any:
    """A key, or a member of a set: plain, or a flat tuple, so that hashing it takes no time."""
    flat = isinstance(value, tuple) and all(isinstance(v, _SCALARS) for v in value)
    if not flat and not isinstance(value, _SCALARS):
        raise ValueError("a key in it is neither plain nor a flat tuple")
    return value


def _bare(value: Any) -> Any:
    return value.name if isinstance(value, _Named) else value
