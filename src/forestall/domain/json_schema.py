"""The JSON schema of a domain file, for editors and for whoever writes files with a program.

Called by the command line; calls `model` for what the closed sets are. It says which fields there
are and of which form; whether the names in them mean something is what `load` checks.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from forestall.domain.model import PredicateKind, Roles

Schema = dict[str, Any]

_TEXT: Schema = {"type": "string", "minLength": 1}
_TEXTS: Schema = {"type": "array", "items": {"type": "string"}}
_FLAG: Schema = {"type": "boolean"}
_NUMBER: Schema = {"type": "number"}
_NAMES: Schema = {"type": "object", "additionalProperties": {"type": "string"}}


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
                "robot": _object({"hands": _TEXTS, "skills": _TEXTS}),
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
                            "when": {"type": "string", "description": '"leaving", a skill, or ""'},
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


def _roles() -> Schema:
    lists = {f.name for f in fields(Roles) if isinstance(f.default, tuple)}
    return _object({f.name: _TEXTS if f.name in lists else _TEXT for f in fields(Roles)})


def _predicate() -> Schema:
    kinds = [k.value for k in PredicateKind if k is not PredicateKind.ATTRIBUTE]
    schema = _object(
        {
            "kind": {"enum": kinds},
            "parameters": _ref("parameters"),
            "definition": _ref("formula"),
            "camera": _FLAG,
            "contains": _FLAG,
            "group": _TEXT,
            "scored": _FLAG,
            "lasting": _FLAG,
            "paired": {"enum": ["", "same number", "same number or first"]},
            "mined": _FLAG,
            "words": {"type": "string"},
            "opposite": {"type": "string"},
            "bins": {"type": "array", "items": _NUMBER},
            "unit": {"type": "string"},
        },
        "kind",
    )
    derived = {"properties": {"kind": {"const": PredicateKind.DERIVED.value}}}
    defined = {"required": ["definition"]}
    return {**schema, "if": derived, "then": defined, "else": {"not": defined}}


def _attribute() -> Schema:
    return _object(
        {
            "values": {**_TEXTS, "minItems": 2, "uniqueItems": True},
            "camera": _FLAG,
            "lasting": _FLAG,
            "mined": _FLAG,
            "words": {"type": "string"},
            "bins": {"type": "array", "items": _NUMBER},
            "unit": {"type": "string"},
            "phrases": _ref("phrases"),
            "by_category": {"type": "object", "additionalProperties": _ref("phrases")},
        },
        "values",
    )


def _category() -> Schema:
    return {
        "type": "object",
        "properties": {
            "tags": _TEXTS,
            "attributes": _TEXTS,
            "defaults": _NAMES,
            "aliases": _TEXTS,
            "words": {"type": "string"},
            "synonyms": _TEXTS,
            "world": {"type": "object", "description": "for a world; no other part reads it"},
        },
        "additionalProperties": {
            "anyOf": [{"type": "integer"}, _TEXTS],
            "description": "a number, or what a static predicate (or its <name>_of) holds with",
        },
    }


def _skill() -> Schema:
    return _object(
        {
            "like": {**_TEXT, "description": "a skill whose fields count where this has none"},
            "parameters": _ref("parameters"),
            "choices": {
                "type": "array",
                "items": _object(
                    {
                        "variable": _ref("parameter"),
                        "among": {"type": "array", "items": _ref("formula")},
                        "such_that": _ref("formula"),
                        "only_if": _ref("formula"),
                        "else": _TEXT,
                    },
                    "variable",
                ),
            },
            "needs": _ref("needs"),
            "prefers": {"type": "array", "items": _ref("formula")},
            "effects": _ref("effects"),
            "makes": {
                "type": "array",
                "items": _object(
                    {
                        "variable": _ref("parameter"),
                        "source": _ref("parameter"),
                        "by": _TEXT,
                        "count": {"anyOf": [{"type": "integer", "minimum": 1}, _TEXT]},
                    },
                    "variable",
                    "source",
                    "by",
                ),
            },
            "at": _ref("parameter"),
            "drives": _FLAG,
            "hand": _ref("parameter"),
            "words": {"type": "string"},
            "family": _TEXT,
            "undoes": _ref("fact"),
            "done_when": _ref("formula"),
            "duration_s": {**_NUMBER, "minimum": 0},
        }
    )


def _object(properties: Schema, *required: str) -> Schema:
    found: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    return found | ({"required": list(required)} if required else {})


def _tables(schema: Schema, names: str | None) -> Schema:
    found: Schema = {"type": "object", "additionalProperties": schema}
    return found if names is None else found | {"propertyNames": {"pattern": names}}


def _ref(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}
