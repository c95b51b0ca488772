"""The annotation file of a PDDL domain: what PDDL cannot say, put into the tables that it gives.

Called by `pddl_in`; calls `formula`. It names things as this project does: lower case, "_" for "-".
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from forestall.domain.formula import parse_formula, show
from forestall.domain.load import ATTRIBUTE_FIELDS, CATEGORY_FIELDS, PREDICATE_FIELDS
from forestall.domain.located import keyed, located
from forestall.domain.phrases import table as as_table
from forestall.errors import InputError, UnknownNameError
from forestall.reading.documents import parse_toml


def _but(names: Iterable[str], *given_by_pddl: str) -> tuple[str, ...]:
    return tuple(n for n in names if n not in given_by_pddl)


_FIELDS = {
    "predicates": _but(PREDICATE_FIELDS, "kind", "parameters", "definition", "paired"),
    "attributes": ATTRIBUTE_FIELDS,
    "categories": (*_but(CATEGORY_FIELDS, "attributes", "defaults"), "world"),
    "skills": ("at", "done_when", "drives", "duration_s", "family", "hand", "prefers", "refusals",
               "says", "undoes", "words"),
}  # fmt: skip
_WHOLE = ("name", "processes", "robot", "roles", "run", "safety", "tags")


@dataclass(frozen=True, slots=True)
class Notes:
    """The tables of an annotation file.

    Args:
        tables: as the file has them.
        values: attribute → value → the predicate that says it, "" for the value otherwise.
    """

    tables: Mapping[str, Any]
    values: dict[str, dict[str, str]]

    @classmethod
    def parse(cls, text: str, source: str) -> Notes:
        """Read the text of the file.

        Raises:
            FileFormatError: no TOML.
            DomainError: an unknown field, or an attribute whose values are not given.
        """
        tables = parse_toml(text, source)
        try:
            _fields("annotations", tables, (*_WHOLE, *_FIELDS))
            for section, known in _FIELDS.items():
                for name, given in as_table(section, tables.get(section, {})).items():
                    label = f"annotations: {section}.{name}"
                    _fields(label, as_table(label, given), known)
            values = {
                name: _values(name, table) for name, table in tables.get("attributes", {}).items()
            }
        except InputError as error:
            raise located(source, text, error) from error
        return cls(tables, values)

    def put_into(self, data: Mapping[str, Any]) -> dict[str, Any]:
        """The tables of the PDDL file with these put in.

        Raises:
            InputError: something is annotated that the PDDL file does not have.
        """
        merged = deepcopy(dict(data))
        for key in _WHOLE:
            if key == "tags":
                merged[key] = [*dict.fromkeys((*merged[key], *self.tables.get(key, ())))]
            elif isinstance(self.tables.get(key), Mapping):
                merged[key] = {**merged.get(key, {}), **self.tables[key]}
            elif key in self.tables:
                merged[key] = self.tables[key]
        for section in _FIELDS:
            for name, given in self.tables.get(section, {}).items():
                if name not in merged[section]:
                    error = UnknownNameError(
                        f"name in the annotations of {section}", name, merged[section]
                    )
                    raise keyed(error, f"[{section}.{name}")
                target = merged[section][name]
                for key, value in given.items():
                    if key == "refusals":
                        _refusals(name, target["needs"], as_table(f"refusals of {name}", value))
                    elif key == "tags":
                        target[key] = [*target[key], *value]
                    elif key != "values":
                        target[key] = value
        return merged


def _values(name: str, table: Mapping[str, Any]) -> dict[str, str]:
    given = as_table(f"attribute {name}: values", table.get("values"))
    otherwise = [v for v, p in given.items() if p == ""]
    fits = all(isinstance(p, str) for p in given.values()) and len(given) > 1
    if not fits or len(otherwise) > (len(given) == 2):
        raise keyed(
            InputError(
                f"attribute {name}: values must name a predicate for each value, the default "
                'first; of two values one may be "": values = { off = "", on = "lit" }'
            ),
            f"[attributes.{name}",
        )
    return dict(given)


def _refusals(skill: str, needs: list[dict[str, Any]], given: Mapping[str, Any]) -> None:
    facts = {str(n["fact"]): n for n in needs}
    for text, sentence in given.items():
        fact = show(parse_formula(text))
        if fact not in facts:
            error = UnknownNameError(f"need in the refusals of skill {skill}", fact, facts)
            raise keyed(error, f"[skills.{skill}")
        if not isinstance(sentence, str):
            raise keyed(
                InputError(f"skill {skill}: the refusal for {fact} must be a text"),
                f"[skills.{skill}",
            )
        facts[fact]["else"] = sentence


def _fields(label: str, table: Mapping[str, Any], known: Iterable[str]) -> None:
    known = tuple(known)
    for key in table:
        if key not in known:
            raise keyed(UnknownNameError(f"field of {label}", key, known), key)
