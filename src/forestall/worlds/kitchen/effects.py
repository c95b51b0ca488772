"""What happens by itself: after every skill the devices that run work on their contents.

Reads device properties from the catalogue and changes the household, to a fixpoint. Outcomes that
cannot be undone are noted as spoiled, with an event, at the moment when they happen, so that they
stay known whatever the final state looks like.

What spoils what:

- food that becomes cooked in a dirty container, or beside food of another category in the same
  container (both);
- food that gets into a vessel with liquid, or gets liquid poured on it (and the vessel, too, unless
  the liquid is water);
- food that is ready to eat (sliced or cooked) and gets into or onto something dirty; raw whole food
  is harmed by dirt only when it is cooked;
- a vessel that a drink is brewed into while it is dirty, filled with something else, or holds food.
"""

from __future__ import annotations

from dataclasses import dataclass

from forestall.types.facts import category_of
from forestall.worlds.kitchen.catalogue import Device
from forestall.worlds.kitchen.household import Household, number_of


@dataclass(frozen=True, slots=True)
class EffectConfig:
    """Numbers of the automatic effects.

    Args:
        cool_down_s: after this time off heat (or cold) a thing is at room temperature.
        max_rounds: bound of the fixpoint iteration.
    """

    cool_down_s: float = 300.0
    max_rounds: int = 20


def settle(household: Household, config: EffectConfig | None = None) -> None:
    """Let every running device work until nothing changes any more."""
    config = config or EffectConfig()
    for _ in range(config.max_rounds):
        before = len(household.events())
        kept: set[str] = set()
        for name in list(household.names()):
            device = household.category(name).device
            if device is None:
                continue
            if runs(household, name):
                kept |= _work(household, name, device)
            else:
                household.law.rests(name)
        _drift(household, kept, config.cool_down_s)
        if len(household.events()) == before:
            return


def runs(household: Household, name: str) -> bool:
    """Whether a device works now."""
    device = household.category(name).device
    if device is None:
        return False
    is_open = household.state(name, "open") == "open"
    if device.always:
        return not is_open
    return household.state(name, "toggled") == "on" and not (device.needs_closed and is_open)


def works_on(household: Household, name: str) -> str:
    """The receptacle whose contents a device works on: its own, or its partner's."""
    device = household.category(name).device
    if device is None or device.acts_on is None:
        return name
    partner = f"{device.acts_on}-{number_of(name)}"
    return partner if household.exists(partner) else household.first(device.acts_on) or name


def _work(household: Household, name: str, device: Device) -> set[str]:
    """One round of one device; returns the things whose temperature it keeps."""
    target, law = works_on(household, name), household.law
    contents, within = household.contents(target), household.within(target)
    law.rests(name, within)
    if device.cleans:
        for thing in contents:
            household.set_state(thing, "dirty", "clean")
            law.wets(thing, name)
        for food in within:
            kind = household.category(food)
            if kind.food and not kind.washable_food:
                household.spoil(food, f"{food} was under the running {device.fills or 'water'}")
    if device.fills is not None:
        for thing in contents:
            if not household.is_lying(thing) and law.fills(thing, name):
                _fill(household, thing, device, device.fills)
    if device.heats or device.cooks:
        within = [n for n in within if law.heats(n, name, household.time_s)]
    for wanted, value in ((device.heats, "hot"), (device.cools, "cold")):
        if wanted:
            for thing in within:
                household.set_state(thing, "temperature", value)
    if device.cooks:
        _cook(household, target, device, within)
    return set(within) if device.heats or device.cools else set()


def _fill(household: Household, thing: str, device: Device, liquid: str) -> None:
    now = household.state(thing, "filled")
    if now is None:
        return
    if device.brews and now != liquid:
        _brew_check(household, thing, liquid)
    if now != "empty":
        return
    household.set_state(thing, "filled", liquid)
    if not device.heats:
        household.set_state(thing, "temperature", "room")
    soak(household, thing, f"{liquid} ran onto it")


def _brew_check(household: Household, thing: str, liquid: str) -> None:
    now = household.state(thing, "filled")
    if household.state(thing, "dirty") == "dirty":
        household.spoil(thing, f"{liquid} was brewed into {thing} while it was dirty")
    if now != "empty":
        household.spoil(thing, f"{liquid} was brewed into {thing}, which held {now}")
    if household.contents(thing):
        household.spoil(thing, f"{liquid} was brewed over what lies in {thing}")


def soak(household: Household, vessel: str, why: str) -> None:
    """Liquid has come into a vessel: food in it is spoiled."""
    for food in household.contents(vessel):
        if household.category(food).food:
            household.spoil(food, f"{food} lies in {vessel} and {why}")


def _cook(household: Household, target: str, device: Device, within: list[str]) -> None:
    raw = [
        n
        for n in within
        if household.state(n, "cooked") == "raw"
        and category_of(n) not in device.cooks_not
        and (not device.cooks_only or category_of(n) in device.cooks_only)
    ]
    for food in raw:
        household.set_state(food, "cooked", "cooked")
    for food in raw:
        chain = household.ancestors(food)
        for container in chain[: chain.index(target)]:
            if household.state(container, "dirty") == "dirty":
                household.spoil(food, f"{food} was cooked in {container}, which was dirty")
        for other in household.contents(chain[0]):
            if household.category(other).food and category_of(other) != category_of(food):
                household.spoil(food, f"{food} was cooked together with {other}")
                household.spoil(other, f"{other} was cooked together with {food}")


def _drift(household: Household, kept: set[str], cool_down_s: float) -> None:
    for name in list(household.names()):
        if (
            name not in kept
            and household.state(name, "temperature") not in (None, "room")
            and household.time_s - household.tempered_s(name) >= cool_down_s
        ):
            household.set_state(name, "temperature", "room")


def arrived(household: Household, thing: str, receptacle: str) -> None:
    """What it does to food that it now lies in or on this receptacle."""
    if not household.category(thing).food:
        return
    liquid = household.state(receptacle, "filled")
    if liquid not in (None, "empty"):
        household.spoil(thing, f"{thing} was put into {receptacle}, which held {liquid}")
        if liquid != "water":
            household.spoil(receptacle, f"{thing} was put into the {liquid} in {receptacle}")
    ready = "sliced" if household.state(thing, "sliced") == "sliced" else None
    if household.state(thing, "cooked") == "cooked":
        ready = "cooked"
    if ready is not None and household.state(receptacle, "dirty") == "dirty":
        household.spoil(thing, f"{thing} is {ready} and was put onto {receptacle}, which was dirty")


def crash(household: Household, thing: str, hard: bool) -> None:
    """What a fall does: liquid spills, an egg breaks, a hard fall breaks what is fragile."""
    for name in (thing, *household.within(thing)):
        if household.state(name, "filled") not in (None, "empty"):
            spill(household, name, "it fell")
        category = household.category(name)
        if not category.fragile or not (hard or category.cracks_into is not None):
            continue
        household.set_state(name, "broken", "broken")
        household.spoil(name, f"{name} broke when it fell")
        if category.cracks_into is not None:
            household.replace(name, category.cracks_into, 1, "broken")


def spill(household: Household, vessel: str, why: str) -> None:
    """A vessel loses its liquid."""
    liquid = household.state(vessel, "filled")
    household.set_state(vessel, "filled", "empty")
    household.record("spill", (vessel,), f"the {liquid} in {vessel} was spilt: {why}")
