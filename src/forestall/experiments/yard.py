"""A large planning problem of its own: a yard with fifteen skills and as many things as asked for.

Called by `speed`; calls the loader of domains and `planning`. It is no task of anybody: it says how
planning grows where a scene is full and few of its things matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from forestall.domain.load import read_domain
from forestall.domain.model import Domain
from forestall.planning.state import State
from forestall.types.facts import Literal
from forestall.types.task import Goal

SHARES = (("Bay", 0.1), ("Rack", 0.1), ("Cart", 0.05))
"""Category → share of all things; the others are crates."""

TEXT = r"""
name = "yard"
tags = ["load", "carrier", "bay", "rack"]
[robot]
hands = []

[predicates.in_bay]
kind = "relation"
parameters = ["thing", "bay - bay"]
contains = true
group = "where"
[predicates.loaded]
kind = "relation"
parameters = ["thing - load", "cart - carrier"]
contains = true
group = "where"
[predicates.shelved]
kind = "relation"
parameters = ["thing - load", "rack - rack"]
contains = true
group = "where"
[predicates.stacked]
kind = "relation"
parameters = ["thing - load", "below - load"]
contains = true
group = "where"
[predicates.lane]
kind = "relation"
parameters = ["one - bay", "other - bay"]
[predicates.stands_in]
kind = "relation"
parameters = ["rack - rack", "bay - bay"]
[predicates.stands]
kind = "derived"
parameters = ["thing - load", "bay - bay"]
definition = "in_bay(?thing, ?bay) or some ?x - load: stacked(?thing, ?x) and stands(?x, ?bay)"
[predicates.topmost]
kind = "derived"
parameters = ["thing - load"]
definition = "every ?x - load: not stacked(?x, ?thing)"
[predicates.empty]
kind = "derived"
parameters = ["bay - bay"]
definition = "every ?x - load: not in_bay(?x, ?bay)"
[predicates.packs_into]
kind = "static"
parameters = ["thing", "pallet"]

[attributes.gate]
values = ["shut", "open"]
[attributes.lamp]
values = ["off", "on"]
[attributes.battery]
values = ["full", "low", "flat"]
[attributes.scanned]
values = ["no", "yes"]
[attributes.seal]
values = ["none", "sealed"]
[attributes.label]
values = ["none", "printed"]

[categories.Crate]
tags = ["load"]
attributes = ["scanned", "seal", "label"]
packs_into = ["Pallet"]
[categories.Pallet]
tags = ["load"]
attributes = ["scanned", "label"]
[categories.Cart]
tags = ["carrier"]
attributes = ["battery"]
capacity = 2
[categories.Bay]
tags = ["bay"]
attributes = ["gate", "lamp"]
[categories.Rack]
tags = ["rack"]
room = 4

