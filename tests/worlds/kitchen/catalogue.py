"""The categories of the domain file held against the catalogue that the kitchen's rules read.

Used by `test_domain_covers` and `mutate_domain`. Both say for themselves what a mug is; this sees
that they say the same: attributes, values, defaults, names, what takes what and how many, and what
each tag of the domain file stands for in the catalogue.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from mutants import Mutant

from forestall.domain.model import Domain
from forestall.worlds.kitchen.catalogue import Catalogue, Category, Receptacle
from forestall.worlds.kitchen.skills import KNIFE


def _shape(category: Category) -> Receptacle:
    return category.receptacle or Receptacle("", ())


def _device(category: Category, field: str) -> Any:
    return getattr(category.device, field) if category.device is not None else None


TAGS: Mapping[str, Callable[[Category], bool]] = {
    "pickupable": lambda c: c.pickupable,
    "fixture": lambda c: c.fixture,
    "food": lambda c: c.food,
    "soaks": lambda c: c.soaks,
    "washable": lambda c: c.food and c.washable_food,
    "drains": lambda c: c.drains,
    "fragile": lambda c: c.fragile,
    "sliceable": lambda c: c.slices_into is not None,
    "crackable": lambda c: c.cracks_into is not None,
    "cuts": lambda c: c.name == KNIFE,
    "takes_inside": lambda c: _shape(c).relation == "inside",
    "takes_on_top": lambda c: _shape(c).relation == "on_top_of",
    "limited": lambda c: _shape(c).capacity is not None,
    "encloses": lambda c: _shape(c).relation == "inside" and "open" in c.attributes,
    "support": lambda c: c.fixture and _shape(c).relation == "on_top_of" and not _shape(c).capacity,
    "worktop": lambda c: c.name == "CounterTop",
    "tabletop": lambda c: c.name == "DiningTable",
    "ground": lambda c: c.name == "Floor",
    "refuse": lambda c: c.name == "GarbageCan",
    "runs_water": lambda c: _device(c, "fills") == "water",
    "cleans": lambda c: bool(_device(c, "cleans")),
    "heats": lambda c: bool(_device(c, "heats")),
    "cools": lambda c: bool(_device(c, "cools") and _device(c, "always")),
    "cooks": lambda c: bool(_device(c, "cooks")),
    "brews": lambda c: bool(_device(c, "brews") and _device(c, "fills") == "coffee"),
    "needs_closed": lambda c: bool(_device(c, "needs_closed")),
    "shut_while_on": lambda c: bool(_device(c, "shut_while_on")),
    "crowded": lambda c: c.name in ("Cabinet", "Drawer", "Fridge", "GarbageCan", "Sink"),
    "vacatable": lambda c: (
        c.receptacle is not None
        and (c.receptacle.capacity is not None or c.shape.get("kind") in ("dish", "vessel"))
    ),
    "numbered": lambda c: c.name in ("StoveBurner", "StoveKnob"),
    "remote_controlled": lambda c: _device(c, "needs_held") == "RemoteControl",
}
"""Tag → the categories of the catalogue that must carry it."""


def _pairs(vocabulary: Catalogue) -> dict[str, set[tuple[str, str]]]:
    """Every static relation as the catalogue has it."""
    every = vocabulary.categories
    one: dict[str, Callable[[Category], Any]] = {
        "slices_into": lambda c: c.slices_into,
        "cracks_into": lambda c: c.cracks_into,
        "controls": lambda c: c.controls,
        "serves": lambda c: _device(c, "acts_on"),
    }
    found = {p: {(n, other) for n, c in every.items() if (other := of(c))} for p, of in one.items()}
    found["accepts"] = {(a, b) for a in every for b in every if vocabulary.accepts(a, b)}
    found["only_warms"] = {(n, x) for n, c in every.items() for x in _device(c, "cooks_not") or ()}
    return found


def differences(domain: Domain, vocabulary: Catalogue) -> Iterator[str]:
    """What the domain file says otherwise than the catalogue."""
    if set(domain.categories) != set(vocabulary.categories):
        yield f"categories: {set(domain.categories) ^ set(vocabulary.categories)}"
        return
    if set(domain.tags) != set(TAGS):
        yield f"tags: {set(domain.tags) ^ set(TAGS)}"
    for name, theirs in vocabulary.categories.items():
        yield from _of_category(domain, name, theirs)
        if domain.default_states(name) != vocabulary.default_states(name):
            yield f"{name}: defaults {domain.default_states(name)}"
    for attribute, known in vocabulary.attributes.items():
        mine = domain.attributes.get(attribute)
        if mine is None or mine.values != known:
            yield f"attribute {attribute}: values"
    if set(domain.lasting) != set(vocabulary.lasting):
        yield f"lasting: {domain.lasting}, the catalogue has {vocabulary.lasting}"
    for predicate, pairs in _pairs(vocabulary).items():
        if set(domain.statics.get(predicate, ())) != pairs:
            yield f"{predicate}: {set(domain.statics.get(predicate, ())) ^ pairs}"
    if set(domain.statics) != set(_pairs(vocabulary)):
        yield f"static predicates: {set(domain.statics) ^ set(_pairs(vocabulary))}"


def _of_category(domain: Domain, name: str, theirs: Category) -> Iterator[str]:
    ours = domain.categories[name]
    shape = _shape(theirs)
    numbers = {"capacity": shape.capacity, "slices": theirs.slices_into and theirs.slices}
    expected = {
        "attributes": set(theirs.attributes),
        "aliases": set(theirs.aliases),
        "tags": {t for t, holds in TAGS.items() if holds(theirs)},
        "numbers": {k: v for k, v in numbers.items() if v is not None},
    }
    for field, value in expected.items():
        said = getattr(ours, field)
        said = dict(said) if isinstance(value, dict) else said
        said = set(said) if isinstance(value, set) else said
        if said != value:
            yield f"{name}: {field} {said}, the catalogue has {value}"


def lacking(domain: Domain) -> Iterator[Mutant]:
    """The domain without each tag, attribute, default, number, alias and static fact."""
    for name, category in domain.categories.items():
        for field in ("tags", "attributes", "defaults", "numbers", "aliases"):
            several = getattr(category, field)
            for one in sorted(several):
                rest = type(several)(x for x in several if x != one)
                categories = {**domain.categories, name: replace(category, **{field: rest})}
                yield Mutant(f"{name}: {field} {one}", replace(domain, categories=categories))
    for predicate, facts in domain.statics.items():
        for fact in sorted(facts):
            statics = {**domain.statics, predicate: facts - {fact}}
            yield Mutant(f"{predicate}{fact}", replace(domain, statics=statics))
