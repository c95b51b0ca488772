"""A monitor with a domain reads no word that the domain does not have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest

from forestall import Monitor
from forestall.domain.load import shipped
from forestall.errors import InputError
from forestall.perception.config import ScopeConfig
from forestall.perception.relations import DIRECTIONS
from forestall.perception.scope import scope
from forestall.types.decision import Outcome
from forestall.types.plan import Subtask
from forestall.types.symbolic import scene_graph

STEP = "put_in(Plate-1, Microwave-1)"
DOMAIN = "household"


def kitchen(more: Sequence[str] = (), **microwave: Any) -> dict[str, Any]:
    return {
        "objects": {
            "Plate-1": {"box": [[0, 0, 0.8], [0.2, 0.2, 0.9]]},
            "Microwave-1": {"box": [[1, 0, 0.8], [1.4, 0.4, 1.1]], "open": "open", **microwave},
            "Bowl-1": {"box": [[1.1, 0.1, 0.8], [1.2, 0.2, 0.9]]},
        },
        "relations": ["Plate-1 held_by gripper", *more],
    }


def monitor(strategy: str, domain: str | None = DOMAIN) -> Monitor:
    shown = [[(STEP, kitchen()), kitchen()] for _ in range(4)]
    return Monitor.from_demonstrations(shown, domain, strategy=strategy)


@pytest.mark.parametrize("strategy", ["plan-check", "proactive"])
@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (kitchen(open="closd"), "unknown open of Microwave-1 'closd': did you mean closed"),
        (kitchen(open=False), "unknown open of Microwave-1 'no': known: closed, open"),
        (kitchen(opn="closed"), "unknown attribute of Microwave-1 'opn': did you mean open"),
        (kitchen(["Bowl-1 insde Microwave-1"]), "unknown relation 'insde': did you mean inside"),
    ],
)
def test_a_word_that_the_domain_lacks_is_refused_by_name(
    strategy: str, scene: dict[str, Any], said: str
) -> None:
    made = monitor(strategy)
    assert made.check(kitchen(), STEP).outcome is Outcome.PROCEED
    with pytest.raises(InputError) as refused:
        made.check(scene, STEP)
    assert said in str(refused.value)


def test_a_demonstration_with_one_is_refused_with_its_step() -> None:
    with pytest.raises(InputError, match=r"step 1: unknown relation 'insde': did you mean inside"):
        Monitor.from_demonstrations([(STEP, kitchen(["Bowl-1 insde Microwave-1"]))], DOMAIN)


def test_a_domain_that_is_learnt_may_meet_others_and_does_not_judge_them() -> None:
    made = monitor("proactive", None)
    assert made.check(kitchen(), STEP).outcome is Outcome.PROCEED
    for scene in (kitchen(["Bowl-1 insde Microwave-1"]), kitchen(cracked=True)):
        assert made.check(scene, STEP).outcome is Outcome.NOT_JUDGED


def test_a_relation_of_an_argument_that_nobody_knows_stays_in_scope() -> None:
    graph = scene_graph(kitchen(["Bowl-1 insde Microwave-1"]))
    cut = scope(graph, Subtask.parse(STEP), shipped(DOMAIN), ScopeConfig())
    assert ("Bowl-1", "insde", "Microwave-1") in {
        (r.subject, r.predicate, r.object) for r in cut.relations
    }
    assert cut.get("Bowl-1") is not None
    plain = scene_graph(kitchen())
    assert scope(plain, Subtask.parse(STEP), shipped(DOMAIN), ScopeConfig()).get("Bowl-1") is None


def test_directions_that_cameras_tell_are_no_words_that_a_domain_must_have() -> None:
    """Perception tells of every pair what is near and to the left, whether a domain asks or not."""
    household = shipped("household")
    few = {name: p for name, p in household.predicates.items() if name not in DIRECTIONS}
    told = kitchen(["Plate-1 near Microwave-1", "Plate-1 behind Bowl-1"])
    shown = [[(STEP, told), told] for _ in range(4)]
    made = Monitor.from_demonstrations(shown, replace(household, predicates=few))
    assert made.check(told, STEP).outcome is Outcome.PROCEED
