"""Domains that say less, or something wrong: loadable, named in words, the same for a seed."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forestall.cli.main import call
from forestall.domain.checks import check_domain
from forestall.domain.distort import Distorted, Distortion, distorted
from forestall.domain.load import load_domain, read_domain, shipped, shipped_names
from forestall.domain.model import Domain
from forestall.domain.toml_out import domain_toml
from forestall.errors import InputError
from forestall.planning.validate import GraphValidator
from forestall.tasks.files import load_task, task_names
from forestall.types.plan import Subtask
from forestall.worlds.kitchen.flat_world import flat_environment

DOMAINS = st.sampled_from(shipped_names())
LITTLE = """
name = "little"
tags = ["movable"]
[robot]
hands = []
[predicates.on]
kind = "relation"
parameters = ["thing", "place"]
contains = true
[attributes.lid]
values = ["shut", "open"]
[categories.Box]
attributes = ["lid"]
[skills.open]
parameters = ["box"]
needs = ["lid(?box)=shut"]
effects = ["lid(?box)=open"]
"""


def differing(a: Domain, b: Domain) -> list[str]:
    """Names of the skills and processes that two domains have different."""
    before = {**a.skills, **{p.name: p for p in a.processes}}
    after = {**b.skills, **{p.name: p for p in b.processes}}
    return [n for n in before if before[n] != after.get(n)]


@settings(max_examples=40, deadline=None)
@given(DOMAINS, st.sampled_from(Distortion), st.integers(0, 10_000), st.floats(0.05, 1.0))
def test_whatever_is_drawn_is_a_domain_that_reads_back(
    name: str, kind: Distortion, seed: int, share: float
) -> None:
    original = shipped(name)
    found = distorted(original, kind, seed, share)
    check_domain(found.domain)
    assert read_domain(domain_toml(found.domain), "again") == found.domain
    assert found.domain.name == original.name
    assert found.domain.categories == original.categories
    assert found.domain.predicates == original.predicates
    assert {s: k.parameters for s, k in found.domain.skills.items()} == {
        s: k.parameters for s, k in original.skills.items()
    }
    assert bool(found.changes) == bool(differing(original, found.domain))
    assert found == distorted(original, kind.value, seed, share)


@settings(max_examples=60, deadline=None)
@given(DOMAINS, st.integers(0, 10_000))
def test_one_schema_in_ten_is_wrong_and_each_change_names_it(name: str, seed: int) -> None:
    original = shipped(name)
    found = distorted(original, "wrong", seed)
    changed = differing(original, found.domain)
    expected = max(1, round(0.1 * (len(original.skills) + len(original.processes))))
    assert len(changed) == len(found.changes) == expected
    assert {c.split(" ")[0] for c in found.changes} == set(changed)


def test_an_exact_domain_is_the_original() -> None:
    assert distorted(shipped("household"), "exact", 5) == Distorted(shipped("household"), ())


def test_seeds_draw_different_mistakes_of_every_sort() -> None:
    said = [c for s in range(60) for c in distorted(shipped("household"), "wrong", s).changes]
    assert len(set(said)) > 40
    for sort in (
        " does not need ",
        " needs ",
        " does not make it so ",
        " makes it so ",
        " happens ",
    ):
        assert any(sort in c for c in said)


def test_a_coarse_domain_has_single_needs_and_knows_nothing_of_harm() -> None:
    original, found = shipped("household"), distorted(shipped("household"), "coarse")
    pick, skills = found.domain.skills["pick_up"], found.domain.skills
    assert next(str(n.formula) for n in pick.needs) == "pickupable(?object)"
    assert len(pick.needs) < len(original.skills["pick_up"].needs)
    assert not any(s.prefers for s in skills.values())
    facts = [f for s in skills.values() for e in s.effects for f in e.facts]
    facts += [f for p in found.domain.processes for e in p.effects for f in e.facts]
    assert not any(f.predicate == "spoiled" for f in facts)


def test_a_coarse_domain_keeps_values_apart_and_what_a_skill_is_for() -> None:
    found = distorted(shipped("bench"), "coarse").domain
    assert found.skills["tighten"].effects[0] == shipped("bench").skills["tighten"].effects[0]
    given_away = [f.predicate for e in found.skills["hand_over"].effects for f in e.facts]
    assert "handed_to" in given_away


@pytest.mark.parametrize("task", task_names())
def test_nominal_plans_still_reach_their_goals_in_a_coarse_domain(task: str) -> None:
    loaded = load_task(task).task
    environment = flat_environment(loaded.scene, shipped("household"))
    environment.reset(2)
    graph = environment.oracle.truth()
    for domain in (shipped("household"), distorted(shipped("household"), "coarse").domain):
        assert GraphValidator(domain).check(loaded.plan, graph, loaded.goal).ok


def test_a_wrong_need_is_what_a_planner_then_goes_by() -> None:
    little = read_domain(LITTLE, "little.toml")
    sentences = {distorted(little, "wrong", s).changes for s in range(30)}
    assert ("open does not need lid(?box)=shut",) in sentences
    assert ("open needs lid(?box)=open, not lid(?box)=shut",) in sentences
    assert ("open does not make it so that lid(?box)=open",) in sentences
    assert ("open makes it so that lid(?box)=shut, not lid(?box)=open",) in sentences
    for seed in range(30):
        found = distorted(little, "wrong", seed)
        assert found.domain.check(Subtask.parse("open(Box-1)"))
        if found.changes == ("open does not need lid(?box)=shut",):
            assert found.domain.skills["open"].needs == ()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("bad",), "choose one of exact, coarse, wrong"),
        (("wrong", 0, 0.0), "share 0.0"),
        (("wrong", -1), "seed -1 is negative"),
    ],
)
def test_what_cannot_be_asked_for_is_refused(arguments: Sequence[str], said: str) -> None:
    with pytest.raises(InputError, match=said):
        distorted(shipped("bench"), *arguments)  # type: ignore[arg-type]


def test_a_domain_in_which_nothing_can_be_wrong_is_refused() -> None:
    empty = read_domain('name = "empty"\n[categories.Box]\n', "empty.toml")
    with pytest.raises(InputError, match="no skill and no process"):
        distorted(empty, "wrong")
    assert distorted(empty, "coarse") == Distorted(empty, ())


def test_the_command_writes_a_file_that_says_what_is_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "wrong.toml"
    arguments = ["domain", "distort", "household", "--kind", "wrong", "--seed", "3"]
    assert call([*arguments, "--out", str(out)]) == 0
    expected = distorted(shipped("household"), "wrong", 3)
    printed = capsys.readouterr().out
    assert all(c in printed and f"# - {c}" in out.read_text() for c in expected.changes)
    assert load_domain(str(out)) == expected.domain
    assert call(arguments) == 0
    assert capsys.readouterr().out == out.read_text()
