"""The JSON schema of a domain file, for editors and for whoever writes files with a program.

Called by the command line; calls `load` for the fields. It says which fields there are and of
which form; whether the names in them mean something is what `load` checks.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from typing import Any

from forestall.domain.load import ATTRIBUTE_FIELDS, CATEGORY_FIELDS, PREDICATE_FIELDS
from forestall.domain.schema import Category, Predicate, PredicateKind, Roles, Skill
from forestall.domain.schemas_in import SKILL_FIELDS

Schema = dict[str, Any]

_TEXT: Schema = {"type": "string", "minLength": 1}
_TEXTS: Schema = {"type": "array", "items": {"type": "string"}}
_FLAG: Schema = {"type": "boolean"}
_NUMBER: Schema = {"type": "number"}
_NAMES: Schema = {"type": "object", "additionalProperties": {"type": "string"}}
_BY_TYPE: dict[str, Schema] = {
    "str": {"type": "string"},
    "str | None": _TEXT,
    "bool": _FLAG,
    "float": _NUMBER,
    "tuple[str, ...]": _TEXTS,
    "tuple[float, ...]": {"type": "array", "items": _NUMBER},
    "Names": _NAMES,
    "Mapping[str, str]": _NAMES,
}


def domain_schema() -> Schema:
    """The schema of a TOML domain file, read as JSON."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "forestall domain file",
        **_object(
            {
                "name": {**_TEXT, "description": "of the domain"},
                "tags": {**_TEXTS, "description": "every tag that a category may have"},
                "roles": _roles(),
                "robot": _object(
                    {
                        "hands": _TEXTS,
                        "skills": _TEXTS,
                        "speed_m_per_s": {**_NUMBER, "exclusiveMinimum": 0},
                    }
                ),
                "run": {
                    **_NAMES,
                    "description": "kind of part -> the part of a run that says nothing else",
                },
                "constants": {**_NAMES, "description": "thing that every scene has -> category"},
                "spelling": {**_NAMES, "description": "name -> how a PDDL file spells it"},
                "predicates": _tables(_predicate(), r"^[a-z_][a-z0-9_]*$"),
                "attributes": _tables(_attribute(), r"^[a-z]+(_[a-z]+)*$"),
                "categories": _tables(_category(), r"^[A-Za-z_][A-Za-z0-9_]*$"),
                "events": _tables(
                    _object({"parameters": _ref("parameters"), "effects": _ref("effects")}), None
                ),
                "skills": _tables(_skill(), r"^[a-z][a-z0-9_]*$"),
                "processes": _tables(
                    _object(
                        {
                            "parameters": _ref("parameters"),
                            "when": _ref("formula"),
                            "effects": _ref("effects"),
                        }
                    ),
                    None,
                ),
                "safety": _tables(
                    _object(
                        {
                            "never": _ref("formula"),
                            "every": _ref("parameters"),
                            "when": {
                                "type": "string",
                                "description": '"leaving", "skill", "after skill(?x)", or ""',
                            },
                            "else": _TEXT,
                        },
                        "never",
                    ),
                    None,
                ),
            },
            "name",
        ),
        "$defs": _definitions(),
    }


def _definitions() -> Schema:
    return {
        "formula": {**_TEXT, "description": "for example: some ?k - cuts: held_by(?k, gripper)"},
        "fact": {**_TEXT, "description": "p(?x, ?y), not p(?x) or attribute(?x)=value"},
        "parameter": {
            "type": "string",
            "pattern": r"^\s*\??[A-Za-z_]\w*(\s*-\s*[A-Za-z_]\w*)?\s*$",
            "description": "?x, or ?x - kind; a kind is a category, a tag or has_<attribute>",
        },
        "parameters": {"type": "array", "items": _ref("parameter")},
        "effects": {
            "type": "array",
            "items": {
                "anyOf": [
                    _ref("fact"),
                    _object(
                        {
                            "every": _ref("parameters"),
                            "when": _ref("formula"),
                            "then": {"type": "array", "items": _ref("fact")},
                        },
                        "then",
                    ),
                ]
            },
        },
        "needs": {
            "type": "array",
            "items": {
                "anyOf": [
                    _ref("formula"),
                    _object(
                        {
                            "fact": _ref("formula"),
                            "else": {"type": "string", "description": "said where it fails"},
                            "lacks": {"type": "array", "items": _ref("fact")},
                            "find": _ref("formula"),
                        },
                        "fact",
                    ),
                ]
            },
        },
        "phrases": {
            "type": "object",
            "additionalProperties": {**_TEXTS, "minItems": 1},
            "description": "value -> texts that fit a picture of it",
        },
    }


