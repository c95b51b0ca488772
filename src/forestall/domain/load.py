"""Reads a domain file, or what a task adds to one, and checks everything in it.

Called by the registry and by task files; calls `model`, `formula`, `schemas_in`. A file is read
whole or not at all: the first thing that is wrong is named with file, line and the nearest name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from forestall.domain.checks import check_domain, check_roles
from forestall.domain.formula import parse_formula
from forestall.domain.located import keyed, located
from forestall.domain.model import BUILT_IN, Domain
from forestall.domain.phrases import attribute_values, check_apart, check_text, phrase_table, texts
from forestall.domain.phrases import table as as_table
from forestall.domain.schema import Category, Predicate, PredicateKind, Robot, Roles
from forestall.domain.schemas_in import parameter, read_process, read_safety, read_skill
from forestall.domain.shape import check_shape
from forestall.errors import InputError, UnknownNameError
from forestall.reading.documents import MOST_TOML_BYTES, parse_toml
from forestall.reading.files import read_text

_TABLES = (
    "name", "tags", "roles", "robot", "predicates", "attributes", "categories", "events",
    "skills", "processes", "safety", "constants", "spelling", "run",
)  # fmt: skip
_BOTH = ("camera", "mined", "words")
_ATTRIBUTE_ONLY = (
    "values", "phrases", "by_category", "says", "lasting", "bins", "unit", "material",
    "mechanical", "in_hand", "fine", "obscures",
)  # fmt: skip
_AS_IT_IS = ("mined", "unit", "words", "material", "mechanical", "in_hand", "fine", "obscures")

ATTRIBUTE_FIELDS = (*_BOTH, *_ATTRIBUTE_ONLY)
PREDICATE_FIELDS = tuple(
    f.name for f in fields(Predicate) if f.name not in ("name", *_ATTRIBUTE_ONLY)
)
CATEGORY_FIELDS = tuple(
    f.name for f in fields(Category) if f.name not in ("name", "numbers", "extra")
)
"""Fields of the three tables, which the export and the schema take from here; a category has also
numbers, lists for statics, and "world"."""


@cache
def shipped(name: str) -> Domain:
    """A domain that comes with the project.

    Raises:
        UnknownNameError: there is none of this name.
    """
    place = files("forestall").joinpath("domains", name, "domain.toml")
    if not place.is_file():
        raise UnknownNameError("domain", name, shipped_names())
    return read_domain(place.read_text(encoding="utf-8"), f"domains/{name}/domain.toml")


def shipped_names() -> tuple[str, ...]:
    """Names of the domains that come with the project."""
    folder = files("forestall").joinpath("domains")
    return tuple(
        sorted(f.name for f in folder.iterdir() if f.is_dir() and (f / "domain.toml").is_file())
    )


def load_domain(name_or_file: str) -> Domain:
    """A shipped domain by name, or a file (TOML, or PDDL with its annotation file beside it).

    Raises:
        UnknownNameError: no such domain.
        FileFormatError: the file cannot be read.
        DomainError: something in it is wrong.
    """
    if name_or_file.endswith(".pddl"):
        from forestall.domain.pddl_in import load_pddl

        return load_pddl(name_or_file)
    if not name_or_file.endswith(".toml"):
        return shipped(name_or_file)
    text = read_text(Path(name_or_file), "domain file", MOST_TOML_BYTES)
    return read_domain(text, name_or_file)


def read_domain(text: str, source: str) -> Domain:
    """Build a domain from the text of its file.

    Raises:
        FileFormatError: no TOML as `reading` takes it.
        DomainError: something in it is wrong; with its line.
    """
    data = parse_toml(text, source)
    try:
        return build_domain(data)
    except InputError as error:
        raise located(source, text, error) from error


def build_domain(data: Mapping[str, Any]) -> Domain:
    """Build a domain from its tables.

    Raises:
        InputError: something is wrong.
    """
    _known("domain file", data, _TABLES)
    check_shape(data)
    name = data.get("name")
    if not isinstance(name, str) or not name:
        raise InputError("domain file: name must be a text")
    empty = Domain(name, {}, _predicates(data), {}, {}, tuple(data.get("tags", ())))
    domain = extend(empty, data.get("categories", {}), data.get("attributes", {}))
    events = as_table("events", data.get("events", {}))
    skills: dict[str, Any] = {}
    tables = as_table("skills", data.get("skills", {}))
    for skill, given in tables.items():
        table = dict(as_table(f"skill {skill}", given))
        if "like" in table:
            like = table.pop("like")
            if like not in tables:
                raise keyed(UnknownNameError(f"skill that {skill} is like", like, tables), like)
            table.update({k: v for k, v in tables[like].items() if k not in table})
        skills[skill] = _keyed_call(f"[skills.{skill}]", read_skill, skill, table, events, domain)
    domain = replace(
        domain,
        skills=skills,
        processes=tuple(
            _keyed_call(f"[processes.{n}]", read_process, n, t, events, domain)
            for n, t in as_table("processes", data.get("processes", {})).items()
        ),
        safety=tuple(
            _keyed_call(f"[safety.{n}]", read_safety, n, t)
            for n, t in as_table("safety", data.get("safety", {})).items()
        ),
        roles=_record(Roles, "roles", data.get("roles", {})),
        robot=_record(Robot, "robot", data.get("robot", {})),
        constants=_pairs("constants", data),
        spelling=_pairs("spelling", data),
        run=_pairs("run", data),
    )
    check_domain(domain)
    check_roles(domain, as_table("roles", data.get("roles", {})))
    return domain


def extend(domain: Domain, categories: Mapping[str, Any], attributes: Mapping[str, Any]) -> Domain:
    """The domain with further categories and attributes, as task files bring them.

    Raises:
        InputError: a field, tag, attribute, value or category that does not exist.
    """
    check_shape({"categories": categories, "attributes": attributes})
    predicates = dict(domain.predicates)
    for name, table in as_table("attributes", attributes).items():
        predicates[name] = _keyed_call(f"[attributes.{name}", _attribute, name, table, domain)
    domain = replace(domain, predicates=predicates)
    known = dict(domain.categories)
    tables = as_table("categories", categories)
    for name, table in tables.items():
        known[name] = _keyed_call(
            f"[categories.{name}]", _category, name, table, domain, known.get(name)
        )
    domain = replace(domain, categories=known)
    statics = {p: set(domain.statics.get(p, ())) for p in _statics(domain)}
    added = set(known) - set(tables)
    for name, table in tables.items():
        _keyed_call(f"[categories.{name}]", _facts, name, table, domain, statics)
    for name in added:  # "#tag" of an earlier category takes in what is new
        for predicate in statics:
            statics[predicate] |= _open_facts(domain, predicate, name, tables)
    for attribute in domain.attributes.values():
        for category in attribute.by_category:
            if category not in known:
                kind = f"category in by_category of attribute {attribute.name}"
                raise UnknownNameError(kind, category, known)
    return replace(domain, statics={p: frozenset(v) for p, v in statics.items()})


def _open_facts(
    domain: Domain, predicate: str, name: str, new: Mapping[str, Any]
) -> set[tuple[str, ...]]:
    spec = domain.categories[name].extra.get(f"#{predicate}", ())
    assert isinstance(spec, tuple)
    found = chosen(domain, predicate, name, spec)
    return {(name, other) for other in found if other in new}


# --- predicates -----------------------------------------------------------------------------------


def _predicates(data: Mapping[str, Any]) -> dict[str, Predicate]:
    found: dict[str, Predicate] = {}
    for name, table in as_table("predicates", data.get("predicates", {})).items():
        found[name] = _keyed_call(f"[predicates.{name}]", _predicate, name, table)
    return found


def _predicate(name: str, table: Any) -> Predicate:
    label = f"predicate {name}"
    table = dict(as_table(label, table))
    _known(label, table, PREDICATE_FIELDS)
    kinds = {k.value: k for k in PredicateKind if k is not PredicateKind.ATTRIBUTE}
    kind = kinds.get(table.pop("kind", None) or "")
    if kind is None:
        raise InputError(f"{label}: kind must be one of {', '.join(kinds)}")
    if name in BUILT_IN:
        raise InputError(f"{label}: {name!r} is built in: choose another name")
    definition = table.pop("definition", None)
    if (kind is PredicateKind.DERIVED) != (definition is not None):
        raise InputError(f"{label}: a derived predicate, and no other, has a definition")
    return Predicate(
        name,
        kind,
        tuple(parameter(label, p) for p in table.pop("parameters", ())),
        definition=None if definition is None else parse_formula(definition),
        **table,
    )


def _attribute(name: str, table: Any, domain: Domain) -> Predicate:
    """One attribute; of one that exists only phrases can be given."""
    label = f"attribute {name}"
    table = as_table(label, table)
    _known(label, table, ATTRIBUTE_FIELDS)
    base = domain.attributes.get(name)
    if base is None and (name in domain.predicates or name in domain.skills or name in BUILT_IN):
        kind = "skill" if name in domain.skills else "built-in fact"
        if name in domain.predicates:
            kind = domain.predicates[name].kind.value
        raise InputError(f"{label}: {name!r} is the name of a {kind}: choose another one")
    if not re.fullmatch(r"[a-z]+(_[a-z]+)*", name):
        raise InputError(f"{label}: the name must be lower-case letters a-z, joined by '_'")
    values = attribute_values(label, table.get("values", () if base is None else base.values))
    camera = table.get("camera", True if base is None else base.camera)
    if base is not None and (values, camera) != (base.values, base.camera):
        raise InputError(
            f"{label} exists: its values ({', '.join(base.values)}) and camera = "
            f"{str(base.camera).lower()} stay as they are; only phrases can be given"
        )
    phrases = phrase_table(f"{label}: phrases", table.get("phrases", {}), values)
    special = {
        c: phrase_table(f"{label}: by_category.{c}", t, values)
        for c, t in as_table(f"{label}: by_category", table.get("by_category", {})).items()
    }
    if not camera and (phrases or special):
        raise InputError(f"{label}: camera = false, so that it cannot have phrases")
    bins = tuple(float(b) for b in table.get("bins", () if base is None else base.bins))
    if bins and (len(bins) != len(values) or list(bins) != sorted(set(bins))):
        raise InputError(f"{label}: bins must be {len(values)} rising numbers, one for each value")
    if base is not None:
        phrases = {**base.phrases, **phrases}
        for category, given in base.by_category.items():
            special[category] = {**given, **special.get(category, {})}
    check_apart(f"{label}: phrases", phrases)
    for category, given in special.items():
        check_apart(f"{label}: by_category.{category}", {**phrases, **given})
    start = base or Predicate(name, PredicateKind.ATTRIBUTE, (parameter(label, "?thing"),))
    return replace(
        start,
        values=values,
        camera=camera,
        phrases=phrases,
        by_category=special,
        bins=bins,
        says={**start.says, **as_table(f"{label}: says", table.get("says", {}))},
        lasting=table.get("lasting", start.lasting if base else bool(domain.categories)),
        **{k: table[k] for k in _AS_IT_IS if k in table},
    )


# --- categories -----------------------------------------------------------------------------------


def _category(name: str, table: Any, domain: Domain, base: Category | None) -> Category:
    label = f"category {name}"
    table = as_table(label, table)
    statics, inverse = _statics(domain), _inverse(domain)
    numbers = {k: v for k, v in table.items() if isinstance(v, int) and not isinstance(v, bool)}
    for key, value in table.items():
        if isinstance(value, bool) and key in domain.tags:
            raise InputError(f'{label}: {key} is a tag: write tags = ["{key}"]')
    _known(label, table, (*CATEGORY_FIELDS, "world", *statics, *inverse, *numbers))
    tags = _names(label, "tags", table)
    for tag in tags:
        if tag not in domain.tags:
            raise UnknownNameError(f"tag of {name}", tag, domain.tags)
    attributes = _names(label, "attributes", table)
    for attribute in attributes:
        if attribute not in domain.attributes:
            raise UnknownNameError(f"attribute of {name}", attribute, domain.attributes)
    defaults = dict(as_table(f"{label}: defaults", table.get("defaults", {})))
    for attribute, value in defaults.items():
        if attribute not in domain.attributes:
            raise UnknownNameError(f"attribute of {name}", attribute, domain.attributes)
        if value not in domain.values(attribute):
            raise UnknownNameError(f"{attribute} of {name}", value, domain.values(attribute))
    if "words" in table:
        check_text(f"{label}: words", table["words"])
    synonyms = texts(f"{label}: synonyms", table.get("synonyms", ()))
    extra: dict[str, Any] = dict(as_table(f"{label}: world", table.get("world", {})))
    extra |= {f"#{p}": _names(label, p, table) for p in statics if p in table}
    old = base or Category(name)
    return Category(
        name,
        old.tags | set(tags),
        tuple(dict.fromkeys((*old.attributes, *attributes))),
        tuple(sorted((dict(old.defaults) | defaults).items())),
        tuple(sorted((dict(old.numbers) | numbers).items())),
        tuple(dict.fromkeys((*old.aliases, *_names(label, "aliases", table)))),
        table.get("words", old.words),
        tuple(dict.fromkeys((*old.synonyms, *synonyms))),
        tuple(float(x) for x in table.get("size_m", old.size_m)),
        {**old.extra, **extra},
    )


def _facts(
    name: str, table: Mapping[str, Any], domain: Domain, statics: dict[str, set[tuple[str, ...]]]
) -> None:
    for predicate in _statics(domain):
        spec = _names(f"category {name}", predicate, table)
        statics[predicate] |= {(name, x) for x in chosen(domain, predicate, name, spec)}
    for word, predicate in _inverse(domain).items():
        spec = _names(f"category {name}", word, table)
        statics[predicate] |= {(x, name) for x in chosen(domain, word, name, spec)}


def chosen(domain: Domain, predicate: str, name: str, spec: Sequence[str]) -> set[str]:
    """Categories of a category's list: names, "#tag" for all with a tag, "-Name" for all but.

    Raises:
        UnknownNameError: a tag or category that does not exist.
    """
    found: set[str] = set()
    for entry in (e for e in spec if not e.startswith("-")):
        if entry.startswith("#"):
            if entry[1:] not in domain.tags:
                raise UnknownNameError(f"tag in {predicate} of {name}", entry[1:], domain.tags)
            found |= set(domain.tagged(entry[1:])) - {name}
        else:
            found.add(entry)
    found -= {e[1:] for e in spec if e.startswith("-")}
    for entry in (*found, *(e[1:] for e in spec if e.startswith("-"))):
        if entry not in domain.categories:
            raise UnknownNameError(f"category in {predicate} of {name}", entry, domain.categories)
    return found


def _statics(domain: Domain) -> tuple[str, ...]:
    return tuple(p.name for p in domain.predicates.values() if p.kind is PredicateKind.STATIC)


def _inverse(domain: Domain) -> dict[str, str]:
    """How a category says that another has it in its list: "fits" for "accepts"."""
    return {f"{p}_of": p for p in _statics(domain)}


def _names(label: str, key: str, table: Mapping[str, Any]) -> tuple[str, ...]:
    names = table.get(key, ())
    if not isinstance(names, list | tuple) or not all(isinstance(n, str) for n in names):
        raise InputError(f"{label}: {key} must be a list of texts")
    return tuple(names)


# --- helpers --------------------------------------------------------------------------------------


def _record(kind: Any, label: str, data: Any) -> Any:
    table = as_table(label, data)
    _known(label, table, [f.name for f in fields(kind)])
    return kind(**{k: tuple(v) if isinstance(v, list) else v for k, v in table.items()})


def _pairs(key: str, data: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    table = as_table(key, data.get(key, {}))
    for name, value in table.items():
        if not isinstance(value, str):
            raise keyed(InputError(f"{key}: {name} must be a text"), f"[{key}]")
    return tuple(table.items())


def _known(label: str, table: Mapping[str, Any], known: Sequence[str]) -> None:
    for key in table:
        if key not in known:
            raise keyed(UnknownNameError(f"field of {label}", key, known), key)


def _keyed_call(header: str, call: Any, *args: Any) -> Any:
    try:
        return call(*args)
    except InputError as error:
        raise keyed(error, header) from None
