"""Scene graphs in the short form in which a person writes them.

    {"objects": {"peg-1": {"grade": "fine"}, "hole-2": {}, "gripper": {}},
     "relations": [["peg-1", "held_by", "gripper"], "hole-2 part_of plate-1"],
     "unseen": ["plate-1"], "hidden": ["box-1"]}

Called wherever a caller may hand over a scene; calls `graph`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from forestall.errors import InputError, UnknownNameError
from forestall.types.facts import GRIPPER, category_of
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph, Seen

KEYS = ("objects", "relations", "unseen", "hidden")
_RELATION = 3


def scene_graph(data: SceneGraph | Mapping[str, Any]) -> SceneGraph:
    """A scene graph from its short form, its JSON form, or itself.

    Args:
        data: "objects": id → category, or a table of "category" (that of the id by default),
            "box" ([low, high], metres) and states (word, or true and false for yes and no);
            or a list of ids. "relations": [subject, relation, object], or the three words in one
            string; "gripper" needs no object of its own. "unseen": ids that are known and in no
            view. "hidden": ids of containers whose inside nobody can see.

    Raises:
        InputError: something that cannot be read, with its place.
    """
    if isinstance(data, SceneGraph):
        return data
    if not isinstance(data, Mapping):
        raise InputError(f"a scene is a mapping with {', '.join(KEYS)}, not {type(data).__name__}")
    if "nodes" in data:
        return SceneGraph.from_json(dict(data))
    for key in data:
        if key not in KEYS:
            raise UnknownNameError("entry of a scene", str(key), KEYS)
    if "objects" not in data:
        raise InputError('a scene without \'objects\': write {"objects": {"cup-1": {}}}')
    objects = data["objects"]
    if not isinstance(objects, Mapping):
        objects = {str(name): {} for name in _listed("objects", objects)}
    unseen = {str(x) for x in _listed("unseen", data.get("unseen", ()))}
    for name, said in objects.items():
        _no_relation(str(name), said, {*map(str, objects), GRIPPER})
    nodes = {str(n): _node(str(n), said, str(n) in unseen) for n, said in objects.items()}
    relations = [_relation(r) for r in _listed("relations", data.get("relations", ()))]
    if any(GRIPPER in (r.subject, r.object) for r in relations):
        nodes.setdefault(GRIPPER, ObjectNode(GRIPPER, GRIPPER))
    known = ", ".join(nodes) or "none"
    for name in sorted(unseen - nodes.keys()):
        raise InputError(f"unseen: {name!r} is not among the objects: {known}")
    hidden = tuple(str(x) for x in _listed("hidden", data.get("hidden", ())))
    return SceneGraph(tuple(nodes.values()), tuple(relations), None, hidden)


def word(text: object, what: str) -> str:
    """A name of a relation, an attribute or a value as facts spell it: "Part of" → "part_of".

    Raises:
        InputError: no letter or digit is in it.
    """
    plain = re.sub(r"\W+", "_", str(text).strip()).strip("_")
    if not plain:
        raise InputError(f"{what} {text!r} has no letter in it")
    return plain.lower() if plain[0].isalpha() or plain[0] == "_" else f"_{plain.lower()}"


def _listed(key: str, value: Any) -> Iterable[Any]:
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        raise InputError(f"{key} of a scene is a list, not {value!r}")
    return value


def _node(name: str, said: Any, unseen: bool) -> ObjectNode:
    if isinstance(said, str):
        said = {"category": said}
    if not isinstance(said, Mapping):
        raise InputError(
            f"object {name!r}: a category or a table of states is expected, not {said!r}"
        )
    if not name.strip():
        raise InputError("an object has an empty id")
    table = dict(said)
    category = str(table.pop("category", category_of(name)))
    box = table.pop("box", None)
    located = None if box is None else _box(name, box)
    return ObjectNode(
        name,
        category,
        tuple((word(a, "attribute"), _value(name, a, v)) for a, v in table.items()),
        None if located is None else located.centre,
        located,
        Seen.UNOBSERVED if unseen else Seen.VISIBLE,
    )


def _no_relation(name: str, said: Any, ids: Iterable[str]) -> None:
    """See that nothing is said of a thing where its category or a state is expected.

    Raises:
        InputError: a text that names another thing, or a fact.
    """
    if isinstance(said, str):
        words = said.split()
        others = [w for w in words[1:] if w in ids]
        if others:
            relation = "_".join(w for w in words if w not in ids) or "relation"
            raise InputError(
                f"object {name!r}: {said!r} stands in the place of its category and is a relation: "
                f'write ["{name}", "{relation}", "{others[-1]}"] among the relations'
            )
        if re.search(r"[=():]", said):
            raise InputError(
                f"object {name!r}: {said!r} stands in the place of its category and is a state: "
                f'write "{name}": {{"attribute": "value"}}'
            )
    elif isinstance(said, Mapping):
        for attribute, value in said.items():
            if attribute != "category" and isinstance(value, str) and value in ids:
                raise InputError(
                    f"object {name!r}: {attribute} is said to be {value!r}, which is a thing: "
                    f'write ["{name}", "{word(attribute, "relation")}", "{value}"] among the '
                    "relations"
                )


def _value(name: str, attribute: object, value: Any) -> str | None:
    if value is None:
        return None
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return word(value, "value")
    raise InputError(
        f"object {name!r}: {attribute} is {value!r}; a state is a word, true or false "
        '(bin numbers: "low", "high")'
    )


def _box(name: str, box: Any) -> Box:
    try:
        (a, b, c), (d, e, f) = box
        return Box((float(a), float(b), float(c)), (float(d), float(e), float(f)))
    except (TypeError, ValueError) as error:
        raise InputError(
            f"object {name!r}: box {box!r} is not [[x, y, z], [x, y, z]] in metres"
        ) from error


def _relation(said: Any) -> Relation:
    parts = said.split() if isinstance(said, str) else said
    if not isinstance(parts, list | tuple) or len(parts) != _RELATION:
        raise InputError(f"relation {said!r}: write [subject, relation, object]")
    subject, predicate, target = (str(p) for p in parts)
    return Relation(subject, word(predicate, "relation"), target)
