"""What happens by itself: devices work on their contents after every skill, to a fixpoint.

`domain.apply` calls it on a private copy of a `State`; it calls nothing but that state.
"""

from __future__ import annotations

from forestall.planning.state import Place, State
from forestall.types.facts import Literal
from forestall.vocabulary import Device


def settle(state: State) -> None:
    """Let every running device work on its contents until nothing changes."""
    while True:
        before = dict(state.values), state.spoiled
        for name in list(state.kinds):
            device = state.working(name)
            if device is not None:
                for receptacle in state.targets(name):
                    _work(state, device, receptacle)
        if (state.values, state.spoiled) == before:
            return


def spoil(state: State, *things: str) -> None:
    """Note that something irreversible has happened to things."""
    state.spoiled |= set(things)


def arrive(state: State, thing: str, place: Place) -> None:
    """Put a thing at a place; food is spoiled by liquid, ready food also by dirt."""
    state.places[thing] = place
    if not state.category(thing).food:
        return
    liquid = state.value(place.parent, "filled")
    if liquid not in (None, "empty"):
        spoil(state, thing)
        if liquid != "water":
            spoil(state, place.parent)
    if ready_to_eat(state, thing) and state.value(place.parent, "dirty") == "dirty":
        spoil(state, thing)


def ready_to_eat(state: State, thing: str) -> bool:
    """Whether food is eaten as it is: sliced or cooked."""
    return state.value(thing, "sliced") == "sliced" or state.value(thing, "cooked") == "cooked"


def soak(state: State, vessel: str) -> None:
    """Liquid has come into a vessel: food in it is spoiled."""
    spoil(state, *(x for x in state.contents(vessel) if state.category(x).food))


def may_cook(device: Device, category: str) -> bool:
    """Whether a device cooks things of a category (that can be cooked at all)."""
    if not device.cooks or category in device.cooks_not:
        return False
    return not device.cooks_only or category in device.cooks_only


def set_value(state: State, name: str, attribute: str, value: str) -> None:
    """Change an attribute of a thing that has it; what was assumed about it is settled."""
    old = state.values.get((name, attribute))
    if old is None:
        return
    state.values[name, attribute] = value
    state.assumed -= {Literal(attribute, (name,), old)}


def _work(state: State, device: Device, receptacle: str) -> None:
    for thing in state.contents(receptacle):
        if device.cleans:
            set_value(state, thing, "dirty", "clean")
        if device.fills is not None:
            _fill(state, device, thing, device.fills)
    for thing, inside in _nested(state, receptacle):
        if device.heats:
            set_value(state, thing, "temperature", "hot")
        if device.cools:
            set_value(state, thing, "temperature", "cold")
        if device.cleans and state.category(thing).food and not state.category(thing).washable_food:
            spoil(state, thing)
        if may_cook(device, state.kinds[thing]) and state.value(thing, "cooked") == "raw":
            _cook(state, thing, inside)


def _nested(state: State, receptacle: str) -> list[tuple[str, tuple[str, ...]]]:
    """Everything in or on a receptacle at any depth, with the containers between them."""
    found: list[tuple[str, tuple[str, ...]]] = []
    for thing in state.contents(receptacle):
        found.append((thing, ()))
        found += [(x, (*inner, thing)) for x, inner in _nested(state, thing)]
    return found


def _fill(state: State, device: Device, vessel: str, liquid: str) -> None:
    now = state.value(vessel, "filled")
    if now is None:
        return
    if device.brews and now != liquid:
        dirty = state.value(vessel, "dirty") == "dirty"
        if dirty or now != "empty" or state.contents(vessel):
            spoil(state, vessel)
    if now == "empty":
        set_value(state, vessel, "filled", liquid)
        if not device.heats:
            set_value(state, vessel, "temperature", "room")
        soak(state, vessel)


def _cook(state: State, food: str, inside: tuple[str, ...]) -> None:
    """Cook one thing; dirt of its containers and company of another kind spoil it."""
    set_value(state, food, "cooked", "cooked")
    if any(state.value(c, "dirty") == "dirty" for c in inside):
        spoil(state, food)
    place = state.places[food]
    for other in state.contents(place.parent):
        if state.category(other).food and state.kinds[other] != state.kinds[food]:
            spoil(state, food, other)
