"""What `import forestall` gives: complete, light, and enough for a stranger's robot."""

from __future__ import annotations

import dataclasses
import inspect
import subprocess
import sys
import typing
from enum import Enum
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

import pytest

import forestall
from forestall import InputError, Monitor, MonitorConfig, Outcome, Subtask, seams
from stranger import GRASP, INSERT, TWELVE, UNSCREW, scene

MONITOR = Monitor.from_demonstrations(TWELVE)

OTHER_THINGS = {
    "objects": {"peg-7": {}, "hole-3": {"surface": "clean"}, "driver-2": {}},
    "relations": ["peg-7 held_by gripper"],
}
PIN = "pin-1 seated_in hole-1"
BYSTANDER = scene("hand", more=["bolt-1"], relations=["bolt-1 seated_in hole-1"])
PROCEED, REPLAN, HOLD, NOT = Outcome.PROCEED, Outcome.REPLAN, Outcome.HOLD, Outcome.NOT_JUDGED

TWENTY: list[tuple[str, dict[str, Any], str, Outcome, str]] = [
    ("as shown", scene("hand"), INSERT, PROCEED, ""),
    ("things about", scene("hand", more=["bolt-1", "cup-9"]), INSERT, PROCEED, ""),
    ("an unheard-of thing far off", scene("hand", more=["teapot"]), INSERT, PROCEED, ""),
    ("other instances", OTHER_THINGS, "insert(peg-7, hole-3, driver-2)", PROCEED, ""),
    ("by category", scene("hand"), "insert(peg, hole, driver)", PROCEED, ""),
    ("grasp as shown", scene(), GRASP, PROCEED, ""),
    ("unscrew as shown", scene(lid="tight"), UNSCREW, PROCEED, ""),
    ("what is no argument differs", scene("hand", lid="tight"), INSERT, PROCEED, ""),
    ("not held", scene(), INSERT, REPLAN, "it held peg-1 in all 12"),
    ("dirty", scene("hand", hole="dirty"), INSERT, HOLD, "hole-1 is dirty"),
    ("occupied", scene("hand", more=["pin-1"], relations=[PIN]), INSERT, HOLD, "pin-1"),
    ("never seen so", scene("hand", hole="cracked"), INSERT, HOLD, "hole-1 is cracked"),
    ("hand full", scene("hand", more=["peg-2"]), "grasp(peg-2)", HOLD, "the gripper holds peg-1"),
    ("a bystander in it", BYSTANDER, INSERT, HOLD, "bolt-1 is seated in hole-1"),
    ("held already", scene("hand"), GRASP, HOLD, "to bring about holds already"),
    ("in another place", scene("hole"), GRASP, HOLD, "peg-1"),
    ("loose already", scene(), UNSCREW, HOLD, "lid-1 is loose; it was tight"),
    ("argument gone", scene("hand", without=["hole-1"]), INSERT, NOT, "not located: hole-1"),
    ("argument out of view", scene("hand", unseen=["hole-1"]), INSERT, NOT, "not located: hole-1"),
    ("state not seen", scene("hand", hole=None), INSERT, NOT, "not observed: surface(hole-1)"),
    ("unknown relation", scene("hand", relations=["tray-1 covers hole-1"]), INSERT, NOT, "covers"),
    ("never shown", scene("hand"), "weld(peg-1)", NOT, "unknown skill 'weld'"),
    ("no such thing", scene("hand"), "grasp(cup)", NOT, "not located: cup"),
    ("of another kind", scene(), "grasp(lid-1)", NOT, "lid-1 is no peg, and no demonstration"),
    ("of no kind", scene(more=["cup-1"]), "grasp(cup-1)", NOT, "has a cup there"),
]


@pytest.mark.parametrize(
    ("seen", "subtask", "outcome", "said"), [c[1:] for c in TWENTY], ids=[c[0] for c in TWENTY]
)
def test_twenty_scenes_in_a_strangers_words(
    seen: dict[str, Any], subtask: str, outcome: Outcome, said: str
) -> None:
    decision = MONITOR.check(seen, subtask)
    assert decision.outcome is outcome, decision
    assert decision.may_start is (outcome is Outcome.PROCEED)
    assert said in str(decision)


