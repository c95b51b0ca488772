"""What a moment's 3D view shows: boxes, relations, where the robot and its camera were.

Called by `page_view.py`, calls nothing; `templates/space.js` draws it. What it says is also in the
scene graph beside it, which is its alternative in words.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from forestall.report.drawn import Drawn
from forestall.types.episode import BoundaryRecord
from forestall.types.graph import ObjectNode, Relation, Seen

_DIGITS = 3
_SEEN = {Seen.VISIBLE: "", Seen.REMEMBERED: "remembered", Seen.UNOBSERVED: "unobserved"}


def space_of(boundary: BoundaryRecord, how: Drawn) -> dict[str, Any] | None:
    """The 3D view of a boundary as plain data, None where nothing has a box.

    Args:
        boundary: with the whole graph that was known.
        how: what holds what is always drawn; other relations of what concerns the subtask are
            drawn where one of the two is pointed at.

    Returns:
        `boxes`: id, words, looks (`near`: it concerns the subtask, `culprit`, `remembered`,
        `unobserved`), low and high corner in metres; `relations`: two positions in `boxes`, words,
        whether it is always drawn; `robot`: where it stands on the floor, or null; `yaw`: which way
        the camera looked, in radians from x to y, or null.
    """
    culprits = () if boundary.diagnosis is None else boundary.diagnosis.culprits
    near = {n.id for n in boundary.scoped.nodes} | set(culprits)
    boxed = [n for n in boundary.graph.nodes if n.box_m is not None]
    if not boxed:
        return None
    place = {n.id: k for k, n in enumerate(boxed)}
    seen = boundary.observation
    return {
        "boxes": [_box(n, n.id in near, n.id in culprits) for n in boxed],
        "relations": [
            [place[r.subject], place[r.object], r.predicate.replace("_", " "), always]
            for r, always in _relations(boundary, how)
            if r.subject in place and r.object in place
        ],
        "robot": None if seen is None else _rounded(seen.robot_position_world_m[:2]),
        "yaw": None if seen is None or not seen.frames else _yaw(seen.frames[-1].camera_to_world),
    }


def _box(node: ObjectNode, near: bool, culprit: bool) -> list[Any]:
    assert node.box_m is not None
    looks = " ".join(
        word for word in ("near" * near, "culprit" * culprit, _SEEN[node.seen]) if word
    )
    return [node.id, node.label(), looks, *_rounded((*node.box_m.low, *node.box_m.high))]


def _relations(boundary: BoundaryRecord, how: Drawn) -> Iterator[tuple[Relation, bool]]:
    """Each with whether it is always drawn; of two that say the same from both ends, one."""
    for relation in boundary.graph.relations:
        if relation.predicate in how.tree:
            yield relation, True
    said = set()
    for relation in boundary.scoped.relations:
        if relation.predicate in how.tree:
            continue
        other = how.mirror.get(relation.predicate)
        if other is None and relation.predicate in how.symmetric:
            other = relation.predicate
        if (relation.object, other, relation.subject) not in said:
            said.add((relation.subject, relation.predicate, relation.object))
            yield relation, relation.predicate == how.strong


def _yaw(camera_to_world: Any) -> float:
    """Which way a camera looks over the floor."""
    return round(math.atan2(float(camera_to_world[1][2]), float(camera_to_world[0][2])), _DIGITS)


def _rounded(numbers: tuple[float, ...]) -> list[float]:
    return [round(float(n), _DIGITS) for n in numbers]
