"""Ground formulas: true, false, a fact or its opposite as a signed number, and their junctions.

Made by `schemas`, numbered by `ground`; calls nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Junction:
    """All of the parts ("and"), any ("or"), or at least so many of them ("least")."""

    kind: str
    parts: tuple[Node, ...]
    least: int = 0


Node = bool | int | Junction
"""A positive number is a fact, its negative the opposite."""


def all_of(nodes: Iterable[Node]) -> Node:
    """The conjunction, simplified."""
    parts: dict[Node, None] = {}
    for node in nodes:
        if node is True:
            continue
        if node is False:
            return False
        if isinstance(node, Junction) and node.kind == "and":
            for part in node.parts:
                parts[part] = None
        else:
            parts[node] = None
    if len(parts) <= 1:
        return next(iter(parts), True)
    mixed = False
    for part in parts:
        if isinstance(part, Junction):
            mixed = True
        elif -part in parts:
            return False
    if mixed:
        return _resolved(parts)
    return Junction("and", tuple(parts))


def _resolved(parts: dict[Node, None]) -> Node:
    """Disjunctions lose what a fact beside them denies, and go where it affirms them."""
    kept: list[Node] = []
    again = False
    for part in parts:
        if isinstance(part, Junction) and part.kind == "or":
            if any(p in parts for p in part.parts):
                continue
            left = [p for p in part.parts if isinstance(p, Junction) or -p not in parts]
            if len(left) < len(part.parts):
                again = True
                kept.append(any_of(left))
                continue
        kept.append(part)
    if again:
        return all_of(kept)
    return kept[0] if len(kept) == 1 else Junction("and", tuple(kept))


def any_of(nodes: Iterable[Node]) -> Node:
    """The disjunction, simplified."""
    parts: dict[Node, None] = {}
    for node in nodes:
        if node is False:
            continue
        if node is True:
            return True
        if isinstance(node, Junction) and node.kind == "or":
            for part in node.parts:
                parts[part] = None
        else:
            parts[node] = None
    if len(parts) <= 1:
        return next(iter(parts), False)
    for part in parts:
        if not isinstance(part, Junction) and -part in parts:
            return True
    return Junction("or", tuple(parts))


def at_least(count: int, nodes: Iterable[Node]) -> Node:
    """True where so many of the nodes are true."""
    parts = []
    for node in nodes:
        if node is True:
            count -= 1
        elif node is not False:
            parts.append(node)
    if count <= 0:
        return True
    if count > len(parts):
        return False
    if count == len(parts):
        return all_of(parts)
    if count == 1:
        return any_of(parts)
    return Junction("least", tuple(parts), count)


def negate(node: Node) -> Node:
    """The opposite."""
    if node is True or node is False:
        return not node
    if not isinstance(node, Junction):
        return -node
    parts = tuple(negate(p) for p in node.parts)
    if node.kind == "and":
        return any_of(parts)
    if node.kind == "or":
        return all_of(parts)
    return at_least(len(parts) - node.least + 1, parts)


def facts_of(node: Node) -> Iterable[int]:
    """Every signed fact of a node."""
    if isinstance(node, Junction):
        for part in node.parts:
            yield from facts_of(part)
    elif node is not True and node is not False:
        yield node


def assuming(node: Node, known: Callable[[int], bool | None]) -> Node:
    """The node with some facts decided."""
    if isinstance(node, Junction):
        parts = [assuming(p, known) for p in node.parts]
        if node.kind == "and":
            return all_of(parts)
        return any_of(parts) if node.kind == "or" else at_least(node.least, parts)
    if node is True or node is False:
        return node
    found = known(abs(node))
    return node if found is None else found == (node > 0)
