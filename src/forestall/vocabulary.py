"""The household vocabulary: categories, their attributes, and which thing goes where.

Read from `data/vocabulary.toml` and extended by task files. Everything that must know "a mug can
be filled" or "a plate goes into a microwave" asks here: the household, perception (which states to
look for, and the phrases that say how they look), planning (the skill domain) and the checking of
task files.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from typing import Any

from forestall.attributes import (
    THING,
    Attribute,
    check_text,
    parse_attribute,
    texts,
    with_articles,
)
from forestall.errors import InputError, UnknownNameError
from forestall.types.facts import category_of

__all__ = [
    "ATTRIBUTES",
    "SHAPES",
    "Attribute",
    "Category",
    "Device",
    "Receptacle",
    "Vocabulary",
    "household",
    "parse_attribute",
    "parse_category",
]

ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "open": ("closed", "open"),
    "toggled": ("off", "on"),
    "filled": ("empty", "water", "coffee", "wine"),
    "dirty": ("clean", "dirty"),
    "sliced": ("whole", "sliced"),
    "broken": ("intact", "broken"),
    "cooked": ("raw", "cooked"),
    "temperature": ("room", "hot", "cold"),
}
"""Attribute → its values, of the shipped vocabulary; the first is the default of a new object.

Whoever must know the attributes of a task file asks `Vocabulary.attributes`.
"""


SHAPES = (
    "box",
    "bottle",
    "cylinder",
    "dish",
    "egg_cracked",
    "ellipsoid",
    "hinged",
    "knife",
    "plant",
    "slab",
    "vessel",
)
"""Shapes that the household can build from a size."""


_LISTS = ("attributes", "aliases", "fits", "synonyms")
"""Fields of a category that hold names."""


@dataclass(frozen=True, slots=True)
class Receptacle:
    """How a category takes other things.

    Args:
        relation: "inside" or "on_top_of", the relation of its contents to it.
        accepts: categories that it takes; ("*",) takes every pickupable category.
        refuses: categories that it does not take although `accepts` would.
        capacity: how many things fit; None: as long as there is space.
    """

    relation: str
    accepts: tuple[str, ...]
    refuses: tuple[str, ...] = ()
    capacity: int | None = None


@dataclass(frozen=True, slots=True)
class Device:
    """What a thing does to its contents by itself, after every skill, while it is on.

    Args:
        acts_on: category whose contents it works on (same number); None: its own contents.
        fills: liquid that it puts into empty fillable contents.
        cleans: whether it cleans dirty contents.
        heats: whether contents, and what is in them, become hot.
        cools: whether contents, and what is in them, become cold.
        cooks: whether contents, and what is in them, become cooked.
        cooks_only: categories that it cooks; empty: all that can be cooked.
        cooks_not: categories that it heats but does not cook.
        always: it works without being turned on (a fridge), while it is closed.
        brews: brewing into a dirty or filled vessel spoils it.
        needs_closed: it cannot be turned on while open, nor opened while on.
        needs_held: category that must be held to turn it on.
        shut_while_on: nothing goes into it while it is on (a toaster whose lever is down).
    """

    acts_on: str | None = None
    fills: str | None = None
    cleans: bool = False
    heats: bool = False
    cools: bool = False
    cooks: bool = False
    cooks_only: tuple[str, ...] = ()
    cooks_not: tuple[str, ...] = ()
    always: bool = False
    brews: bool = False
    needs_closed: bool = False
    needs_held: str | None = None
    shut_while_on: bool = False


@dataclass(frozen=True, slots=True)
class Category:
    """One category of things.

    `food` marks what can be spoiled by dirt, liquid or company; `soaks` food that running water
    spoils although it is whole (bread); `slices` is how many slices slicing makes.
    """

    name: str
    attributes: tuple[str, ...] = ()
    pickupable: bool = False
    fixture: bool = False
    receptacle: Receptacle | None = None
    device: Device | None = None
    food: bool = False
    soaks: bool = False
    slices: int = 3
    slices_into: str | None = None
    cracks_into: str | None = None
    drains: bool = False  # liquid poured into it is gone
    controls: str | None = None  # a knob: category that it turns on and off, same number
    fragile: bool = False  # breaks when dropped hard
    fits: tuple[str, ...] = ()  # further receptacles that take it, for categories of task files
    shape: Mapping[str, Any] = field(default_factory=dict, hash=False)
    defaults: tuple[tuple[str, str], ...] = ()
    aliases: tuple[str, ...] = ()
    words: str = ""  # how a person calls it
    synonyms: tuple[str, ...] = ()  # other everyday names

    @property
    def spoken(self) -> str:
        """How a person calls it; a category without words goes by its name: "SoupLadle" too."""
        return self.words or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", self.name).lower()

    @property
    def washable_food(self) -> bool:
        """Whether running water does it no harm: whole food, unless it soaks."""
        return not self.soaks and (self.slices_into is not None or self.cracks_into is not None)


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """Every category and every attribute by name."""

    categories: Mapping[str, Category] = field(hash=False)
    attributes: Mapping[str, Attribute] = field(hash=False)

    def __getitem__(self, name: str) -> Category:
        """The category of a category or instance name, aliases included.

        Raises:
            UnknownNameError: no such category.
        """
        found = self.find(name)
        if found is None:
            raise UnknownNameError("object category", category_of(name), self.categories)
        return found

    def find(self, name: str) -> Category | None:
        """Like indexing, but None where there is no such category."""
        return self.categories.get(category_of(self.canonical(name)))

    def canonical(self, name: str) -> str:
        """Replace an alias: "SinkBasin" → "Sink", "SinkBasin-2" → "Sink-2"."""
        head = category_of(name)
        if head in self.categories:
            return name
        for category in self.categories.values():
            if head in category.aliases:
                return category.name + name[len(head) :]
        return name

    def accepts(self, receptacle: str, thing: str) -> bool:
        """Whether a receptacle (name or category) takes a thing (name or category)."""
        r = self[receptacle].receptacle
        item = self[thing]
        if r is None or item.name in r.refuses or item.name == self[receptacle].name:
            return False
        if item.name in r.accepts or self[receptacle].name in item.fits:
            return True
        return "*" in r.accepts and item.pickupable

    def default_states(self, name: str) -> dict[str, str]:
        """Attribute → value of a new object."""
        category = self[name]
        states = {a: self.attributes[a].values[0] for a in category.attributes}
        return states | dict(category.defaults)

    def values(self, attribute: str) -> tuple[str, ...]:
        """Every value of an attribute, the default first.

        Raises:
            UnknownNameError: no such attribute.
        """
        found = self.attributes.get(attribute)
        if found is None:
            raise UnknownNameError("attribute", attribute, self.attributes)
        return found.values

    @property
    def lasting(self) -> tuple[str, ...]:
        """Attributes that slices, and what is cracked, take over from what they are made of.

        Among them are those of task files: no skill changes them.
        """
        return ("temperature", "cooked", *(a for a in self.attributes if a not in ATTRIBUTES))

    def phrases(self, category: str, attribute: str, value: str) -> tuple[str, ...]:
        """Texts that fit a picture of a thing (name or category) whose attribute has a value.

        The plainest comes first. None for an attribute that no camera can see; for a value that
        has no phrases of its own, "a <value> <thing>".

        Raises:
            UnknownNameError: no such category, attribute or value.
        """
        thing = self[category]
        if value not in self.values(attribute):
            raise UnknownNameError(f"value of {attribute}", value, self.values(attribute))
        kind = self.attributes[attribute]
        if not kind.camera:
            return ()
        texts = kind.by_category.get(thing.name, {}).get(value) or kind.phrases.get(value)
        texts = texts or (f"a {value.replace('_', ' ')} {THING}",)
        return tuple(with_articles(t.replace(THING, thing.spoken)) for t in texts)

    def encloses(self, name: str) -> bool:
        """Whether contents cannot be seen or reached while it is closed."""
        category = self[name]
        return (
            category.receptacle is not None
            and category.receptacle.relation == "inside"
            and "open" in category.attributes
        )

    def extended(
        self,
        categories: Mapping[str, Category],
        attributes: Mapping[str, Attribute] | None = None,
    ) -> Vocabulary:
        """This vocabulary with further categories and attributes.

        New pickupable categories are taken wherever "*" is accepted.

        Raises:
            InputError: phrases are given for a category that does not exist.
        """
        found = Vocabulary(
            {**self.categories, **categories}, {**self.attributes, **(attributes or {})}
        )
        for attribute in found.attributes.values():
            for category in attribute.by_category:
                if category not in found.categories:
                    kind = f"category in by_category of attribute {attribute.name}"
                    raise UnknownNameError(kind, category, found.categories)
        return found


def parse_category(
    name: str,
    data: Mapping[str, Any],
    attributes: Mapping[str, tuple[str, ...]] = ATTRIBUTES,
    base: Category | None = None,
) -> Category:
    """Build one category from its TOML table.

    Args:
        name: name of the category.
        data: its table.
        attributes: every attribute with its values.
        base: what the category is so far: lists and defaults are added to, other fields replaced.

    Raises:
        InputError: an unknown field, attribute or value, or words that no encoder can read.
    """
    fields = dict(data)
    _check_names(name, fields, attributes)
    defaults = tuple(sorted(fields.pop("defaults", {}).items()))
    receptacle = fields.pop("receptacle", None)
    if receptacle is not None:
        receptacle = Receptacle(
            relation=receptacle["relation"],
            accepts=tuple(receptacle["accepts"]),
            refuses=tuple(receptacle.get("refuses", ())),
            capacity=receptacle.get("capacity"),
        )
        if receptacle.relation not in ("inside", "on_top_of"):
            raise UnknownNameError(
                f"relation of {name}", receptacle.relation, ("inside", "on_top_of")
            )
    device = fields.pop("device", None)
    if device is not None:
        unknown = set(device) - set(Device.__dataclass_fields__)
        if unknown:
            raise InputError(f"device of {name}: unknown field {', '.join(sorted(unknown))}")
        values: dict[str, Any] = {
            k: tuple(v) if isinstance(v, list) else v for k, v in device.items()
        }
        device = Device(**values)
    kind = fields.get("shape", {}).get("kind", SHAPES[0])
    if kind not in SHAPES:
        raise UnknownNameError(f"shape of {name}", kind, SHAPES)
    lists: dict[str, Any] = {k: tuple(fields.pop(k)) for k in _LISTS if k in fields}
    if base is None:
        return Category(
            name=name, defaults=defaults, receptacle=receptacle, device=device, **lists, **fields
        )
    fields |= {k: tuple(dict.fromkeys(getattr(base, k) + v)) for k, v in lists.items()}
    fields["defaults"] = tuple(sorted((dict(base.defaults) | dict(defaults)).items()))
    fields |= {k: v for k, v in (("receptacle", receptacle), ("device", device)) if v is not None}
    return replace(base, **fields)


def _check_names(
    name: str, fields: Mapping[str, Any], attributes: Mapping[str, tuple[str, ...]]
) -> None:
    """Check the fields of a category that are names, words and flags."""
    unknown = set(fields) - set(Category.__dataclass_fields__) | set(fields) & {"name"}
    if unknown:
        raise InputError(f"category {name}: unknown field {', '.join(sorted(unknown))}")
    for key in _LISTS:
        names = fields.get(key, ())
        if not isinstance(names, list | tuple) or not all(isinstance(n, str) for n in names):
            raise InputError(f"category {name}: {key} must be a list of texts")
    for attribute in fields.get("attributes", ()):
        if attribute not in attributes:
            raise UnknownNameError(f"attribute of {name}", attribute, attributes)
    for attribute, value in sorted(fields.get("defaults", {}).items()):
        if value not in attributes.get(attribute, ()):
            raise UnknownNameError(f"{attribute} of {name}", value, attributes.get(attribute, ()))
    if fields.get("words"):
        check_text(f"category {name}: words", fields["words"])
    texts(f"category {name}: synonyms", fields.get("synonyms", ()))
    for flag in ("pickupable", "fixture", "food", "soaks", "drains", "fragile"):
        if not isinstance(fields.get(flag, False), bool):
            raise InputError(f"category {name}: {flag} must be true or false")


@cache
def household() -> Vocabulary:
    """The vocabulary that the project ships."""
    text = files("forestall").joinpath("data/vocabulary.toml").read_text(encoding="utf-8")
    tables = tomllib.loads(text)
    return Vocabulary({}, {}).extended(
        {name: parse_category(name, table) for name, table in tables["categories"].items()},
        {name: parse_attribute(name, table) for name, table in tables["attributes"].items()},
    )
