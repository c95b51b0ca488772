"""Damage, seeded: what a file or a value can become that nobody meant it to be."""

from __future__ import annotations

import copy
import json
import math
from random import Random
from typing import Any

TEXTS = (
    "", " ", "\x1b[31m", "\x1b]0;owned\x07", "\u202e", "\x00", "\ud800", "²", "Mug-²", "Plate-1\n",
    "../../etc/passwd", "/etc/passwd", "C:\\x", "a" * 300, "a" * 100_000, "a(" + " " * 5000,
    "Plate-99999999999999999999", "Plate-" + "9" * 5000, "'; DROP TABLE demonstrations;--",
    "<script>alert(1)</script>", "{thing}", "{0.__class__}", "%s%n", "nan", "-1", "1e999", "None",
    "not " * 500 + "clear(?x)", "(" * 500, "?x", "#tag", "-Name", "fewer than 9 of ?x: on(?x, ?y)",
    "pick_up(Plate)", "held_by(Plate-1, gripper)", "true", "\n[skills.x]\n",
)  # fmt: skip

VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 3, 255, 2**31, 2**53, 2**63 - 1, 2**63, 2**64, -(2**63), 10**400,
    0.5, -0.0, 1e-320, 1e-30, 1e30, 1e300, -1e300, math.nan, math.inf, -math.inf, [], {}, [[]],
    [None], {"": None}, {"a": {"b": []}}, [0, 0, 0], [1, 2], ["a", "b", "c"], [[0] * 4] * 4,
)  # fmt: skip

PIECES = (
    b"\x00", b"\xff\xfe", b"[" * 100_000, b'{"a":' * 50_000, b'"', b"NaN", b"\n", b"1e9999",
    b"9" * 5000, b"(" * 5000, b"\\ud800", "\u202e".encode(), b"#", b"'''", b"=", b")",
)  # fmt: skip


def value(rng: Random) -> Any:
    """Anything that JSON can say, and some that it cannot."""
    found = rng.choice(TEXTS) if rng.random() < 0.4 else rng.choice(VALUES)
    if rng.random() < 0.03:
        for _ in range(rng.choice((10, 70, 200))):
            found = [found]
    return copy.deepcopy(found)


def tree(data: Any, rng: Random) -> Any:
    """A document with one to three of its values changed, taken away, doubled or moved."""
    data = copy.deepcopy(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        data = _changed(data, rng)
    return data


def _changed(data: Any, rng: Random) -> Any:
    places = list(_places(data))
    if not places or rng.random() < 0.02:
        return value(rng)
    holder, key = rng.choice(places)
    action = rng.randrange(11)
    if action >= 9:
        holder[key] = _like(holder[key], rng)
    elif action <= 3:
        holder[key] = value(rng)
    elif action == 4:
        del holder[key]
    elif action == 5:
        holder[key] = _like(holder[key], rng)
    elif action == 6:
        other, at = rng.choice(places)
        if not _holds(other, at, holder):
            holder[key] = copy.deepcopy(other[at]) if _has(other, at) else value(rng)
    elif action == 7 and isinstance(holder, list):
        holder.extend(copy.deepcopy(holder[key]) for _ in range(rng.choice((1, 1, 5, 3000))))
    elif isinstance(holder, dict):
        holder[rng.choice(TEXTS) if rng.random() < 0.5 else f"{key}x"] = holder.pop(key)
    else:
        holder[key] = value(rng)
    return data


def _has(holder: Any, key: Any) -> bool:
    return key in holder if isinstance(holder, dict) else key < len(holder)


def _holds(holder: Any, key: Any, inner: Any) -> bool:
    """Whether copying what stands there would put a thing into itself, many times over."""
    return not _has(holder, key) or holder[key] is inner or holder is inner


def _places(data: Any) -> Any:
    todo = [data] if isinstance(data, dict | list) else []
    while todo:
        holder = todo.pop()
        keys = holder if isinstance(holder, dict) else range(len(holder))
        for key in list(keys):
            yield holder, key
            if isinstance(holder[key], dict | list):
                todo.append(holder[key])


def _like(found: Any, rng: Random) -> Any:
    """Of the same type, and something else."""
    if isinstance(found, bool) or found is None:
        return not found
    if isinstance(found, int | float):
        return rng.choice((found + 1, -found, found * 10, found * 1000, 0, found - 1, found // 3))
    if isinstance(found, str):
        at = rng.randrange(len(found) + 1)
        return rng.choice((found[:at], found[at:], found + found, found.upper(), f" {found} "))
    return found[: len(found) // 2] if isinstance(found, list) else {}


def raw(data: bytes, rng: Random) -> bytes:
    """Bytes cut, turned, doubled, or with something put between them."""
    found = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8))):
        at = rng.randrange(len(found) + 1)
        until = min(len(found), at + rng.choice((1, 4, 64, 4096)))
        action = rng.randrange(6)
        if action == 0:
            del found[at:]
        elif action == 1:
            del found[at:until]
        elif action == 2:
            found[at:at] = found[at:until]
        elif action == 3:
            found[at:until] = bytes(rng.randrange(256) for _ in range(until - at))
        elif action == 4 and found:
            found[at % len(found)] ^= 1 << rng.randrange(8)
        else:
            found[at:at] = rng.choice(PIECES)
    return bytes(found)


def json_text(data: Any) -> bytes:
    """JSON, with what JSON cannot say written as Python does."""
    return json.dumps(data, indent=1).encode()


def toml_text(data: Any) -> bytes:
    """TOML in its inline form; what is no TOML is written all the same, null is left out."""
    if not isinstance(data, dict):
        return _toml(data).encode()
    told = (f"{_key(k)} = {_toml(v)}" for k, v in data.items() if v is not None)
    return "\n".join(told).encode()


def _key(text: Any) -> str:
    return json.dumps(str(text))


def _toml(found: Any) -> str:
    if isinstance(found, dict):
        told = (f"{_key(k)} = {_toml(v)}" for k, v in found.items() if v is not None)
        return "{" + ", ".join(told) + "}"
    if isinstance(found, list | tuple):
        return "[" + ", ".join(_toml(v) for v in found if v is not None) + "]"
    if isinstance(found, float) and not math.isfinite(found):
        return {math.inf: "inf", -math.inf: "-inf"}.get(found, "nan")
    return json.dumps(found)
