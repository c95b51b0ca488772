"""The kitchen's own catalogue: categories, their attributes, and which thing goes where.

Read from `catalogue.toml`. It is the truth of the embedded household and is written apart from the
household domain, which tests hold against it. Categories that a task file adds come from its
domain, where they are described once.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from typing import Any

from forestall.domain.model import Domain
from forestall.domain.schema import Category as Described
from forestall.errors import InputError, UnknownNameError
from forestall.types.facts import category_of

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

_ANY_SIZE_M = [0.08, 0.08, 0.08]
_LARGEST_M = 3.0
"""No thing that a task file brings is larger: a room has three to six metres."""


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
    words: str = ""  # how a person calls it, where its name does not say so

    @property
    def spoken(self) -> str:
        """The category in words: "remote control"."""
        return self.words or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", self.name).lower()

    @property
    def washable_food(self) -> bool:
        """Whether running water does it no harm: whole food, unless it soaks."""
        return not self.soaks and (self.slices_into is not None or self.cracks_into is not None)


@dataclass(frozen=True, slots=True)
class Catalogue:
    """Every category by name, every attribute with its values, the default first."""

    categories: Mapping[str, Category] = field(hash=False)
    attributes: Mapping[str, tuple[str, ...]] = field(hash=False)
    own: frozenset[str] = frozenset()  # attributes that skills of the household know

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
        states = {a: self.attributes[a][0] for a in category.attributes}
        return states | dict(category.defaults)

    def values(self, attribute: str) -> tuple[str, ...]:
        """Every value of an attribute, the default first.

        Raises:
            UnknownNameError: no such attribute.
        """
        found = self.attributes.get(attribute)
        if found is None:
            raise UnknownNameError("attribute", attribute, self.attributes)
        return found

    @property
    def lasting(self) -> tuple[str, ...]:
        """Attributes that slices, and what is cracked, take over from what they are made of.

        Among them are those of task files: no skill changes them.
        """
        return ("temperature", "cooked", *(a for a in self.attributes if a not in self.own))

    def encloses(self, name: str) -> bool:
        """Whether contents cannot be seen or reached while it is closed."""
        category = self[name]
        return (
            category.receptacle is not None
            and category.receptacle.relation == "inside"
            and "open" in category.attributes
        )


@cache
def shipped_catalogue() -> Catalogue:
    """What the kitchen knows without any task file."""
    text = files("forestall.worlds.kitchen").joinpath("catalogue.toml").read_text(encoding="utf-8")
    tables = tomllib.loads(text)
    attributes = {name: tuple(t["values"]) for name, t in tables["attributes"].items()}
    categories = {name: _category(name, t) for name, t in tables["categories"].items()}
    return Catalogue(categories, attributes, frozenset(attributes))


def lacking(domain: Domain) -> tuple[str, ...]:
    """Attributes and relations of the kitchen's things that a domain lacks, sorted.

    The kitchen simulates no domain that lacks one: it could not say how its things are.
    """
    own = shipped_catalogue()
    relations = {c.receptacle.relation for c in own.categories.values() if c.receptacle}
    return tuple(
        sorted((own.own - domain.attributes.keys()) | (relations - domain.relations.keys()))
    )


def catalogue(domain: Domain) -> Catalogue:
    """The kitchen's catalogue with what a task file added to its domain.

    Raises:
        InputError: a domain that the kitchen does not simulate, or a shape that it cannot build.
    """
    own = shipped_catalogue()
    if missing := lacking(domain):
        raise InputError(
            f"the world kitchen does not simulate the domain {domain.name}, which has no "
            f"{', '.join(missing)}: leave the world out, or say another one "
            '(--world symbolic; world = "symbolic" in the table [run] of the domain file)'
        )
    attributes = {n: own.attributes.get(n, a.values) for n, a in domain.attributes.items()}
    categories = dict(own.categories)
    for name, described in domain.categories.items():
        known = own.categories.get(name)
        if known is None:
            categories[name] = _added(domain, described)
            continue
        categories[name] = _more(known, described, _added(domain, described))
    found = Catalogue(categories, attributes, own.own)
    for place, thing in sorted(domain.statics.get("accepts", ())):
        if not found.accepts(place, thing):
            fits = (*categories[thing].fits, place)
            categories[thing] = replace(categories[thing], fits=fits)
    return Catalogue(categories, attributes, own.own)


def _category(name: str, table: Mapping[str, Any]) -> Category:
    fields: dict[str, Any] = _tuples(table)
    receptacle, device = fields.pop("receptacle", None), fields.pop("device", None)
    defaults = tuple(sorted(fields.pop("defaults", {}).items()))
    return Category(
        name=name,
        defaults=defaults,
        receptacle=None if receptacle is None else Receptacle(**_tuples(receptacle)),
        device=None if device is None else Device(**_tuples(device)),
        **fields,
    )


def _tuples(table: Mapping[str, Any]) -> dict[str, Any]:
    return {k: tuple(v) if isinstance(v, list) else v for k, v in table.items()}


def _more(known: Category, described: Described, told: Category) -> Category:
    """A category of the kitchen with what a task file added to its description."""
    flags = ("pickupable", "fixture", "food", "soaks", "drains", "fragile")
    numbers, receptacle = dict(described.numbers), known.receptacle or told.receptacle
    if receptacle is not None and "capacity" in numbers:
        receptacle = replace(receptacle, capacity=numbers["capacity"])
    own = {"shape"} & described.extra.keys() or described.size_m != _size(known)
    return replace(
        known,
        **{f: getattr(known, f) or getattr(told, f) for f in flags},
        attributes=tuple(dict.fromkeys((*known.attributes, *told.attributes))),
        defaults=tuple(sorted((dict(known.defaults) | dict(told.defaults)).items())),
        aliases=tuple(dict.fromkeys((*known.aliases, *told.aliases))),
        receptacle=receptacle,
        slices=numbers.get("slices", known.slices),
        shape={**known.shape, **told.shape} if own else known.shape,
    )


def _size(known: Category) -> tuple[float, ...]:
    return tuple(known.shape.get("size_m", ()))


def _added(domain: Domain, described: Described) -> Category:
    """A category that only the domain knows: its tags and static facts say what it is."""
    name, tags, numbers = described.name, described.tags, dict(described.numbers)
    shape = described.extra.get("shape", {})
    kind = shape.get("kind", SHAPES[0]) if isinstance(shape, Mapping) else None
    if kind not in SHAPES:
        raise UnknownNameError(f"shape of {name}", str(kind), SHAPES)
    if not isinstance(shape, Mapping):
        raise InputError(f"category {name}: world.shape must be a table")
    if described.size_m:
        shape = {**shape, "size_m": list(described.size_m)}
    _check_size(name, shape.get("size_m", _ANY_SIZE_M))

    def related(predicate: str) -> tuple[str, ...]:
        facts = domain.statics.get(predicate, frozenset())
        return tuple(sorted(b for a, b in facts if a == name))

    relation = domain.offers(name)
    takers = {p for p, x in domain.statics.get("accepts", ()) if x == name}
    return Category(
        name=name,
        attributes=described.attributes,
        pickupable="pickupable" in tags,
        fixture="fixture" in tags,
        receptacle=None
        if relation is None
        else Receptacle(relation, related("accepts"), (), numbers.get("capacity")),
        device=_device(tags, related),
        food="food" in tags,
        soaks="soaks" in tags,
        slices=numbers.get("slices", 3),
        slices_into=next(iter(related("slices_into")), None),
        cracks_into=next(iter(related("cracks_into")), None),
        drains="drains" in tags,
        controls=next(iter(related("controls")), None),
        fragile="fragile" in tags,
        fits=tuple(sorted(takers)),
        shape=shape,
        defaults=described.defaults,
        aliases=described.aliases,
        words=described.words,
    )


def _check_size(name: str, size_m: Any) -> None:
    edges = size_m if isinstance(size_m, list) else []
    if len(edges) != 3 or not all(type(e) in (int, float) and 0 < e <= _LARGEST_M for e in edges):
        raise InputError(
            f"category {name}: size_m is width, depth and height in metres, each at most "
            f"{_LARGEST_M:g}, got {size_m!r:.60}"
        )


def _device(tags: frozenset[str], related: Callable[[str], tuple[str, ...]]) -> Device | None:
    works: tuple[str, ...] = (
        "cleans",
        "heats",
        "cools",
        "cooks",
        "brews",
        "needs_closed",
        "shut_while_on",
    )
    if not tags & {*works, "runs_water", "remote_controlled"}:
        return None
    flags: dict[str, Any] = {work: work in tags for work in works}
    return Device(
        acts_on=next(iter(related("serves")), None),
        fills="water" if "runs_water" in tags else "coffee" if "brews" in tags else None,
        cooks_not=related("only_warms"),
        always="cools" in tags,
        needs_held="RemoteControl" if "remote_controlled" in tags else None,
        **flags,
    )