[skills.open_gate]
parameters = ["bay - bay"]
needs = [{ fact = "gate(?bay)=shut", else = "{bay} is open" }]
effects = ["gate(?bay)=open"]
[skills.shut_gate]
parameters = ["bay - bay"]
needs = [{ fact = "gate(?bay)=open", else = "{bay} is shut" }]
effects = ["gate(?bay)=shut"]
[skills.drive]
parameters = ["cart - carrier", "start - bay", "end - bay"]
needs = [
  { fact = "in_bay(?cart, ?start)", else = "{cart} is not in {start}" },
  { fact = "lane(?start, ?end)", else = "no lane leads from {start} to {end}" },
  { fact = "gate(?end)=open", else = "{end} is shut" },
  { fact = "not battery(?cart)=flat", else = "{cart} has no power" },
]
effects = [
  "in_bay(?cart, ?end)",
  { when = "battery(?cart)=full", then = ["battery(?cart)=low"] },
  { when = "battery(?cart)=low", then = ["battery(?cart)=flat"] },
]
[skills.charge]
parameters = ["cart - carrier"]
needs = [{ fact = "not battery(?cart)=full", else = "{cart} is charged" }]
effects = ["battery(?cart)=full"]
[skills.load]
parameters = ["thing - load", "cart - carrier", "bay - bay"]
needs = [
  { fact = "in_bay(?thing, ?bay) and in_bay(?cart, ?bay)", else = "{thing} is not at {cart}" },
  { fact = "topmost(?thing)", else = "something is on {thing}" },
  { fact = "fewer than capacity(?cart) of ?y: loaded(?y, ?cart)", else = "{cart} is full" },
]
effects = ["loaded(?thing, ?cart)"]
[skills.unload]
parameters = ["thing - load", "cart - carrier", "bay - bay"]
needs = [
  { fact = "loaded(?thing, ?cart) and in_bay(?cart, ?bay)", else = "{thing} is not on {cart}" },
]
effects = ["in_bay(?thing, ?bay)"]
[skills.shelve]
parameters = ["thing - load", "rack - rack", "bay - bay"]
needs = [
  { fact = "in_bay(?thing, ?bay) and stands_in(?rack, ?bay)", else = "{thing} is not at {rack}" },
  { fact = "topmost(?thing)", else = "something is on {thing}" },
  { fact = "fewer than room(?rack) of ?y: shelved(?y, ?rack)", else = "{rack} is full" },
]
effects = ["shelved(?thing, ?rack)"]
[skills.take_down]
parameters = ["thing - load", "rack - rack", "bay - bay"]
needs = [
  { fact = "shelved(?thing, ?rack) and stands_in(?rack, ?bay)", else = "{thing} is not in {rack}" },
]
effects = ["in_bay(?thing, ?bay)"]
[skills.stack]
parameters = ["thing - load", "below - load", "bay - bay"]
needs = [
  { fact = "in_bay(?thing, ?bay) and in_bay(?below, ?bay)", else = "{below} is elsewhere" },
  { fact = "topmost(?thing) and topmost(?below)", else = "something is on one of them" },
  { fact = "not same(?thing, ?below)", else = "{thing} is itself" },
]
effects = ["stacked(?thing, ?below)"]
[skills.unstack]
parameters = ["thing - load", "below - load", "bay - bay"]
needs = [
  { fact = "stacked(?thing, ?below) and stands(?below, ?bay)", else = "{thing} is not on {below}" },
  { fact = "topmost(?thing)", else = "something is on {thing}" },
]
effects = ["in_bay(?thing, ?bay)"]
[skills.light]
parameters = ["bay - bay"]
needs = [{ fact = "lamp(?bay)=off", else = "{bay} is lit" }]
effects = ["lamp(?bay)=on"]
[skills.scan]
parameters = ["thing - load", "bay - bay"]
needs = [{ fact = "in_bay(?thing, ?bay) and lamp(?bay)=on", else = "{bay} is dark" }]
effects = ["scanned(?thing)=yes"]
[skills.seal]
parameters = ["thing - Crate", "bay - bay"]
needs = [{ fact = "in_bay(?thing, ?bay) and scanned(?thing)=yes", else = "{thing} is not scanned" }]
effects = ["seal(?thing)=sealed"]
[skills.print_label]
parameters = ["thing - load", "bay - bay"]
needs = [{ fact = "in_bay(?thing, ?bay) and scanned(?thing)=yes", else = "{thing} is not scanned" }]
effects = ["label(?thing)=printed"]
[skills.pack]
parameters = ["thing - Crate", "bay - bay"]
makes = [{ variable = "pallet", source = "thing", by = "packs_into" }]
needs = [{ fact = "in_bay(?thing, ?bay) and seal(?thing)=sealed", else = "{thing} is not sealed" }]
effects = ["in_bay(?pallet, ?bay)", "gone(?thing)"]

[processes.night]
parameters = ["bay - bay"]
when = "empty(?bay) and gate(?bay)=shut and lamp(?bay)=on"
effects = ["lamp(?bay)=off"]
"""


@cache
def domain() -> Domain:
    """The yard's domain."""
    return read_domain(TEXT, "yard")


def drawn(count: int, seed: int) -> tuple[State, Goal]:
    """A yard of so many things, and what is to become of two of its crates."""
    rng = np.random.default_rng(seed)
    kinds: dict[str, str] = {}
    for category, share in SHARES:
        kinds |= {f"{category}-{i + 1}": category for i in range(round(share * count))}
    kinds |= {f"Crate-{i + 1}": "Crate" for i in range(count - len(kinds))}
    of = {c: [n for n in kinds if kinds[n] == c] for c in domain().categories}
    facts = [("lane", a, b) for a, b in _lanes(of["Bay"], rng)]
    facts += [("stands_in", r, of["Bay"][i % len(of["Bay"])]) for i, r in enumerate(of["Rack"])]
    facts += [("in_bay", c, str(rng.choice(of["Bay"]))) for c in of["Cart"]]
    free: list[str] = []
    for crate in of["Crate"]:
        if free and rng.random() < 0.2:
            facts.append(("stacked", crate, free.pop(int(rng.integers(len(free))))))
        else:
            facts.append(("in_bay", crate, str(rng.choice(of["Bay"]))))
        free.append(crate)
    values = {(n, a): v for n, c in kinds.items() for a, v in domain().default_states(c).items()}
    for bay in of["Bay"]:
        values[bay, "gate"] = str(rng.choice(["shut", "open"]))
    one, two = (str(c) for c in rng.choice(of["Crate"], 2, replace=False))
    bay, rack = str(rng.choice(of["Bay"])), str(rng.choice(of["Rack"]))
    wanted = (
        Literal("in_bay", (one, bay)),
        Literal("seal", (one,), "sealed"),
        Literal("shelved", (two, rack)),
        Literal("label", (two,), "printed"),
        Literal("gate", (bay,), "shut"),
    )
    return State(domain(), kinds, values, facts), Goal("", literals=wanted)


def _lanes(bays: Sequence[str], rng: np.random.Generator) -> list[tuple[str, str]]:
    """A ring through all bays, and as many lanes more, all of them both ways."""
    pairs = {(bays[i - 1], bays[i]) for i in range(len(bays))}
    for one in bays:
        other = str(rng.choice(bays))
        if other != one:
            pairs.add((one, other))
    return sorted(pairs | {(b, a) for a, b in pairs})
