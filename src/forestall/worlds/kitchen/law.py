"""How this household differs from what any domain file says: declared deviations, drawn by a seed.

`environment` draws one law for a scene; `household` carries it, and `motions` and `effects` ask it.
`WAYS` says everything that can be drawn. Where nothing was drawn, every answer is that of the
household's catalogue. What was drawn stands in the oracle's events and nowhere else: the robot and
its monitor learn of it only by what they see.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field

from forestall.types.facts import category_of
from forestall.worlds.kitchen.streams import Streams

LAW_EVENT = "law"
"""Kind of the events, at the start, that say how a household differs."""


@dataclass(frozen=True, slots=True)
class Way:
    """One way in which a household may differ from the domain file.

    Args:
        name: of the way.
        probability: that a scene which has such a thing differs in this way.
        of: categories of the thing that is different; one instance is drawn.
        says: what differs, with {thing}, {other} and {number}.
        other: category of a second thing that is drawn; "" for none.
        number: seconds, skills or times, as `says` has it.
    """

    name: str
    probability: float
    of: tuple[str, ...]
    says: str
    other: str = ""
    number: float = 0.0


SLOW = "slow"
STUBBORN = "stubborn"
CROSSED = "crossed"
FALLS_SHUT = "falls shut"
MISFIT = "misfit"
LID = "lid"
SLIPPERY = "slippery when wet"
PULL_TWICE = "pull twice"

WAYS = (
    Way(
        SLOW,
        0.20,
        ("StoveBurner", "Microwave", "Toaster"),
        "{thing} is slow: what is on or in it is hot after {number:g} s",
        number=8.0,
    ),
    Way(
        STUBBORN,
        0.12,
        ("CoffeeMachine", "Microwave", "Television", "Toaster"),
        "{thing} turns on only when it is pressed a second time",
    ),
    Way(
        CROSSED,
        0.15,
        ("StoveBurner",),
        "the knob of {thing} turns {other}, and the other way round",
        other="StoveBurner",
    ),
    Way(
        FALLS_SHUT,
        0.20,
        ("Fridge", "Microwave", "Cabinet"),
        "{thing} falls shut {number:g} skills after it was opened",
        number=2.0,
    ),
    Way(
        MISFIT,
        0.06,
        ("Mug", "Cup"),
        "{thing} is too tall for {other}",
        other="CoffeeMachine",
    ),
    Way(
        LID,
        0.12,
        ("Pot", "Kettle"),
        "{thing} has a lid: it is full only after water has run into it a second time",
    ),
    Way(
        SLIPPERY,
        0.25,
        ("Faucet",),
        "what has been under {thing} slips from the hand {number:g} times as often",
        number=6.0,
    ),
    Way(
        PULL_TWICE,
        0.10,
        ("Fridge",),
        "{thing} must be pulled twice before it opens",
    ),
)
"""Every way, with how often a scene has it. Where a category has several instances one is drawn."""


@dataclass(frozen=True, slots=True)
class Deviation:
    """One way in which this household differs."""

    way: Way
    thing: str
    other: str = ""

    def __str__(self) -> str:
        return self.way.says.format(thing=self.thing, other=self.other, number=self.way.number)


def draw_law(streams: Streams, names: Collection[str], ways: Iterable[Way] = WAYS) -> Law:
    """The law of a scene.

    Args:
        streams: of the scene's seed; each way draws from a stream of its own.
        names: instances that are there.
        ways: what can be drawn.
    """
    drawn = []
    for way in ways:
        rng = streams("law", way.name)
        happens = float(rng.random()) < way.probability
        things = sorted(n for n in names if category_of(n) in way.of)
        if not happens or not things:
            continue
        thing = things[int(rng.integers(len(things)))]
        others = sorted(n for n in names if way.other and category_of(n) == way.other)
        others = [n for n in others if n != thing]
        if way.other and not others:
            continue
        drawn.append(
            Deviation(way, thing, others[int(rng.integers(len(others)))] if others else "")
        )
    return Law(tuple(drawn))


@dataclass(slots=True)
class Law:
    """The deviations of one household, with what they remember while a scene runs.

    Args:
        deviations: what is different; nothing by default.
    """

    deviations: tuple[Deviation, ...] = ()
    _tried: dict[str, int] = field(default_factory=dict)
    _runs: dict[str, int] = field(default_factory=dict)
    _first_run: dict[str, int] = field(default_factory=dict)
    _warming: dict[tuple[str, str], float] = field(default_factory=dict)
    _wet: set[str] = field(default_factory=set)
    _open_for: dict[str, int] = field(default_factory=dict)

    def _about(self, way: str, thing: str) -> Deviation | None:
        found = (d for d in self.deviations if d.way.name == way and d.thing == thing)
        return next(found, None)

    # asked by motions

    def wired(self, thing: str) -> str:
        """What turns when a thing is turned on or off."""
        for d in self.deviations:
            if d.way.name == CROSSED and thing in (d.thing, d.other):
                return d.other if thing == d.thing else d.thing
        return thing

    def turns(self, thing: str, value: str) -> bool:
        """Whether a press takes."""
        if value == "on" and self._about(STUBBORN, thing) and self._is_first(thing):
            return False
        if value == "on":
            self._runs[thing] = self._runs.get(thing, 0) + 1
        return True

    def opens(self, thing: str) -> bool:
        """Whether a pull moves the door."""
        return not (self._about(PULL_TWICE, thing) and self._is_first(thing))

    def fits(self, thing: str, place: str) -> bool:
        """Whether a thing goes into a place that takes its kind."""
        d = self._about(MISFIT, thing)
        return d is None or d.other != place

    def slips(self, thing: str) -> float:
        """How many times as often as usual a thing slips from the hand."""
        factors = [d.way.number for d in self.deviations if d.way.name == SLIPPERY]
        return factors[0] if factors and thing in self._wet else 1.0

    def _is_first(self, thing: str) -> bool:
        self._tried[thing] = self._tried.get(thing, 0) + 1
        return self._tried[thing] % 2 == 1

    # asked by effects

    def fills(self, thing: str, source: str) -> bool:
        """Whether what runs out of a source gets into a vessel now."""
        if self._about(LID, thing) is None:
            return True
        now = self._runs.get(source, 0)
        return self._first_run.setdefault(thing, now) != now

    def heats(self, thing: str, device: str, time_s: float) -> bool:
        """Whether a thing that a device works on has become hot by now."""
        d = self._about(SLOW, device)
        if d is None:
            return True
        return time_s - self._warming.setdefault((device, thing), time_s) >= d.way.number

    def rests(self, device: str, without: Collection[str] = ()) -> None:
        """A device no longer heats anything but what is named."""
        for key in [k for k in self._warming if k[0] == device and k[1] not in without]:
            del self._warming[key]

    def wets(self, thing: str, source: str) -> None:
        """Water has run over a thing."""
        if self._about(SLIPPERY, source) is not None:
            self._wet.add(thing)

    def falling_shut(self, state: Callable[[str, str], str | None]) -> list[str]:
        """Doors that fall shut after the skill that has just ended.

        Args:
            state: (thing, attribute) → its value.
        """
        falling = []
        for d in self.deviations:
            if d.way.name != FALLS_SHUT:
                continue
            if state(d.thing, "open") != "open":
                self._open_for.pop(d.thing, None)
                continue
            self._open_for[d.thing] = self._open_for.get(d.thing, -1) + 1
            if self._open_for[d.thing] >= d.way.number:
                falling.append(d.thing)
        return falling
