"""The skills as a planning domain: `apply` executes one subtask on a symbolic state.

Called by the validator, the replanner and the tests of the search; calls `effects` and `state`.
The rules are those of the household (needs, effects, automatic effects, what cannot be undone);
everything about categories comes from the vocabulary.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from forestall.planning.effects import arrive, set_value, settle, soak, spoil
from forestall.planning.state import Place, State, by_number, number_of
from forestall.types.facts import GRIPPER, Literal, category_of, is_instance
from forestall.types.plan import Subtask

__all__ = ["Place", "Refusal", "State", "apply", "products", "resolve"]


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a subtask cannot run, in words, and the facts that it lacks."""

    reason: str
    lacking: tuple[Literal, ...] = ()


class _RefusedError(Exception):
    """Carries a refusal out of a skill."""

    def __init__(self, reason: str, *lacking: Literal) -> None:
        super().__init__(reason)
        self.refusal = Refusal(reason, lacking)


def apply(state: State, subtask: Subtask) -> State | Refusal:
    """Execute one subtask, automatic effects included.

    Arguments may be category names: the held instance, else the accessible and unblocked one with
    the lowest number, for a receptacle the first with room.
    """
    after = state.copy()
    try:
        args = [_resolved(after, subtask, i) for i in range(len(subtask.args))]
        _SKILLS[subtask.skill](after, *args)
    except _RefusedError as refused:
        return refused.refusal
    settle(after)
    return after


def resolve(state: State, subtask: Subtask) -> tuple[str, ...] | Refusal:
    """The instances that the arguments of a subtask mean in a state."""
    try:
        return tuple(_resolved(state, subtask, i) for i in range(len(subtask.args)))
    except _RefusedError as refused:
        return refused.refusal


def products(state: State, category: str, count: int) -> tuple[str, ...]:
    """Names of things that slicing or cracking makes: the lowest numbers that are free."""
    names: list[str] = []
    number = 1
    while len(names) < count:
        if f"{category}-{number}" not in state.kinds:
            names.append(f"{category}-{number}")
        number += 1
    return tuple(names)


def _resolved(state: State, subtask: Subtask, position: int) -> str:
    name = state.vocabulary.canonical(subtask.args[position])
    if name in state.kinds:
        return name
    if state.vocabulary.find(name) is None:
        raise _RefusedError(f"there is no object called {subtask.args[position]!r}")
    found = () if is_instance(name) else state.instances(name)
    controls = state.vocabulary[name].controls
    if not found and controls is not None and not state.instances(category_of(name)):
        partner = controls + name.removeprefix(category_of(name))
        return _resolved(state, Subtask(subtask.skill, (partner,)), 0)
    found = found or _expected_inside(state, name)
    if not found:
        raise _RefusedError(
            f"no {name} has been seen: its place is not known", Literal("located", (name,))
        )
    if position == 0 and state.held in found:
        return str(state.held)
    if position == 1:
        found = tuple(x for x in found if x != state.held) or found

    def ease(thing: str) -> tuple[bool, bool, bool, tuple[str, int]]:
        hindered = not state.has_room(thing) if position == 1 else bool(state.blockers(thing))
        closed = state.closed_around(thing) is not None
        return thing in state.lost, closed, hindered, by_number(thing)

    return min(found, key=ease)


def _expected_inside(state: State, name: str) -> tuple[str, ...]:
    """A thing that was never seen, believed in an open container whose inside was not observed."""
    category = state.vocabulary[name]
    if category.fixture or not category.pickupable:
        return ()
    for container in sorted(state.hidden, key=by_number):
        open_now = state.value(container, "open") == "open"
        if open_now and state.vocabulary.accepts(container, category.name):
            thing = name if is_instance(name) else f"{name}-1"
            shape = state.category(container).receptacle
            assert shape is not None
            state.kinds[thing] = category.name
            for attribute, value in state.vocabulary.default_states(thing).items():
                state.values[thing, attribute] = value
            state.places[thing] = Place(shape.relation, container)
            believed = Literal(shape.relation, (thing, container))
            state.assumed = (state.assumed - {Literal("vacant", (container,))}) | {believed}
            return (thing,)
    return ()


def _located(state: State, name: str) -> None:
    if name in state.lost:
        raise _RefusedError(f"{name} is lost: its place is not known", Literal("located", (name,)))


