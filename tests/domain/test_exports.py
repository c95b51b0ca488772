"""A domain in other forms: a TOML file that loads back equal, words, and the schema of its file."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import fields, replace
from importlib.resources import files
from typing import Any

import pytest
from pddl_corpus import FOLDER, NAMES

from forestall.domain.formula import Parameter, parse_formula
from forestall.domain.json_schema import domain_schema
from forestall.domain.load import (
    ATTRIBUTE_FIELDS,
    CATEGORY_FIELDS,
    PREDICATE_FIELDS,
    build_domain,
    extend,
    load_domain,
    read_domain,
    shipped,
    shipped_names,
)
from forestall.domain.schema import Category, Predicate, PredicateKind, Skill
from forestall.domain.schemas_in import SKILL_FIELDS
from forestall.domain.sheet import skill_sheet, skill_words, words_of
from forestall.domain.toml_out import domain_toml
from forestall.types.facts import Literal

HOUSEHOLD = files("forestall").joinpath("domains", "household", "domain.toml").read_text()


@pytest.mark.parametrize("name", shipped_names())
def test_shipped_domains_as_toml_load_back_equal(name: str) -> None:
    text = domain_toml(shipped(name))
    again = read_domain(text, "again.toml")
    assert again == shipped(name)
    assert domain_toml(again) == text
    assert errors_of(tomllib.loads(text)) == []


OTHER: dict[str, Callable[[Any], Any]] = {
    "bool": lambda old: not old,
    "float": lambda _: 2.5,
    "str": lambda _: "x",
    "str | None": lambda _: "x",
    "tuple[str, ...]": lambda _: ("x", "y"),
    "tuple[float, ...]": lambda _: (0.5, 2.0),
    "Mapping[str, str]": lambda _: {"off": "x"},
}
"""Type of a field -> another value than the one that it has."""

TAGGED = ("fixture", "movable", "support", "ground", "encloses", "crowded", "vacatable", "numbered")


def test_no_field_is_forgotten() -> None:
    """Each field, new ones too, is given another value, written, read and found again."""

    def changed(part: Any, names: tuple[str, ...], **given: Any) -> Any:
        types = {f.name: str(f.type) for f in fields(part) if f.name not in given}
        plain = {n: OTHER[types[n]](getattr(part, n)) for n in names if types.get(n, "") in OTHER}
        return replace(part, **(plain | given))

    domain = shipped("bench")
    relation = changed(
        domain.predicates["seated_in"], PREDICATE_FIELDS,
        group="place", mirrors="threaded_on", geometry="support", offered_by="hole",
        paired="same number", contains=True,
    )  # fmt: skip
    light = Predicate("light", PredicateKind.ATTRIBUTE, (Parameter("?thing"),), ("off", "on"))
    light = changed(light, ATTRIBUTE_FIELDS, values=("off", "on"), camera=False, obscures="on")
    lamp = changed(
        Category("Lamp"), CATEGORY_FIELDS, attributes=("light",), tags=frozenset({"tool"}),
        defaults=(("light", "on"),),
    )  # fmt: skip
    wave = changed(
        Skill("wave", (Parameter("?x"),)), SKILL_FIELDS, at="?x", hand="?x",
        undoes=Literal("light", ("?x",), "on"), done_when=parse_formula("light(?x)=off"),
        prefers=(parse_formula("light(?x)=off"),),
    )  # fmt: skip
    whole = replace(
        domain,
        predicates={**domain.predicates, "seated_in": relation, "light": light},
        categories={**domain.categories, "Lamp": lamp},
        skills={**domain.skills, "wave": wave},
        tags=(*domain.tags, "x", *TAGGED),
        constants=(("lamp", "Lamp"),),
        spelling=(("lamp", "LAMP"),),
        run=(("world", "x"),),
    )
    text = domain_toml(whole)
    assert errors_of(tomllib.loads(text)) == []
    assert read_domain(text, "again.toml") == whole


def test_statics_that_were_given_from_the_other_side_stay() -> None:
    wider = extend(
        shipped("household"),
        {"Basket": {"tags": ["pickupable"], "accepts": ["#food"], "accepts_of": ["Shelf"]}},
        {"ripe": {"values": ["unripe", "ripe"]}},
    )
    again = read_domain(domain_toml(wider), "again.toml")
    assert again == wider and again.static("accepts", "Shelf", "Basket")


@pytest.mark.parametrize("name", NAMES)
def test_pddl_domains_as_toml_load_back_equal(name: str) -> None:
    domain = load_domain(str(FOLDER / f"{name}.pddl"))
    assert read_domain(domain_toml(domain), "again.toml") == domain


def test_texts_with_quotes_and_other_letters_stay() -> None:
    domain = build_domain({
        "name": 'a "quoted" näme',
        "predicates": {"on": {"kind": "relation", "parameters": ["x"], "words": "{0} \\ is\ton"}},
    })  # fmt: skip
    assert read_domain(domain_toml(domain), "again.toml") == domain


# --- words ----------------------------------------------------------------------------------------


def test_the_sheet_says_what_every_skill_takes_needs_and_does() -> None:
    household = shipped("household")
    sheet = skill_sheet(household)
    for skill in household.skills.values():
        assert f"{skill.name}({', '.join(skill.roles)}): {skill.words}\n" in sheet
    said = skill_words(household, household.skill("open_obj"))
    assert said.splitlines() == [
        "open_obj(target): open",
        "  needs:",
        "    - target is something with the state open",
        "    - the place of target is known",
        "    - the hand can come to target",
        "    - target is not marked needs closed or the toggled state of target is not on",
        "  then:",
        "    - the open state of target is open",
        "    - the robot is at target",
    ]
    assert "heat: for every device that is marked heats" in sheet
    assert "never:\n  - the toggled state of tap is on for any tap" in sheet


def test_the_sheet_of_a_pddl_domain() -> None:
    domain = load_domain(str(FOLDER / "briefcase.pddl"))
    assert skill_words(domain, domain.skill("move")).splitlines() == [
        "move(m, l): move",
        "  m is a location",
        "  l is a location",
        "  needs:",
        "    - m is at",
        "    - m is not l",
        "  then:",
        "    - l is at and m is not at",
        "    - for every x that is a portable: x is at l and x is not at m, if before x is in",
    ]


SAID = """\
not some ?x - food: inside(?x, ?p) -> there is no x that is marked food such that x is inside p
every ?x: not inside(?x, ?p) -> for every x: x is not inside p
fewer than 2 of ?x: inside(?x, ?p) -> fewer than 2 things x are such that x is inside p
not fewer than 2 of ?x: inside(?x, ?p) -> at least 2 things x are such that x is inside p
not (inside(?a, ?b) and vacant(?b)) -> a is not inside b or something is in or on b
accepts(?a, ?b) -> a accepts b
true -> always
not Mug(?a) or fragile(?a) -> a is not a mug or a is marked fragile
"""


@pytest.mark.parametrize(("text", "said"), [x.split(" -> ") for x in SAID.splitlines()])
def test_formulas_in_words(text: str, said: str) -> None:
    assert words_of(shipped("household"), parse_formula(text)) == said


# --- schema ---------------------------------------------------------------------------------------


def errors_of(data: Any) -> list[str]:
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(domain_schema())
    return [f"{e.json_path}: {e.message}" for e in validator.iter_errors(data)]


def test_domain_files_fit_the_schema() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator.check_schema(domain_schema())
    for name in shipped_names():
        file = files("forestall").joinpath("domains", name, "domain.toml")
        assert errors_of(tomllib.loads(file.read_text(encoding="utf-8"))) == []
    for name in NAMES:
        text = domain_toml(load_domain(str(FOLDER / f"{name}.pddl")))
        assert errors_of(tomllib.loads(text)) == []


@pytest.mark.parametrize(
    ("path", "value", "place"),
    [
        (("skills", "pick_up", "need"), [], "$.skills.pick_up"),
        (("skills", "Pick"), {}, "$.skills"),
        (("predicates", "inside", "kind"), "relations", "$.predicates.inside.kind"),
        (("predicates", "inside", "definition"), "true", "$.predicates.inside"),
        (("attributes", "open", "values"), ["open"], "$.attributes.open.values"),
        (("robot", "hand"), "left", "$.robot"),
        (("skills", "pick_up", "parameters"), "object", "$.skills.pick_up.parameters"),
        (("safety", "cold_let_out", "never"), None, "$.safety.cold_let_out"),
    ],
)
def test_what_does_not_fit_is_found(path: tuple[str, ...], value: Any, place: str) -> None:
    data = tomllib.loads(HOUSEHOLD)
    at = data
    for key in path[:-1]:
        at = at[key]
    if value is None:
        del at[path[-1]]
    else:
        at[path[-1]] = value
    found = errors_of(data)
    assert found and all(e.startswith(place) for e in found)
