"""What devices do by themselves, as conditional effects of the operators that let them.

Called by `translate`; calls `grounding`. The same rules as `effects`, told as conditions on the
state before the operator: a thing arrives where a device runs, or a device starts to run.
"""

from __future__ import annotations

from forestall.planning.effects import may_cook
from forestall.planning.grounding import Change, Layout
from forestall.planning.problem import Atom
from forestall.vocabulary import ATTRIBUTES, Device

Path = tuple[Atom, ...]


class Automatic:
    """Conditional effects over one layout."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self._devices: dict[str, list[str]] = {}
        for name in layout.universe.things:
            if layout.state.category(name).device is not None:
                for target in layout.state.targets(name):
                    self._devices.setdefault(target, []).append(name)

    def working(self, device_name: str, condition: Path) -> list[Change]:
        """A device starts to run: it works on whatever is in its receptacles."""
        device = self.layout.state.category(device_name).device
        changes: list[Change] = []
        for target in self.layout.state.targets(device_name):
            for x, place in self.layout.holders(target):
                changes += self._on(x, device, (*condition, place), (target,))
        return changes

    def arrival(self, x: str, receptacle: str) -> list[Change]:
        """A thing comes into or onto a receptacle: dirt, liquid, and devices that run there."""
        layout = self.layout
        changes: list[Change] = []
        if layout.category(x).food:
            if layout.has(receptacle, "filled"):
                for liquid in ATTRIBUTES["filled"][1:]:
                    both = (x,) if liquid == "water" else (x, receptacle)
                    condition: Path = (("is", receptacle, "filled", liquid),)
                    changes.append(Change(condition, (), layout.spoils(*both)))
            if layout.has(receptacle, "dirty"):
                dirt: Atom = ("is", receptacle, "dirty", "dirty")
                spoilt = layout.spoils(x)
                if layout.has(x, "sliced") and layout.initially(x, "sliced") == "sliced":
                    changes.append(Change((dirt,), (), spoilt))
                elif layout.has(x, "cooked"):
                    cooked: Atom = ("is", x, "cooked", "cooked")
                    changes.append(Change((dirt, cooked), (), spoilt))
        return changes + self._exposed(x, (), (receptacle,))

    def soaked(self, vessel: str, condition: Path) -> list[Change]:
        """Liquid comes into a vessel: food in it is spoiled."""
        layout = self.layout
        return [
            Change((*condition, place), (), layout.spoils(y))
            for y, place in layout.holders(vessel)
            if layout.category(y).food
        ]

    def _exposed(self, x: str, condition: Path, chain: tuple[str, ...]) -> list[Change]:
        """What running devices above a place do to a thing that comes there."""
        layout = self.layout
        changes: list[Change] = []
        top = chain[-1]
        for name in self._devices.get(top, ()):
            device = layout.state.category(name).device
            if device is None or device.always:
                continue
            running = (*condition, ("is", name, "toggled", "on"))
            changes += self._on(x, device, running, chain)
        if top in layout.places:
            for place in layout.places[top]:
                parent = layout.parent(place)
                if parent is not None and parent not in chain:
                    changes += self._exposed(x, (*condition, place), (*chain, parent))
        return changes

    def _on(
        self, x: str, device: Device | None, condition: Path, chain: tuple[str, ...]
    ) -> list[Change]:
        """What a device does to `x`; `chain` are its containers up to the device's receptacle."""
        if device is None:
            return []
        layout = self.layout
        changes: list[Change] = []
        if len(chain) == 1:
            if device.cleans and layout.has(x, "dirty"):
                clean = layout.becomes(x, "dirty", "clean")
                changes.append(Change(condition, *clean))
            if device.fills is not None and layout.has(x, "filled"):
                changes += self._fill(x, device, device.fills, condition)
        changes += self._temper_and_cook(x, device, condition, chain)
        for y, path in layout.nested(x):
            inner = tuple(p[3] for p in reversed(path))
            changes += self._temper_and_cook(y, device, (*condition, *path), (*inner, *chain))
        return changes

    def _fill(self, x: str, device: Device, liquid: str, condition: Path) -> list[Change]:
        layout = self.layout
        changes: list[Change] = []
        spoilt = layout.spoils(x)
        for now in ATTRIBUTES["filled"] if device.brews else ():
            before: Path = (*condition, ("is", x, "filled", now))
            if now == liquid:
                continue
            if now != "empty":
                changes.append(Change(before, (), spoilt))
            if layout.has(x, "dirty"):
                changes.append(Change((*before, ("is", x, "dirty", "dirty")), (), spoilt))
            changes += [Change((*before, p), (), spoilt) for _, p in layout.holders(x)]
        empty: Path = (*condition, ("is", x, "filled", "empty"))
        changes.append(Change(empty, *layout.becomes(x, "filled", liquid)))
        if not device.heats and layout.has(x, "temperature"):
            changes.append(Change(empty, *layout.becomes(x, "temperature", "room")))
        return changes + self.soaked(x, empty)

    def _temper_and_cook(
        self, x: str, device: Device, condition: Path, chain: tuple[str, ...]
    ) -> list[Change]:
        layout = self.layout
        changes: list[Change] = []
        kind = layout.category(x)
        if device.cleans and kind.food and not kind.washable_food:
            changes.append(Change(condition, (), layout.spoils(x)))
        for works, value in ((device.heats, "hot"), (device.cools, "cold")):
            if works and layout.has(x, "temperature"):
                warm = layout.becomes(x, "temperature", value)
                changes.append(Change(condition, *warm))
        if not (layout.has(x, "cooked") and may_cook(device, layout.kind(x))):
            return changes
        raw: Path = (*condition, ("is", x, "cooked", "raw"))
        changes.append(Change(raw, *layout.becomes(x, "cooked", "cooked")))
        for container in chain[:-1]:
            if layout.has(container, "dirty"):
                dirt: Atom = ("is", container, "dirty", "dirty")
                changes.append(Change((*raw, dirt), (), layout.spoils(x)))
        for other, place in layout.holders(chain[0]):
            if layout.category(other).food and layout.kind(other) != layout.kind(x):
                changes.append(Change((*raw, place), (), layout.spoils(x, other)))
        return changes
