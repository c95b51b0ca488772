"""What has happened and cannot be undone, told from each moment and the one before it.

Washing the pan does not unspoil the egg that was cooked in it while it was dirty. Called by
`world`; calls `scene`.
"""

from __future__ import annotations

from collections.abc import Iterator

from forestall.types.episode import Event
from forestall.types.facts import Literal, category_of
from forestall.worlds.ai2thor.scene import Scene

FOOD = frozenset(
    {"Apple", "Bread", "Egg", "EggCracked", "Lettuce", "Potato", "Tomato", "AppleSliced",
     "BreadSliced", "LettuceSliced", "PotatoSliced", "TomatoSliced"}
)  # fmt: skip

SOAKED = frozenset(f for f in FOOD if f.endswith("Sliced")) | {"Bread"}
"""What running water spoils."""


class History:
    """Everything since reset."""

    def __init__(self, start: Scene) -> None:
        self._before = start
        self._spoiled: set[str] = set()
        self._events: list[Event] = []

    @property
    def facts(self) -> frozenset[Literal]:
        """What is spoiled."""
        return frozenset(Literal("spoiled", (n,)) for n in self._spoiled)

    @property
    def events(self) -> tuple[Event, ...]:
        """In order."""
        return tuple(self._events)

    def note(self, now: Scene, time_s: float) -> None:
        """What has changed since the last time."""
        before = self._before
        for name in now.things:
            if name in before.things:
                self._changed(name, now, time_s)
            else:
                self._made(name, now, time_s)
        for name in before.things:
            if name not in now.things:
                self._tell(time_s, "gone", name, f"{name} is no more")
        self._spoiled |= set(self._spoils(now))
        self._before = now

    def _changed(self, name: str, now: Scene, time_s: float) -> None:
        was = self._before.states(name)
        for attribute, value in now.states(name).items():
            if was.get(attribute) != value:
                self._tell(time_s, "state", name, f"{attribute}({name})={value}")
        place = now.parent(name)
        if place is not None and place != self._before.parent(name):
            self._tell(time_s, "relation", name, f"{now.relation(place)}({name}, {place})")

    def _made(self, name: str, now: Scene, time_s: float) -> None:
        source = str(now.things[name]["objectId"]).rpartition("|")[0]
        old = [n for n, t in self._before.things.items() if t["objectId"] == source]
        self._events.append(Event(time_s, "made", (*old, name), f"{name} is there"))
        for attribute, value in now.states(name).items():
            self._tell(time_s, "state", name, f"{attribute}({name})={value}")
        if self._spoiled & set(old):
            self._spoiled.add(name)

    def _tell(self, time_s: float, kind: str, name: str, text: str) -> None:
        self._events.append(Event(time_s, kind, (name,), text))

    def _spoils(self, now: Scene) -> Iterator[str]:
        """What this change has spoiled."""
        for name in now.things:
            old, new = self._before.states(name), now.states(name)
            place = now.parent(name)
            if (old.get("cooked"), new.get("cooked")) == ("raw", "cooked"):
                yield from self._cooked(name, now)
            if category_of(name) in FOOD and place is not None:
                yield from self._arrived(name, place, now)
            if old.get("filled") == "empty" != new.get("filled"):
                yield from (c for c in now.contents(name) if category_of(c) in FOOD)
                if new["filled"] == "coffee" and (
                    old.get("dirty") == "dirty" or now.contents(name)
                ):
                    yield name
            if new.get("toggled") == "on" != old.get("toggled"):
                yield from self._turned_on(name, now)

    def _turned_on(self, name: str, now: Scene) -> Iterator[str]:
        """Coffee brewed into what is full already; bread and slices under running water."""
        if category_of(name) == "CoffeeMachine":
            for cup in now.contents(name):
                if self._before.states(cup).get("filled") not in (None, "empty"):
                    yield cup
        if category_of(name) == "Faucet":
            wet = (n for sink in now.of("Sink") for n in now.within(sink))
            yield from (n for n in wet if category_of(n) in SOAKED)

    def _cooked(self, name: str, now: Scene) -> Iterator[str]:
        vessels = now.ancestors(name)
        if any(self._before.states(v).get("dirty") == "dirty" for v in vessels):
            yield name
        beside = now.contents(vessels[0]) if vessels else []
        others = [o for o in beside if category_of(o) in FOOD - {category_of(name)}]
        yield from ((name, *others) if others else ())

    def _arrived(self, name: str, place: str, now: Scene) -> Iterator[str]:
        filled = now.states(place).get("filled", "empty")
        if filled == "empty" or self._before.parent(name) == place:
            return
        yield name
        if filled != "water":
            yield place