@pytest.mark.parametrize("strategy", ["proactive", "plan-check"])
def test_words_that_nobody_knows_are_not_passed_over(strategy: str) -> None:
    monitor = Monitor.from_demonstrations(TWELVE, strategy=strategy)
    assert monitor.check(scene("hand"), INSERT).may_start
    sealed = scene("hand")
    sealed["objects"]["hole-1"]["seal"] = "glued"
    for seen, word in (
        (scene("hand", relations=["tray-1 covers hole-1"]), "covers"),
        (sealed, "the attribute seal"),
    ):
        decision = monitor.check(seen, INSERT)
        assert decision.outcome is Outcome.NOT_JUDGED and word in str(decision)
    elsewhere = scene("hand", relations=["tray-1 covers lid-1"])
    assert monitor.check(elsewhere, INSERT).may_start, "no argument of the subtask"


def test_a_corrected_plan_in_a_strangers_words() -> None:
    decision = MONITOR.check(scene(), INSERT)
    assert decision.plan is not None
    assert decision.plan.texts() == ["grasp(peg-1)", INSERT]


def test_one_demonstration_is_enough_for_an_alarm_that_says_so() -> None:
    decision = Monitor.from_demonstrations(TWELVE[0]).check(scene("hand", hole="dirty"), INSERT)
    assert decision.outcome is Outcome.HOLD
    assert "it was clean in the only demonstration there is" in str(decision)


def test_an_empty_hand_is_needed_after_two_demonstrations_too() -> None:
    full = {"objects": ["peg-1", "tray-1", "cup-1"], "relations": [
        "peg-1 lies_in tray-1", "cup-1 held_by gripper"]}  # fmt: skip
    decision = Monitor.from_demonstrations(TWELVE[:2]).check(full, GRASP)
    assert decision.outcome is Outcome.HOLD and "the gripper holds cup-1" in str(decision)


def test_a_plan_may_be_a_list_and_what_is_none_is_named() -> None:
    monitor = Monitor.from_demonstrations(TWELVE)
    monitor.start([GRASP, INSERT])
    assert monitor.before(scene()).command == Subtask.parse(GRASP)
    with pytest.raises(InputError, match="a task, a plan or a list of subtasks"):
        monitor.start("grasp(peg-1)")
    with pytest.raises(InputError, match="a subtask is a text"):
        monitor.check(scene(), None)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"a scene is a mapping.*not list"):
        monitor.check([scene()], GRASP)  # type: ignore[arg-type]
    monitor.before(scene())
    with pytest.raises(InputError, match="outcome of a subtask 'True'"):
        monitor.after(True)  # type: ignore[arg-type]


def test_a_run_by_hand() -> None:
    monitor = Monitor.from_demonstrations(TWELVE)
    monitor.start(forestall.Plan.parse([UNSCREW, GRASP, INSERT]))
    assert monitor.before(scene(lid="tight")).command == Subtask.parse(UNSCREW)
    monitor.after("done")
    assert monitor.before(scene()).outcome is Outcome.PROCEED
    again = monitor.after("failed", reason="it slipped")
    assert again is not None and again.plan is not None
    assert again.plan.texts() == [GRASP, INSERT]
    for seen in (scene(), scene("hand")):
        assert monitor.before(seen).may_start
        monitor.after("done")
    assert monitor.finished
    assert [str(e.subtask) for e in monitor.executed] == [UNSCREW, GRASP, GRASP, INSERT]


def test_a_caller_chooses_what_happens_where_nothing_was_judged() -> None:
    bold = MonitorConfig(on_not_judged="proceed")
    monitor = Monitor.from_demonstrations(TWELVE, config=bold)
    decision = monitor.check(scene("hand", hole=None), INSERT)
    assert (decision.outcome, decision.may_start) == (Outcome.NOT_JUDGED, True)


