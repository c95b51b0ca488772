"""The domain of the household, made from the PDDL file that comes with its programs.

Called by `household`; calls the PDDL reader. Predicates about one thing that change become
attributes, those that never change tags of categories; the hands are hands. What PDDL cannot say is
in `annotations.toml`, what it says otherwise than the executor in `corrections.toml`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

from forestall.domain.load import build_domain
from forestall.domain.model import Domain
from forestall.domain.pddl_in import load_pddl
from forestall.domain.toml_out import domain_toml
from forestall.reading.documents import parse_toml
from forestall.worlds.virtualhome.packages import CHARACTER, Flat
from forestall.worlds.virtualhome.seen import ATTRIBUTES, HAVING, HELD, NEITHER, NO, POSTURES, YES

_HELD_BY = {"holds_rh": "right_gripper", "holds_lh": "left_gripper"}
_UNARY = re.compile(r"\b(\w+)\((\?\w+)\)")
_HOLDS = re.compile(r"\b(holds_[rl]h)\(\?\w+, (\?\w+)\)")

_SHUT_IN = re.compile(r"not \(some (\?\w+): obj_inside\((\?\w+), \1\) and opening\(\1\)=closed\)")
_HANDS_FULL = re.compile(
    r"not \(\(some (\?\w+): held_by\(\1, \w+\)\) and \(some (\?\w+): held_by\(\2, \w+\)\)\)"
)
_LITERAL = re.compile(r"\w+\([?\w, ]*\)(?:=\w+)?")

_VALUES = {v: a for a, values in ATTRIBUTES.items() for v in values}


@dataclass
class Kinds:
    """What the things of start graphs are: class name → properties, and attributes."""

    properties: dict[str, set[str]] = field(default_factory=dict)
    attributes: dict[str, set[str]] = field(default_factory=dict)

    def see(self, start: Flat) -> None:
        """Take in a start graph."""
        for node in start.nodes.values():
            self.properties.setdefault(node.name, set()).update(p.lower() for p in node.properties)
            own = self.attributes.setdefault(node.name, set())
            for attribute, values in ATTRIBUTES.items():
                having = HAVING.get(attribute) in node.properties
                if having or node.states & set(values.values()):
                    own.add(attribute)


def as_published(pddl: Path, kinds: Kinds) -> Domain:
    """The domain that the PDDL file says, in the form of ours.

    Args:
        pddl: the file.
        kinds: what things there are; the file knows objects and characters alone.

    Raises:
        DomainError: the file is not the one that this was made for.
    """
    return build_domain(_tables(pddl, kinds))


def corrected(pddl: Path, kinds: Kinds) -> Domain:
    """The same with what the executor does otherwise.

    Args:
        pddl: the file.
        kinds: what things there are.
    """
    tables = _tables(pddl, kinds)
    own = _shipped("corrections.toml")
    for skill in own["skills"].values():
        skill["needs"] = [_need(n["fact"]) for n in skill["needs"]]
    tables["skills"] |= own["skills"]
    tables["categories"] = own["categories"] | tables["categories"]
    return build_domain(tables)


def _tables(pddl: Path, kinds: Kinds) -> dict[str, Any]:
    own = _shipped("annotations.toml")
    data = parse_toml(domain_toml(load_pddl(str(pddl))), str(pddl))
    changed = {
        match[1]
        for skill in data["skills"].values()
        for effect in skill.get("effects", ())
        for fact in effect["then"]
        for match in _UNARY.finditer(fact)
    }
    unary = {n for n, p in data["predicates"].items() if len(p["parameters"]) == 1}
    dropped = {*unary, *_HELD_BY}
    predicates = {n: p for n, p in data["predicates"].items() if n not in dropped}
    for name, offered_by in own["contains"].items():
        predicates[name] |= {"contains": True, "offered_by": offered_by}
    tags = sorted(unary - changed)
    data["predicates"] = predicates | own["predicates"]
    data["attributes"] = {
        **{a: {"values": [*v, NEITHER], "material": False} for a, v in ATTRIBUTES.items()},
        **{p: {"values": [NO, YES], "material": False} for p in POSTURES},
    }
    data["attributes"]["dirt"]["material"] = True
    data["tags"] = sorted({*data.get("tags", ()), *tags})
    data["categories"] = _categories(kinds, data["tags"]) | {
        CHARACTER: {"attributes": list(POSTURES)}
    }
    skills = {name: _skill(skill) for name, skill in data["skills"].items()}
    data["skills"] = skills | own["skills"]
    data["roles"] = own["roles"]
    data["robot"] = own["robot"]
    data["spelling"] = {}
    return data


def _categories(kinds: Kinds, tags: list[str]) -> dict[str, Any]:
    return {
        name: {
            "tags": sorted(properties & set(tags)),
            "attributes": [a for a in ATTRIBUTES if a in kinds.attributes[name]],
        }
        for name, properties in sorted(kinds.properties.items())
    }


def _skill(skill: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "parameters": skill["parameters"],
        "needs": [_need(_asked(n["fact"])) for n in skill.get("needs", ())],
        "effects": [e for one in skill.get("effects", ()) for e in _happens(one)],
    }


def _need(fact: str) -> dict[str, Any]:
    """A need; a single fact that fails is what is lacking."""
    return {"fact": fact, "lacks": [fact]} if _LITERAL.fullmatch(fact) else {"fact": fact}


def _asked(formula: str) -> str:
    """A condition in our words."""
    formula = _UNARY.sub(_stated, _HOLDS.sub(_held, formula))
    return _HANDS_FULL.sub("hand_free()", _SHUT_IN.sub(r"accessible(\2)", formula))


def _held(match: re.Match[str]) -> str:
    return f"{HELD}({match[2]}, {_HELD_BY[match[1]]})"


def _stated(match: re.Match[str]) -> str:
    if match[1] in POSTURES:
        return f"{match[1]}({match[2]})={YES}"
    if match[1] in _VALUES:
        return f"{_VALUES[match[1]]}({match[2]})={match[1]}"
    return match[0]


def _happens(effect: Mapping[str, Any]) -> list[dict[str, Any]]:
    """An effect in our words; a value that ends without another beginning leaves neither."""
    rest = {k: _asked(v) if k == "when" else v for k, v in effect.items() if k != "then"}
    facts = [_HOLDS.sub(_held, f) for f in effect["then"]]
    begun = {m[1] for f in facts if not f.startswith("not ") and (m := _UNARY.fullmatch(f))}
    then, more = [], []
    for fact in facts:
        ended = fact.startswith("not ")
        match = _UNARY.fullmatch(fact.removeprefix("not "))
        if match is None:
            then.append(fact)
        elif not ended:
            then.append(_stated(match))
        elif match[1] in POSTURES:
            then.append(f"{match[1]}({match[2]})={NO}")
        elif not begun & set(ATTRIBUTES[_VALUES[match[1]]]):
            now, attribute = _stated(match), _VALUES[match[1]]
            more.append({"when": now, "then": [f"{attribute}({match[2]})={NEITHER}"]})
    return [{**rest, "then": then}, *more] if then else more


def _shipped(name: str) -> dict[str, Any]:
    place = files("forestall.worlds.virtualhome").joinpath(name)
    return parse_toml(place.read_text(encoding="utf-8"), name)
