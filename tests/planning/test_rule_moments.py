"""Safety rules about one step: before or after a skill, of what the step names."""

from __future__ import annotations

from pathlib import Path

import pytest

from forestall.domain.load import read_domain
from forestall.domain.model import Domain
from forestall.domain.pddl_out import domain_pddl
from forestall.domain.sheet import skill_sheet
from forestall.domain.toml_out import domain_toml
from forestall.errors import DomainError, InputError
from forestall.planning.rehearse import rehearse
from forestall.types.plan import Plan
from forestall.types.symbolic import scene_graph
from forestall.types.task import Goal

SHOP = """
name = "shop"
tags = ["fixture"]

[robot]
hands = []

[predicates.near]
kind = "relation"
parameters = ["cloth", "lamp"]
words = "{0} lies near {1}"

[attributes.lit]
values = ["off", "on"]

[categories.Lamp]
tags = ["fixture"]
attributes = ["lit"]

[categories.Cloth]

[constants]
Lamp-1 = "Lamp"

[skills.light]
parameters = ["lamp - Lamp"]
effects = ["lit(?lamp)=on"]

[skills.douse]
parameters = ["lamp - Lamp"]
effects = ["lit(?lamp)=off"]

[safety.fire]
every = ["cloth - Cloth", "lamp - Lamp"]
never = "near(?cloth, ?lamp)"
WHEN
else = "{cloth} would burn at {lamp}"
"""
START = {
    "objects": {"Lamp-1": {"lit": "off"}, "Lamp-2": {"lit": "off"}, "Cloth-1": {}},
    "relations": ["Cloth-1 near Lamp-2"],
}


def shop(when: str) -> Domain:
    return read_domain(SHOP.replace("WHEN", when), "shop.toml")


def spoilt(when: str, *steps: str) -> list[int | None]:
    """The steps by which the cloth would burn."""
    domain = shop(when)
    found = rehearse(Plan.parse(steps), scene_graph(START), Goal(""), domain)
    return [s.step for s in found.spoils if not s.excused]


@pytest.mark.parametrize(
    ("when", "lamp_1", "lamp_2"),
    [
        ('when = "light"', [0], [0]),
        ('when = "light(?lamp)"', [], [0]),
        ('when = "light(Lamp-1)"', [0], []),
        ('when = "after light(?lamp)"', [], [0]),
        ('when = "after light"', [0], [0]),
        ('when = "douse(?lamp)"', [], []),
    ],
)
def test_a_rule_is_judged_at_the_step_that_it_is_about(
    when: str, lamp_1: list[int], lamp_2: list[int]
) -> None:
    assert spoilt(when, "light(Lamp-1)") == lamp_1
    assert spoilt(when, "light(Lamp-2)") == lamp_2


def test_after_is_judged_on_what_the_step_brought_about() -> None:
    text = SHOP.replace("near(?cloth, ?lamp)", "near(?cloth, ?lamp) and lit(?lamp)=on")
    for when, steps in (("light(?lamp)", []), ("after light(?lamp)", [0])):
        domain = read_domain(text.replace("WHEN", f'when = "{when}"'), "shop.toml")
        found = rehearse(Plan.parse(["light(Lamp-2)"]), scene_graph(START), Goal(""), domain)
        assert [s.step for s in found.spoils] == steps
    assert found.spoils[0].sentence == "Cloth-1 would burn at Lamp-2"


@pytest.mark.parametrize("when", ['when = "after light(?lamp)"', 'when = "light(Lamp-1)"'])
def test_it_is_written_as_it_was_read(when: str) -> None:
    domain = shop(when)
    again = read_domain(domain_toml(domain), "again.toml")
    assert again == domain and when in domain_toml(domain)
    words = when.removeprefix('when = "').rstrip('"')
    assert (words if words.startswith("after") else f"before {words}") in skill_sheet(domain)


def test_in_pddl_a_rule_before_a_step_is_a_precondition_of_its_things() -> None:
    light = domain_pddl(shop('when = "light(?lamp)"')).text.split("(:action")[2]
    assert "(= ?lamp_of_the_rule ?lamp)" in light and "near ?cloth_of_the_rule" in light
    with pytest.raises(DomainError, match=r"after a skill cannot be said in PDDL .*fire"):
        domain_pddl(shop('when = "after light(?lamp)"'))


@pytest.mark.parametrize(
    ("when", "said"),
    [
        ("after leaving", "only a skill has arguments"),
        ("light(?lamp, ?cloth)", "light takes lamp"),
        ("light(?lmp)", r"unknown variable .*did you mean \?lamp"),
        ("light(Lamp-7)", "unknown constant .*Lamp-1"),
        ("light(?lamp", "write 'leaving', a skill"),
        ("after", "unknown when of safety rule fire"),
        ("before light", "write 'leaving', a skill"),
    ],
)
def test_what_is_no_moment_is_said(when: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        shop(f'when = "{when}"')


def test_the_format_page_says_it() -> None:
    page = (Path(__file__).parents[2] / "docs" / "domain-format.md").read_text("utf-8")
    assert '`"after skill(?x)"`' in page