def test_parts_and_their_options_are_chosen_by_name() -> None:
    careful = {"name": "preconditions", "threshold": 0.05}
    monitor = Monitor.from_demonstrations(TWELVE, detector=careful)
    assert monitor.check(scene("hand", hole="dirty"), INSERT).outcome is Outcome.PROCEED
    paper = Monitor.from_demonstrations(TWELVE, detector="scene-graph")
    decision = paper.check(scene("hand", hole="dirty"), INSERT)
    assert decision.verdict is not None and decision.verdict.detector == "scene-graph"
    with pytest.raises(InputError, match="preconditions"):
        Monitor.from_demonstrations(TWELVE, detector="precondition")


def test_it_says_what_it_cannot_do() -> None:
    assert MONITOR.limits and len(MONITOR.demonstrations) == 12
    assert Monitor.from_demonstrations(TWELVE, MONITOR.domain).limits == ()


def test_every_public_name_is_there() -> None:
    assert sorted(forestall.__all__) == forestall.__all__
    for name in forestall.__all__:
        assert getattr(forestall, name) is not None
        assert name in dir(forestall)
    with pytest.raises(AttributeError, match="Monitr"):
        forestall.Monitr  # noqa: B018


def mentioned(annotation: Any) -> set[type]:
    """Every class in a type."""
    inner = {t for part in typing.get_args(annotation) for t in mentioned(part)}
    return inner | ({annotation} if isinstance(annotation, type) else set())


def test_the_public_surface_is_complete() -> None:
    """Whatever a public function takes or gives is itself public, or documented not to be."""
    public = {getattr(forestall, name) for name in forestall.__all__}
    internal = {"BoundaryContext", "BoundaryRecord", "Strategy", "Perceiver"}
    lacking = set()
    for owner in (Monitor, forestall.MonitorDecision, forestall.Verdict, forestall.Diagnosis):
        hints: list[Any] = []
        for name, found in inspect.getmembers(owner):
            if not name.startswith("_"):
                member = found.fget if isinstance(found, property) else found
                if inspect.isfunction(member) or inspect.ismethod(member):
                    hints += list(_hints(member).values())
        if dataclasses.is_dataclass(owner):
            hints += list(_hints(owner).values())
        used = {t for h in hints for t in mentioned(h)}
        lacking |= {t for t in used if t.__module__.startswith("forestall.") and t not in public}
    assert {t.__name__ for t in lacking if not issubclass(t, Enum)} <= internal | SECONDARY


SECONDARY = {
    *("Replan", "PlanCheck", "Reference", "ScoreParts", "Discrepancy", "View", "LooksAfter"),
    "Exchange",
}
"""What an answer holds for records and pages, read by attribute and never made by a caller."""


def _hints(thing: Any) -> dict[str, Any]:
    from forestall.domain.model import Domain
    from forestall.seams import Perceiver, Strategy
    from forestall.types.episode import BoundaryRecord
    from forestall.types.runtime import BoundaryContext

    known = {c.__name__: c for c in (Domain, Perceiver, Strategy, BoundaryRecord, BoundaryContext)}
    return typing.get_type_hints(thing, localns=known)


def test_importing_loads_nothing_heavy() -> None:
    code = (
        "import sys, forestall; assert 'numpy' not in sys.modules; "
        "forestall.Subtask; assert 'scipy' not in sys.modules; "
        "print(sorted(m for m in sys.modules if m.startswith('forestall')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "forestall.assembly" not in done.stdout


def test_every_protocol_of_the_seams_can_be_had_from_the_package() -> None:
    modules = [import_module(f"forestall.seams.{m.name}") for m in iter_modules(seams.__path__)]
    defined = {
        name
        for module in modules
        for name, value in vars(module).items()
        if getattr(value, "_is_protocol", False) and value.__module__ == module.__name__
    }
    assert len(defined) > 30
    assert defined == set(seams.__all__)