def _within_hand(state: State, name: str) -> None:
    _located(state, name)
    closed = state.closed_around(name)
    if closed is not None:
        raise _RefusedError(
            f"{name} is inside {closed}, which is closed", Literal("open", (closed,), "open")
        )


def _held(state: State, name: str) -> None:
    if state.held != name:
        holds = f"it holds {state.held}" if state.held else "it is empty"
        raise _RefusedError(
            f"{name} is not in the gripper ({holds})", Literal("held_by", (name, GRIPPER))
        )


def _navigate(state: State, name: str) -> None:
    _located(state, name)
    state.at = name


def _pick_up(state: State, name: str) -> None:
    if state.held is not None:
        raise _RefusedError(f"the gripper already holds {state.held}", Literal("hand_empty", ()))
    if not state.category(name).pickupable:
        raise _RefusedError(f"{name} cannot be picked up")
    _within_hand(state, name)
    blockers = state.blockers(name)
    if blockers:
        raise _RefusedError(
            f"{blockers[0]} stands in front of {name}", Literal("unblocked", (name,))
        )
    place = state.places.pop(name, None)
    state.blocking = frozenset(pair for pair in state.blocking if name not in pair)
    if state.at == name or state.at is None:
        state.at = None if place is None else place.parent
    state.held = name


def _put(state: State, name: str, receptacle: str) -> None:
    shape = state.category(receptacle).receptacle
    place = state.places.get(name)
    settled = place is not None and place.parent == receptacle
    if state.held != name and settled and not state.category(name).pickupable:
        return
    if shape is None or not state.vocabulary.accepts(receptacle, name):
        raise _RefusedError(f"{receptacle} does not take {state.kinds[name]}")
    _held(state, name)
    _within_hand(state, receptacle)
    if any(p.parent == name for p in state.chain(receptacle)):
        raise _RefusedError(f"{receptacle} is itself in or on {name}")
    if state.vocabulary.encloses(receptacle) and state.value(receptacle, "open") == "closed":
        raise _RefusedError(f"{receptacle} is closed", Literal("open", (receptacle,), "open"))
    device = state.category(receptacle).device
    if device and device.shut_while_on and state.value(receptacle, "toggled") == "on":
        raise _RefusedError(
            f"{receptacle} is on and takes nothing", Literal("toggled", (receptacle,), "off")
        )
    if not state.has_room(receptacle):
        inside = ", ".join(state.contents(receptacle, shape.relation))
        raise _RefusedError(
            f"{receptacle} has no room: it already has {inside}", Literal("vacant", (receptacle,))
        )
    state.held = None
    state.at = receptacle
    arrive(state, name, Place(shape.relation, receptacle))


def _open(state: State, name: str) -> None:
    if state.value(name, "open") is None:
        raise _RefusedError(f"{name} cannot be opened")
    _within_hand(state, name)
    device = state.category(name).device
    if device and device.needs_closed and state.value(name, "toggled") == "on":
        raise _RefusedError(
            f"{name} is on and does not open while it runs", Literal("toggled", (name,), "off")
        )
    set_value(state, name, "open", "open")
    state.at = name


def _close(state: State, name: str) -> None:
    if state.value(name, "open") is None:
        raise _RefusedError(f"{name} cannot be closed")
    _within_hand(state, name)
    set_value(state, name, "open", "closed")
    state.at = name


def _toggled_thing(state: State, name: str) -> str:
    controls = state.category(name).controls
    if controls is not None:
        partner = f"{controls}-{number_of(name)}"
        if partner not in state.kinds:
            raise _RefusedError(f"{name} belongs to {partner}, which has not been seen")
        name = partner
    if state.value(name, "toggled") is None:
        raise _RefusedError(f"{name} cannot be turned on or off")
    _within_hand(state, name)
    return name


def _toggle_on(state: State, name: str) -> None:
    thing = _toggled_thing(state, name)
    device = state.category(thing).device
    if state.value(thing, "toggled") == "on":
        return
    if device and device.needs_closed and state.value(thing, "open") == "open":
        raise _RefusedError(
            f"{thing} is open and cannot be turned on", Literal("open", (thing,), "closed")
        )
    held = None if state.held is None else state.kinds[state.held]
    if device and device.needs_held and held != device.needs_held:
        raise _RefusedError(
            f"{thing} is turned on with the {device.needs_held}, which is not in the gripper",
            Literal("held_by", (device.needs_held, GRIPPER)),
        )
    set_value(state, thing, "toggled", "on")
    state.at = name


