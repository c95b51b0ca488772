"""Writes `domains/ai2thor/domain.toml`: the household's skills over AI2-THOR's object types.

    python tests/worlds/ai2thor/make_domain.py AFFORDANCES.json OBJECT_TYPES.json

The first file holds, for each type, the flags, sizes and parents that its objects have over all
rooms of AI2-THOR 5.0; the second what AI2-THOR's own documentation says of it: properties, and the
receptacles that take it, with gaps (no coffee machine takes a mug). So a place takes what the
documentation, the package's own table, the rooms as they are or the household's file say that it
takes. Predicates, skills, processes and attributes are those of the household's file, word for
word; what it says of a category in words and tags is kept, too.
"""

from __future__ import annotations

import json
import re
import sys
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

from ai2thor import controller

from forestall.domain.load import shipped
from forestall.domain.model import Domain

HOUSEHOLD = files("forestall").joinpath("domains", "household", "domain.toml")
TARGET = Path("src/forestall/domains/ai2thor/domain.toml")
CATEGORIES = "# --- vessels and dishes"
"""Where the household's categories begin."""

FLAGS = {
    "openable": "open", "toggleable": "toggled", "canFillWithLiquid": "filled",
    "dirtyable": "dirty", "sliceable": "sliced", "breakable": "broken", "cookable": "cooked",
}  # fmt: skip
NOT_IN_MICROWAVE = ("Pan", "Pot", "Kettle")
PARTS = {"SinkBasin": "Sink", "BathtubBasin": "Bathtub"}
NO_THINGS = ("TargetCircle", "Undefined")
INSIDE = ("Bathtub", "Box", "LaundryHamper", "Safe", "Toilet")
TABLES = ("CoffeeTable", "Desk", "SideTable")
SUPPORTS = ("Dresser", "ShelvingUnit")
HEAD = """# The household over AI2-THOR's object types: {count} categories for the world ai2thor.
# Made by tests/worlds/ai2thor/make_domain.py from the flags, median sizes and parents of every
# object of AI2-THOR 5.0's 120 rooms, its documentation's table of properties and receptacles, and
# the package's. A place takes what one of them says that it takes, or the household's file.
# What stands above the categories is the household's file; change that one and make this anew.

"""


def main(affordances: str, types: str) -> None:
    household = shipped("household")
    seen: dict[str, Any] = json.loads(Path(affordances).read_text())["all"]
    told: dict[str, Any] = json.loads(Path(types).read_text())
    text = HOUSEHOLD.read_text(encoding="utf-8")
    known = tomllib.loads(text)["categories"]
    common = text[: text.index(CATEGORIES)].replace('name = "household"', 'name = "ai2thor"')
    common = "\n".join(x for x in common.split("\n")[3:]).lstrip("\n")
    names = sorted((set(seen) | set(told)) - set(PARTS) - set(NO_THINGS))
    made = [_category(n, seen, told, known.get(n, {}), names, household) for n in names]
    TARGET.parent.mkdir(exist_ok=True)
    whole = HEAD.format(count=len(made)) + common + "# --- categories ---\n\n" + "\n".join(made)
    TARGET.write_text(whole, encoding="utf-8")


def _category(
    name: str,
    all_seen: dict[str, Any],
    told: dict[str, Any],
    known: dict[str, Any],
    names: list[str],
    household: Domain,
) -> str:
    seen = all_seen.get(name, {})
    about = told.get(name, {})
    does = set(about.get("actionable_properties", ()))
    flags = {f for f in FLAGS if seen.get(f)} | {f for f in FLAGS if f in does}
    flags |= {"canFillWithLiquid"} if "fillable" in does else set()
    picked = bool(seen.get("pickupable") or "pickupable" in does) and name != "EggCracked"
    takes = _accepted(name, told, all_seen, names, household)
    fields: dict[str, Any] = {"words": known.get("words", _spaced(name))}
    fields |= {f: known[f] for f in ("synonyms",) if f in known}
    aliases = [part for part, whole in PARTS.items() if whole == name]
    if aliases:
        fields["aliases"] = aliases
    fields["tags"] = _tags(name, flags, picked, bool(takes), known)
    attributes = {FLAGS[f] for f in flags} | set(known.get("attributes", ()))
    attributes |= {"temperature"} if picked else set()
    if name == "Egg":
        attributes -= {"sliced"}
    order = ["open", "toggled", "filled", "dirty", "sliced", "broken", "cooked", "temperature"]
    fields["attributes"] = [a for a in order if a in attributes]
    fields |= {"defaults": known["defaults"]} if "defaults" in known else {}
    fields["accepts"] = takes
    for field in ("capacity", "slices_into", "slices", "cracks_into", "serves", "controls",
                  "only_warms"):  # fmt: skip
        if field in known:
            fields[field] = known[field]
    size = seen.get("aabb_size_median_xyz")
    if picked and size:
        fields["size_m"] = [max(size[0], 0.01), max(size[2], 0.01), max(size[1], 0.01)]
    elif "size_m" in known:
        fields["size_m"] = known["size_m"]
    lines = [f"{k} = {_toml(v)}" for k, v in fields.items() if v not in ([], "")]
    return "\n".join((f"[categories.{name}]", *lines, ""))


def _tags(
    name: str, flags: set[str], picked: bool, takes: bool, known: dict[str, Any]
) -> list[str]:
    found = list(known.get("tags", ()))
    if not known:
        found += ["pickupable"] if picked else ["fixture"]
        if takes:
            inside = "openable" in flags or name in INSIDE
            found += ["takes_inside" if inside else "takes_on_top"]
            found += ["encloses"] if "openable" in flags else []
            found += ["crowded"] if inside and not picked else []
            found += ["support", "tabletop"] if name in TABLES else []
            found += ["support"] if name in SUPPORTS else []
    if "breakable" in flags and picked and "fragile" not in found:
        found.append("fragile")
    if name == "ButterKnife":
        found.append("cuts")
    return found


def _accepted(
    name: str, told: dict[str, Any], seen: dict[str, Any], names: list[str], household: Domain
) -> list[str]:
    """What a receptacle takes; the floor anything."""
    if name == "Floor":
        return ["#pickupable", "EggCracked"]
    parts = [name, *(part for part, whole in PARTS.items() if whole == name)]
    table = controller.RECEPTACLE_OBJECTS
    found = {n for p in parts for n in table.get(p, ()) if n in names}
    for thing in names:
        about, there = told.get(thing, {}), seen.get(thing, {})
        loose = there.get("pickupable") or thing == "HousePlant"
        places = {
            *about.get("compatible_receptacles", ()),
            *(there.get("parents", ()) if loose else ()),
        }
        both = household.find(name) is not None and household.find(thing) is not None
        if places & set(parts) or (both and household.accepts(name, thing)):
            found.add(thing)
    return sorted(found - {name} - (set(NOT_IN_MICROWAVE) if name == "Microwave" else set()))


def _spaced(name: str) -> str:
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return words.replace("TV", "TV ").replace("  ", " ").lower().replace("tv", "TV")


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {_toml(v)}" for k, v in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False)


if __name__ == "__main__":
    main(*sys.argv[1:])
