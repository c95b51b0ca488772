"""Which instance a name in a subtask means, asked of the true household.

Skills call this first. An instance name means itself. A category name means, in this order:

- for what is placed, poured or cracked: the held thing, if it is of the category;
- for a receptacle: one that is accessible and has room for the held thing, where it stands in
  nobody's way before where it does, in reach before out of reach, lowest number first;
- for everything else: accessible before enclosed, unblocked before blocked, in reach before out of
  reach, lowest number first.
"""

from __future__ import annotations

import difflib
from typing import Protocol, runtime_checkable

from forestall.types.facts import category_of, is_instance
from forestall.worlds.kitchen.household import Household, natural_key


@runtime_checkable
class Tidy(Protocol):
    """A world that can tell a good spot from one that is merely free."""

    def has_clear_room(self, thing: str, receptacle: str) -> bool:
        """Whether `thing` finds a spot where it blocks nothing and nothing blocks it."""


class RefusalError(Exception):
    """A need of a skill is not met; its text is the reason."""


def resolve_thing(household: Household, name: str, other_than: str | None = None) -> str:
    """The instance that what is driven to, picked up, cut, opened, switched or filled means."""
    candidates = [n for n in _candidates(household, name) if n != other_than]
    if not candidates:
        raise RefusalError(f"{other_than} cannot go into itself")
    return min(candidates, key=lambda n: _ease(household, n))


def resolve_carried(household: Household, name: str) -> str:
    """The instance that the object of a put, pour or crack means."""
    candidates = _candidates(household, name)
    if household.held in candidates:
        return str(household.held)
    return min(candidates, key=lambda n: _ease(household, n))


def resolve_settled(household: Household, name: str, target: str) -> str | None:
    """A thing that can never be carried and lies at the target already (a cracked egg in a pan)."""
    places = _candidates(household, target)
    for candidate in _candidates(household, name):
        if not household.category(candidate).pickupable and household.parent(candidate) in places:
            return candidate
    return None


def resolve_receptacle(household: Household, name: str, thing: str) -> str:
    """The instance that the target of a put of `thing` means."""
    candidates = [n for n in _candidates(household, name) if n != thing]
    if not candidates:
        raise RefusalError(f"{thing} cannot go into itself")

    world = household.world

    def key(candidate: str) -> tuple[bool, bool, bool, bool, tuple[str, int, str]]:
        full = why_no_room(household, thing, candidate) is not None
        tidy = full or not isinstance(world, Tidy) or world.has_clear_room(thing, candidate)
        return (
            household.closed_around(candidate) is not None,
            full,
            not tidy,
            not world.within_reach(candidate),
            natural_key(candidate),
        )

    return min(candidates, key=key)


def why_no_room(household: Household, thing: str, receptacle: str) -> str | None:
    """Why a thing does not fit on or in a receptacle now, None if it does."""
    kind = household.category(receptacle).receptacle
    if kind is None:
        return f"nothing can be put on or into {receptacle}"
    contents = [n for n in household.contents(receptacle) if n != thing]
    if kind.capacity is not None and len(contents) >= kind.capacity:
        return f"{receptacle} is full: {', '.join(contents)} is in the way"
    if not household.world.has_room(thing, receptacle):
        return f"there is no room for {thing} on {receptacle}"
    return None


def _ease(household: Household, name: str) -> tuple[bool, bool, bool, tuple[str, int, str]]:
    return (
        household.closed_around(name) is not None,
        household.blocker(name) is not None,
        name != household.held and not household.world.within_reach(name),
        natural_key(name),
    )


def _candidates(household: Household, name: str) -> list[str]:
    """Every instance that a name can mean; refuses where there is none."""
    wanted = household.catalogue.canonical(name)
    if household.exists(wanted):
        return [wanted]
    category = household.catalogue.find(wanted)
    if category is None:
        raise RefusalError(f"nothing here is called {name!r}{_hint(household, wanted)}")
    became = household.gone(wanted)
    if became is not None:
        raise RefusalError(f"{wanted} is no longer there: it was {became}")
    knobless = category.controls
    if knobless is not None and not household.of_category(category.name):
        return _candidates(household, knobless + wanted[len(category.name) :])
    found = household.of_category(category.name)
    if is_instance(wanted) and found:
        raise RefusalError(f"there is no {wanted} here; there is {', '.join(found)}")
    if not found:
        raise RefusalError(f"there is no {category.spoken} here")
    return found


def _hint(household: Household, name: str) -> str:
    known = {category_of(n) for n in household.names()}
    near = difflib.get_close_matches(category_of(name), sorted(known), n=3, cutoff=0.5)
    return f"; did you mean {' or '.join(near)}?" if near else ""