def _toggle_off(state: State, name: str) -> None:
    set_value(state, _toggled_thing(state, name), "toggled", "off")
    state.at = name


def _slice(state: State, name: str) -> None:
    category = state.category(name)
    if category.slices_into is None:
        raise _RefusedError(f"{name} cannot be sliced")
    if state.held is None or state.kinds[state.held] != "Knife":
        raise _RefusedError(
            "no knife is in the gripper: slicing needs one", Literal("held_by", ("Knife", GRIPPER))
        )
    _within_hand(state, name)
    _replace(state, name, products(state, category.slices_into, category.slices))


def _crack(state: State, name: str) -> None:
    category = state.category(name)
    if category.cracks_into is None:
        raise _RefusedError(f"{name} cannot be cracked")
    _within_hand(state, name)
    place = state.places.get(name)
    if state.held == name:
        place = _under_hand(state, category.cracks_into)
    (made,) = _replace(state, name, products(state, category.cracks_into, 1))
    if place is not None:
        arrive(state, made, place)
        state.at = place.parent


def _under_hand(state: State, made: str) -> Place | None:
    """Where something let go of lands: the vessel on what the robot faces, that, or below it."""
    focus = state.at
    candidates: list[str] = []
    if focus is not None and focus in state.kinds and focus not in state.lost:
        shape = state.category(focus).receptacle
        if shape is not None and shape.capacity is not None:
            candidates += state.contents(focus)
        candidates += [focus, *(p.parent for p in state.chain(focus))]
    for vessel in (*candidates, *state.instances("Floor")):
        shape = state.category(vessel).receptacle
        if shape is None or not state.vocabulary.accepts(vessel, made):
            continue
        if state.closed_around(vessel) is None and state.has_room(vessel):
            return Place(shape.relation, vessel)
    return None


def _replace(state: State, old: str, new: tuple[str, ...]) -> tuple[str, ...]:
    """Take a thing away and put what became of it at its place."""
    lasting = state.vocabulary.lasting
    kept = {a: v for a in lasting if (v := state.value(old, a)) is not None}
    place = state.places.pop(old, None)
    del state.kinds[old]
    for key in [k for k in state.values if k[0] == old]:
        del state.values[key]
    state.blocking = frozenset(pair for pair in state.blocking if old not in pair)
    state.held = None if state.held == old else state.held
    for name in new:
        state.kinds[name] = state.vocabulary[name].name
        state.values.update(
            {(name, a): v for a, v in state.vocabulary.default_states(name).items()}
        )
        for attribute, value in kept.items():
            set_value(state, name, attribute, value)
        if place is not None:
            arrive(state, name, place)
        if old in state.spoiled:
            spoil(state, name)
    state.at = new[0]
    return new


def _pour(state: State, name: str, target: str) -> None:
    _held(state, name)
    liquid = state.value(name, "filled")
    if liquid is None:
        raise _RefusedError(f"{name} holds no liquid that could be poured")
    if liquid == "empty":
        raise _RefusedError(
            f"{name} is empty: there is nothing to pour", Literal("filled", (name,), "water")
        )
    drains, now = state.category(target).drains, state.value(target, "filled")
    if target == name or not (drains or now is not None):
        raise _RefusedError(f"nothing can be poured from {name} into {target}")
    _within_hand(state, target)
    if not drains:
        if now == "empty":
            set_value(state, target, "filled", liquid)
            set_value(state, target, "temperature", state.value(name, "temperature") or "room")
        soak(state, target)
    set_value(state, name, "filled", "empty")
    state.at = target


_SKILLS: dict[str, Callable[..., None]] = {
    "navigate_to_obj": _navigate,
    "pick_up": _pick_up,
    "put_on": _put,
    "put_in": _put,
    "open_obj": _open,
    "close_obj": _close,
    "toggle_on": _toggle_on,
    "toggle_off": _toggle_off,
    "slice_obj": _slice,
    "crack_obj": _crack,
    "pour": _pour,
}