def _of(kind: type, names: Iterable[str], special: Schema, *required: str) -> Schema:
    """The schema of a table that is a dataclass: each field by its type, or as given."""
    types = {f.name: _BY_TYPE.get(str(f.type)) for f in fields(kind)}
    properties = {n: special[n] if n in special else types[n] for n in names}
    missing = [n for n, schema in properties.items() if schema is None]
    assert not missing, f"no schema for {kind.__name__}: {', '.join(missing)}"
    return _object(properties, *required)


def _roles() -> Schema:
    return _of(Roles, [f.name for f in fields(Roles)], {})


def _predicate() -> Schema:
    kinds = [k.value for k in PredicateKind if k is not PredicateKind.ATTRIBUTE]
    special = {
        "kind": {"enum": kinds},
        "parameters": _ref("parameters"),
        "definition": _ref("formula"),
        "geometry": {"enum": ["", "containment", "support"]},
        "paired": {"enum": ["", "same number", "same number or first"]},
    }
    schema = _of(Predicate, PREDICATE_FIELDS, special, "kind")
    derived = {"properties": {"kind": {"const": PredicateKind.DERIVED.value}}}
    defined = {"required": ["definition"]}
    return {**schema, "if": derived, "then": defined, "else": {"not": defined}}


def _attribute() -> Schema:
    special = {
        "values": {**_TEXTS, "minItems": 2, "uniqueItems": True},
        "phrases": _ref("phrases"),
        "by_category": {"type": "object", "additionalProperties": _ref("phrases")},
    }
    return _of(Predicate, ATTRIBUTE_FIELDS, special, "values")


def _category() -> Schema:
    special = {"tags": _TEXTS, "defaults": _NAMES}
    schema = _of(Category, CATEGORY_FIELDS, special)
    schema["properties"]["world"] = {
        "type": "object",
        "description": "for a world; no other part reads it",
    }
    return {
        **schema,
        "additionalProperties": {
            "anyOf": [{"type": "integer"}, _TEXTS],
            "description": "a number, or what a static predicate (or its <name>_of) holds with",
        },
    }


def _skill() -> Schema:
    choice = _object(
        {
            "variable": _ref("parameter"),
            "among": {"type": "array", "items": _ref("formula")},
            "such_that": _ref("formula"),
            "only_if": _ref("formula"),
            "else": _TEXT,
        },
        "variable",
    )
    make = _object(
        {
            "variable": _ref("parameter"),
            "source": _ref("parameter"),
            "by": _TEXT,
            "count": {"anyOf": [{"type": "integer", "minimum": 1}, _TEXT]},
        },
        "variable",
        "source",
        "by",
    )
    special = {
        "parameters": _ref("parameters"),
        "choices": {"type": "array", "items": choice},
        "needs": _ref("needs"),
        "prefers": {"type": "array", "items": _ref("formula")},
        "effects": _ref("effects"),
        "makes": {"type": "array", "items": make},
        "at": _ref("parameter"),
        "hand": _ref("parameter"),
        "family": _TEXT,
        "undoes": _ref("fact"),
        "done_when": _ref("formula"),
        "duration_s": {**_NUMBER, "minimum": 0},
    }
    schema = _of(Skill, SKILL_FIELDS, special)
    schema["properties"]["like"] = {
        **_TEXT,
        "description": "a skill whose fields count where this has none",
    }
    return schema


def _object(properties: Schema, *required: str) -> Schema:
    found: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    return found | ({"required": list(required)} if required else {})


def _tables(schema: Schema, names: str | None) -> Schema:
    found: Schema = {"type": "object", "additionalProperties": schema}
    return found if names is None else found | {"propertyNames": {"pattern": names}}


def _ref(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}
