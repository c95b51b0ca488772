"""Demonstrations in a stranger's words, for tests: a peg, a hole, a lid, and no domain file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

INSERT = "insert(peg-1, hole-1, driver-1)"
UNSCREW = "unscrew(lid-1, hole-1)"
GRASP = "grasp(peg-1)"

PLACES = {
    "tray": "peg-1 lies_in tray-1",
    "hand": "peg-1 held_by gripper",
    "hole": "peg-1 seated_in hole-1",
}


def scene(
    peg: str = "tray",
    *,
    hole: str | None = "clean",
    lid: str = "loose",
    more: Sequence[str] = (),
    relations: Sequence[str] = (),
    without: Sequence[str] = (),
    unseen: Sequence[str] = (),
) -> dict[str, Any]:
    objects: dict[str, dict[str, Any]] = {
        "peg-1": {},
        "hole-1": {"surface": hole},
        "lid-1": {"thread": lid},
        "tray-1": {},
        "driver-1": {},
        **{name: {} for name in more},
    }
    kept = {name: said for name, said in objects.items() if name not in without}
    place = [] if "peg-1" in without else [PLACES[peg]]
    return {"objects": kept, "relations": [*place, *relations], "unseen": list(unseen)}


def demonstration(number: int) -> list[Any]:
    """One of twelve: the lid, the peg, the hole, with other things about in some of them."""
    about = [f"bolt-{k}" for k in range(1, number % 3 + 1)]
    return [
        (UNSCREW, scene(lid="tight", more=about)),
        (GRASP, scene(more=about)),
        (INSERT, scene("hand", more=about)),
        scene("hole", more=about),
    ]


TWELVE = [demonstration(number) for number in range(12)]
