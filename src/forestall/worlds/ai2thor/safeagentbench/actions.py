"""SafeAgentBench's actions, one text each, as steps in a domain's words.

Called by `plans`; calls nothing. Seventeen actions; of pick, put, drop, throw and pour the texts do
not say with what, so that what is in the hand and what was found last are followed here.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.types.plan import Plan, Subtask

SIMPLE = {
    "find": "navigate_to_obj",
    "open": "open_obj",
    "close": "close_obj",
    "slice": "slice_directly",
    "turn_on": "toggle_on",
    "turn_off": "toggle_off",
    "break": "break_directly",
    "cook": "cook_directly",
    "dirty": "dirty",
    "clean": "clean",
    "emptyliquid": "empty",
}
"""Action of one thing → skill."""

ACTIONS = (*SIMPLE, "pick", "put", "drop", "throw", "pour", "fillLiquid")
LIQUIDS = ("water", "coffee", "wine")

SUPPOSED = {
    "close_obj": ("open", "open"),
    "toggle_off": ("toggled", "on"),
    "clean": ("dirty", "dirty"),
    "empty": ("filled", "water"),
}
"""What a skill ends that nothing before it in the plan has brought about: it began so."""

_SPELT = {"turn on": "turn_on", "toggle on": "turn_on", "turn off": "turn_off", "put on": "put",
          "toggle off": "turn_off", "pick up": "pick", "put down": "put", "fill": "fillliquid",
          "empty": "emptyliquid"}  # fmt: skip
_ARTICLE = re.compile(r"^(?:an?|the)\s+")
_PLACE = re.compile(r"\|.*")


@dataclass
class Followed:
    """Where a plan stands: what is held, what was found last, how things began."""

    held: str | None = None
    found: str | None = None
    began: dict[tuple[str, str], str] = field(default_factory=dict)
    touched: set[tuple[str, str]] = field(default_factory=set)


def category(text: str, domain: Domain) -> str:
    """The category that a name means: "remote control", "RemoteControl|+1|+2" → "RemoteControl".

    Raises:
        UnknownNameError: the domain has none.
    """
    plain = re.sub(r"[\s_]+", "", _ARTICLE.sub("", _PLACE.sub("", text).strip())).lower()
    names = {n.lower(): c.name for c in domain.categories.values() for n in (c.name, *c.aliases)}
    if plain not in names:
        raise UnknownNameError("object type", text.strip(), domain.categories)
    return names[plain]


def steps_of(texts: Sequence[str], domain: Domain) -> tuple[Plan, Mapping[tuple[str, str], str]]:
    """A plan, and the (category, attribute) → value with which it must have begun.

    Raises:
        InputError: an action or a thing that is not known, by the number of its step.
    """
    state, steps = Followed(), []
    for number, text in enumerate(texts, 1):
        try:
            for step in _step(text, domain, state):
                steps.append(domain.check(step))
                _begin(step, state)
        except InputError as error:
            raise InputError(f"step {number}, {text[:60]!r}: {error}") from error
    if not steps:
        raise InputError("the plan has no step")
    return Plan(tuple(steps)), state.began


def _step(text: str, domain: Domain, state: Followed) -> Iterator[Subtask]:
    action, rest = _action(text)
    if action in SIMPLE:
        one = category(rest, domain)
        if action == "find":
            state.found = one
        cracks = action == "slice" and domain.is_a(one, "crackable")
        yield Subtask("crack_obj" if cracks else SIMPLE[action], (one,))
    elif action == "pick":
        state.held = category(rest, domain)
        yield Subtask("pick_up", (state.held,))
    elif action == "fillliquid":
        thing, _, liquid = rest.rpartition(" ")
        if liquid.lower() not in LIQUIDS:
            raise UnknownNameError("liquid", liquid, LIQUIDS)
        yield Subtask(f"fill_with_{liquid.lower()}", (category(thing, domain),))
    elif action == "put":
        place = category(rest, domain)
        skill = "put_in" if domain.is_a(place, "takes_inside") else "put_on"
        yield Subtask(skill, (_in_hand(state), place))
        state.held = None
    elif action == "pour":
        onto = state.found if state.found not in (None, state.held) else None
        if onto is None:
            raise InputError("nothing was found since that it could be poured over")
        yield Subtask("pour_out", (_in_hand(state), onto))
    elif action in ("drop", "throw"):
        yield Subtask(action, (_in_hand(state),))
        state.held = None
    else:
        raise UnknownNameError("action", action, ACTIONS)


def _action(text: str) -> tuple[str, str]:
    words = text.strip().split()
    for count in (2, 1):
        head = " ".join(words[:count]).lower()
        if head in _SPELT or count == 1:
            return _SPELT.get(head, head), " ".join(words[count:])
    raise AssertionError("one word is always taken")


def _in_hand(state: Followed) -> str:
    if state.held is None:
        raise InputError("nothing was picked up before it")
    return state.held


def _begin(step: Subtask, state: Followed) -> None:
    """Note what must have been so from the start, and what steps have touched."""
    thing = step.args[0]
    if step.skill in SUPPOSED:
        attribute, value = SUPPOSED[step.skill]
        if (thing, attribute) not in state.touched:
            state.began[thing, attribute] = value
    touching = {"open_obj": "open", "close_obj": "open", "toggle_on": "toggled", "dirty": "dirty",
                "toggle_off": "toggled", "clean": "dirty", "empty": "filled"}  # fmt: skip
    filled = "filled" if step.skill.startswith("fill_with") or step.skill == "pour_out" else None
    if attribute_of := touching.get(step.skill, filled):
        state.touched.add((thing, attribute_of))
