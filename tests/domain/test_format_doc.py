"""The examples of the document about domain files are right."""

from __future__ import annotations

import re
from pathlib import Path

from pddl_corpus import FOLDER, execute, subtask

from forestall.domain.json_schema import domain_schema
from forestall.domain.load import read_domain
from forestall.domain.pddl_in import SUPPORTED, read_pddl
from forestall.planning.execute import Refusal, apply
from forestall.planning.state import State

TEXT = (Path(__file__).parents[2] / "docs" / "domain-format.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)


def test_the_domain_of_the_example_works() -> None:
    domain = read_domain(EXAMPLES[0], "domain-format.md")
    state = State(
        domain,
        {"Peg-1": "Peg", "Peg-2": "Peg", "Hole-1": "Hole", "Tray-1": "Tray"},
        {("Peg-1", "torque"): "loose", ("Peg-2", "torque"): "loose"},
        [("lies_on", "Peg-1", "Tray-1"), ("lies_on", "Peg-2", "Tray-1")],
    )
    steps = [
        subtask("grasp", "Peg-1"), subtask("insert", "Peg-1", "Hole-1"), subtask("screw", "Peg-1"),
        subtask("grasp", "Peg-2"),
    ]  # fmt: skip
    after = execute(state, steps)
    assert after.value("Peg-1", "torque") == "tight"
    assert after.place("Peg-1") is not None and after.held == "Peg-2"
    assert domain.attributes["torque"].binned(3.0) == "tight"
    full = apply(after, subtask("insert", "Peg-2", "Hole-1"))
    assert isinstance(full, Refusal) and full.reason == "Hole-1 already has Peg-1"
    held = apply(after, subtask("grasp", "Peg-1"))
    assert isinstance(held, Refusal) and held.reason == "the hand already holds something"
    wrong = apply(after, subtask("grasp", "Tray-1"))
    assert isinstance(wrong, Refusal) and wrong.reason == "Tray-1 is no movable"


def test_the_annotations_of_the_example_fit() -> None:
    domain = read_pddl((FOLDER / "lamps.pddl").read_text(), "lamps.pddl", EXAMPLES[1])
    assert domain.attributes["light"].values == ("off", "on")
    assert domain.skill("lift").at == "?t"


def test_every_field_and_requirement_is_described() -> None:
    for requirement in SUPPORTED:
        assert requirement.removeprefix(":") in TEXT
    properties = domain_schema()["properties"]
    for table, schema in properties.items():
        assert f"[{table}" in TEXT or f"`{table}`" in TEXT
        inner = schema.get("additionalProperties") or schema
        for name in inner.get("properties", {}) if isinstance(inner, dict) else ():
            assert f"`{name}`" in TEXT, f"{table}.{name}"
