"""No engine package holds a name of a shipped domain: no verb, category, attribute, value, tag.

Names that geometry itself uses (inside, on top of, left of, ...) are perception's own words, so
that relations count only outside of it. Checked are whole strings in the code, the way a domain's
name would be used; a docstring may explain itself with a mug.
"""

import ast
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import pytest

from forestall.domain.load import shipped, shipped_names
from forestall.domain.model import Domain
from forestall.domain.schema import PredicateKind, Roles

ROOT = Path(__file__).parent.parent / "src" / "forestall"

PLUGINS = ("domains", "worlds", "testing", "training", "cli")
"""Plug-ins, the training of the household's encoder, and the examples of the command line."""

PLAIN = {
    "open", "on", "off", "closed", "empty", "room", "inside", "whole", "near", "raw", "place",
    "clean", "within", "above", "below", "behind", "insert", "broken", "in_front_of", "Box",
}  # fmt: skip
"""Words of English, of JSON keys, of file modes and a type of ours that a domain uses, too."""


def names_of(domain: Domain) -> set[str]:
    found = {*domain.skills, *domain.categories, *domain.tags, *domain.attributes}
    found |= {v for a in domain.attributes.values() for v in a.values}
    found |= {p.name for p in domain.predicates.values() if p.kind is not PredicateKind.ATTRIBUTE}
    return found - PLAIN - {f.name for f in fields(Roles)}


def engine() -> Iterator[Path]:
    for path in sorted(ROOT.rglob("*.py")):
        if path.relative_to(ROOT).parts[0] not in PLUGINS:
            yield path


def strings(path: Path) -> Iterator[tuple[int, str]]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, node.value


@pytest.mark.parametrize("name", shipped_names())
def test_no_engine_package_holds_a_name_of_a_domain(name: str) -> None:
    names = names_of(shipped(name))
    geometry = {
        p.name for p in shipped(name).predicates.values() if p.kind is PredicateKind.RELATION
    }
    found = [
        f"{path.relative_to(ROOT)}:{line}: {text!r}"
        for path in engine()
        for line, text in strings(path)
        if text in names - (geometry if path.parts[-2] == "perception" else set())
    ]
    assert not found, "\n".join(found)
