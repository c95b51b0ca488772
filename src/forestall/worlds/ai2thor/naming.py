"""Our instance names for AI2-THOR's object ids, the same through one run.

"Mug|-01.76|+00.90|-00.62" becomes "Mug-1": numbers go by the ids' order, so that a scene names its
things the same each time; things that a task asks for have the names that it gives. A knob has its
burner's number, a faucet that of its nearest basin; a basin is a part of its sink. Called by
`scene`, `staging`; calls nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

Thing = Mapping[str, Any]

BASINS: Mapping[str, str] = {"SinkBasin": "Sink", "BathtubBasin": "Bathtub"}
"""Type of a part → type of the whole, whose name both have."""


def whole_of(object_id: str) -> str:
    """The id of the thing that an id belongs to: a sink for its basin."""
    head, _, tail = object_id.rpartition("|")
    return head if tail in BASINS else object_id


def type_of(thing: Thing) -> str:
    """Our category of an object."""
    kind = str(thing["objectType"])
    return BASINS.get(kind, kind)


class Names:
    """Both ways between ids and names.

    Args:
        things: every object of the scene at its start.
        wanted: name → id, for things that a task names.
    """

    def __init__(self, things: Sequence[Thing], wanted: Mapping[str, str]) -> None:
        self._ids: dict[str, str] = {}
        self._names: dict[str, str] = {}
        for name, object_id in wanted.items():
            self._give(name, object_id)
        here = {str(t["objectId"]): t for t in things}
        late = [t for t in things if t["objectType"] in ("StoveKnob", "Faucet")]
        self.learn(t for t in things if t not in late)
        for knob in (t for t in late if t["objectType"] == "StoveKnob"):
            for burner in knob.get("controlledObjects") or ():
                self._pair(knob, "StoveKnob", self._names.get(burner))
        sinks = [t for i, t in here.items() if t["objectType"] in BASINS.values()]
        for faucet in (t for t in late if t["objectType"] == "Faucet"):
            near = min(sinks, key=lambda s: _apart_m(s, faucet), default=None)
            if near is not None and near["objectType"] == "Sink":
                self._pair(faucet, "Faucet", self._names.get(str(near["objectId"])))
        self.learn(late)

    def learn(self, things: Iterable[Thing]) -> None:
        """Name what has no name yet, after all that have one."""
        for thing in sorted(things, key=lambda t: str(t["objectId"])):
            object_id, kind = str(thing["objectId"]), type_of(thing)
            if thing["objectType"] in BASINS or object_id in self._names:
                continue
            number = next(n for n in range(1, 10_000) if f"{kind}-{n}" not in self._ids)
            self._give(f"{kind}-{number}", object_id)

    def name(self, object_id: str) -> str | None:
        """The name of an object, None for what is none of the scene's."""
        return self._names.get(whole_of(object_id))

    def id(self, name: str) -> str | None:
        """The object of a name."""
        return self._ids.get(name)

    def _pair(self, thing: Thing, kind: str, partner: str | None) -> None:
        if partner is not None:
            name = f"{kind}-{partner.rpartition('-')[2]}"
            if name not in self._ids:
                self._give(name, str(thing["objectId"]))

    def _give(self, name: str, object_id: str) -> None:
        self._ids[name], self._names[object_id] = object_id, name


def _apart_m(one: Thing, other: Thing) -> float:
    a, b = one["position"], other["position"]
    return math.dist((a["x"], a["z"]), (b["x"], b["z"]))
