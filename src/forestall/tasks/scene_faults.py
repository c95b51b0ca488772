"""Scene faults: what a scenario changes in a scene before the run, harmful or not.

Called by `faults`, which joins them with the faults of plans and of their execution. They edit
`SceneNeeds` and keep in it what it was before, so that the scene differs from the undisturbed one
of the same seed in nothing else.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.types.facts import category_of, is_instance
from forestall.types.scene import ObjectNeed, SceneNeeds


class FaultTable(BaseModel):
    """What every fault is: a table with known fields only."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class AddObject(FaultTable):
    """A further object; `in_front_of` makes it block another one."""

    kind: Literal["add_object"] = "add_object"
    category: str
    id: str | None = None
    places: tuple[str, ...] = ()
    states: dict[str, str] = Field(default_factory=dict)
    in_front_of: str | None = None


class SetState(FaultTable):
    """Another start state of an object that the task asks for, or of a fixture."""

    kind: Literal["set_state"] = "set_state"
    object: str
    attribute: str
    value: str


class MoveObject(FaultTable):
    """An object that the task asks for starts somewhere else."""

    kind: Literal["move_object"] = "move_object"
    object: str
    places: tuple[str, ...] = Field(min_length=1)


class RemoveObject(FaultTable):
    """An object that the task asks for is missing."""

    kind: Literal["remove_object"] = "remove_object"
    object: str


class Vary(FaultTable):
    """Axes of the scene's variety are drawn anew; each number draws them in another way.

    "layout" is the whole floor plan, "furniture" only what stands free in it, "start" where the
    robot is at first. Things stay where the new room lets them.
    """

    kind: Literal["vary"] = "vary"
    axes: tuple[str, ...] = Field(min_length=1)
    number: Annotated[int, Field(ge=1, le=1000)] = 1


class MoreClutter(FaultTable):
    """Further things that the task does not need, as many as there is room for up to `count`."""

    kind: Literal["more_clutter"] = "more_clutter"
    count: Annotated[int, Field(ge=1, le=20)] = 3


SceneFault = AddObject | SetState | MoveObject | RemoveObject | Vary | MoreClutter


def apply_scene_faults(needs: SceneNeeds, faults: Iterable[Any], domain: Domain) -> SceneNeeds:
    """The scene with its scene faults, and with the undisturbed one beside it where it has any.

    Other faults are left for their own functions.

    Raises:
        InputError: a fault names an object, place, attribute or value that is not there.
    """
    before = needs.undisturbed or needs
    changed = False
    for fault in faults:
        if not isinstance(fault, SceneFault):
            continue
        changed = True
        if isinstance(fault, AddObject):
            needs = _add(needs, fault, domain)
        elif isinstance(fault, SetState):
            needs = _set(needs, fault, domain)
        elif isinstance(fault, MoveObject):
            chosen = _chosen(needs, fault.object, "move_object.object", domain)
            places = _places(fault.places, "move_object.places", domain)
            objects = (
                replace(o, places=places, in_front_of=None) if o in chosen else o
                for o in needs.objects
            )
            needs = replace(needs, objects=tuple(objects))
        elif isinstance(fault, RemoveObject):
            chosen = _chosen(needs, fault.object, "remove_object.object", domain)
            needs = replace(needs, objects=tuple(o for o in needs.objects if o not in chosen))
        elif isinstance(fault, Vary):
            numbers = dict(needs.vary) | dict.fromkeys(fault.axes, fault.number)
            needs = replace(needs, vary=tuple(sorted(numbers.items())))
        elif isinstance(fault, MoreClutter):
            needs = replace(needs, more_clutter=needs.more_clutter + fault.count)
    return replace(needs, undisturbed=before) if changed else needs


def _add(needs: SceneNeeds, fault: AddObject, domain: Domain) -> SceneNeeds:
    category = domain[fault.category]
    if domain.is_a(category.name, domain.roles.fixture):
        raise InputError(
            f"add_object.category: {category.name} is a fixture; fixtures belong to the room"
        )
    taken = {o.id for o in needs.objects}
    number = 1
    while fault.id is None and f"{category.name}-{number}" in taken:
        number += 1
    name = fault.id or f"{category.name}-{number}"
    if name in taken:
        raise InputError(f"add_object.id: {name} is already in the scene")
    if category_of(name) != category.name or not is_instance(name):
        raise InputError(f"add_object.id: {name!r} must read {category.name}-<number>")
    for attribute, value in fault.states.items():
        check_state(category.name, attribute, value, "add_object.states", domain)
    front = fault.in_front_of
    if front is not None:
        front = _chosen(needs, front, "add_object.in_front_of", domain)[0].id
    places = _places(fault.places, "add_object.places", domain)
    for place in places:
        if not domain.accepts(place, category.name):
            raise InputError(f"add_object.places: {place} does not take {category.name}")
    need = ObjectNeed(name, category.name, places, tuple(sorted(fault.states.items())), front)
    return replace(needs, objects=(*needs.objects, need))


def _set(needs: SceneNeeds, fault: SetState, domain: Domain) -> SceneNeeds:
    name = domain.canonical(fault.object)
    category = domain[name]
    check_state(category.name, fault.attribute, fault.value, "set_state", domain)
    if domain.is_a(category.name, domain.roles.fixture):
        instance = name if is_instance(name) else f"{name}-1"
        kept = tuple(f for f in needs.fixtures if f[:2] != (instance, fault.attribute))
        return replace(needs, fixtures=(*kept, (instance, fault.attribute, fault.value)))
    chosen = _chosen(needs, name, "set_state.object", domain)
    objects = (
        replace(o, states=tuple(sorted((dict(o.states) | {fault.attribute: fault.value}).items())))
        if o in chosen
        else o
        for o in needs.objects
    )
    return replace(needs, objects=tuple(objects))


def check_state(category: str, attribute: str, value: str, field: str, domain: Domain) -> None:
    """Raise UnknownNameError where a category has no such attribute, or that no such value."""
    known = domain[category].attributes
    if attribute not in known:
        raise UnknownNameError(f"attribute of {category} ({field})", attribute, known)
    values = domain.values(attribute)
    if value not in values:
        raise UnknownNameError(f"value of {attribute} ({field})", value, values)


def _places(places: Sequence[str], field: str, domain: Domain) -> tuple[str, ...]:
    names = tuple(domain.canonical(p) for p in places)
    for name in names:
        domain[name]
        if domain.offers(name) is None:
            raise InputError(f"{field}: nothing can be put on or into {name}")
    return names


def _chosen(needs: SceneNeeds, name: str, field: str, domain: Domain) -> tuple[ObjectNeed, ...]:
    """The needs that an instance or category name means."""
    wanted = domain.canonical(name)
    found = tuple(o for o in needs.objects if wanted in (o.id, o.category))
    if not found:
        known = {n for o in needs.objects for n in (o.id, o.category)}
        raise UnknownNameError(f"object of the task ({field})", name, known)
    return found
