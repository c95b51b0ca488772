"""The judges on a household of others: a peg and a hole in a stranger's words."""

import json
import lzma
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from forestall.assembly import registry
from forestall.cli.main import call
from forestall.domain.load import read_domain
from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.experiments.third_party import ALL_TASKS, ITS_TASK, NO_DOMAIN, judge, without
from forestall.experiments.third_party_needs import EFFECTS, LEARNT, LIKELY, compare, table
from forestall.experiments.third_party_rows import NEEDS, PLAN, Judged, Knowledge, Said, rows
from forestall.types.foreign import ForeignRun
from forestall.types.plan import Plan
from forestall.types.symbolic import scene_graph
from stranger import GRASP, INSERT, UNSCREW, scene

DOMAIN = """
name = "pegs"
tags = ["movable"]
[roles]
holding = "held_by"
movable = "movable"
[robot]
hands = ["gripper"]
[predicates.held_by]
kind = "relation"
parameters = ["?x", "?hand"]
group = "place"
[predicates.lies_in]
kind = "relation"
parameters = ["?x", "?y"]
contains = true
group = "place"
[predicates.seated_in]
kind = "relation"
parameters = ["?x", "?y"]
contains = true
group = "place"
[attributes.surface]
values = ["clean", "dirty"]
[attributes.thread]
values = ["loose", "tight"]
[categories.peg]
tags = ["movable"]
[categories.hole]
attributes = ["surface"]
[categories.lid]
attributes = ["thread"]
[categories.tray]
[categories.driver]
[skills.unscrew]
parameters = ["?lid", "?hole"]
needs = ["thread(?lid)=tight"]
effects = ["thread(?lid)=loose"]
[skills.grasp]
parameters = ["?peg - movable"]
needs = ["not (some ?x: held_by(?x, gripper))"]
effects = ["held_by(?peg, gripper)"]
[skills.insert]
parameters = ["?peg - movable", "?hole", "?driver"]
needs = ["held_by(?peg, gripper)", "surface(?hole)=clean"]
effects = ["seated_in(?peg, ?hole)"]
"""


def run(number: int, change: str = "") -> ForeignRun:
    about = [f"bolt-{k}" for k in range(1, number % 3 + 1)]
    dirty = "dirty" if change else "clean"
    scenes = [
        scene(lid="tight", more=about, hole=dirty),
        scene(more=about, hole=dirty),
        scene("hand", more=about, hole=dirty),
        scene("hole", more=about, hole=dirty),
    ]
    graphs = [scene_graph(s) for s in scenes]
    return ForeignRun(
        f"{number}{change}",
        f"program-{number}",
        "close the box",
        Plan.parse([UNSCREW, GRASP, INSERT]),
        tuple(graphs[:3]),
        None if change else graphs[3],
        change,
    )


class Pegs:
    name = "pegs"
    hands: tuple[str, ...] = ("gripper",)
    geometry: tuple[str, ...] = ()
    exact = True

    def __init__(self, packages: Path | None = None, development: bool = False) -> None:
        self.good = () if development else tuple(run(n) for n in range(12))

    def failing(self) -> Iterator[ForeignRun]:
        yield from (run(n, "dirty hole") for n in (0, 1))

    def demonstrations(self, run: ForeignRun) -> tuple[ForeignRun, ...]:
        return tuple(g for g in self.good if g.program != run.program)

    def domains(self) -> Mapping[str, Domain]:
        return {"pegs": read_domain(DOMAIN, "pegs.toml")}


@pytest.fixture(scope="module")
def judged() -> list[Judged]:
    return judge(Pegs())


def test_every_run_is_judged_with_every_knowledge(judged: list[Judged]) -> None:
    assert len(judged) == 14 * 3
    assert {j.knowledge.domain for j in judged} == {NO_DOMAIN, "pegs"}
    assert {j.knowledge.memory for j in judged} == {ITS_TASK, ALL_TASKS}


def test_good_runs_are_no_alarms_and_the_dirty_hole_is_one(judged: list[Judged]) -> None:
    for row in rows(judged):
        if row.judge in (NEEDS, PLAN):
            assert row.false_alarms.value == 0.0, row
            assert row.false_alarms.n == 12 and row.detected.n == 2
        if row.judge == PLAN and row.knowledge.domain == "pegs":
            assert row.detected.value == 1.0
        if row.judge == NEEDS and row.knowledge.domain == NO_DOMAIN:
            assert row.detected.value == 1.0


def said(score: float, alarm: bool = False) -> Mapping[str, Said]:
    return dict.fromkeys(("score", NEEDS, PLAN), Said(score, alarm))


def test_calibration_leaves_out_the_program_itself() -> None:
    known = Knowledge(NO_DOMAIN, ITS_TASK)
    good = [Judged(f"{n}", f"{n}", "", known, (said(0.9), said(0.5 + n / 100))) for n in range(10)]
    bad = Judged("bad", "3", "changed", known, (said(0.9), said(0.4)))
    unseen = Judged("too mild", "0", "changed", known, (said(0.505),))
    row = next(r for r in rows([*good, bad, unseen]) if r.judge == f"{NEEDS}, calibrated")
    assert row.false_alarms.count == 1  # of ten the one that fits worst
    assert row.detected.value == 1.0 and row.at.value == 1.0


def test_needs_and_effects_are_compared_with_the_true_ones() -> None:
    pegs = Pegs()
    found = {r.what: r for r in table(compare(pegs, pegs.good))}
    assert found[LEARNT].recall.value == 1.0
    precision = found[LEARNT].precision.value
    assert precision is not None and precision < 1.0
    assert found[EFFECTS].recall.value == 1.0 and found[EFFECTS].skills == 3
    likely = found[LIKELY].precision.value
    assert likely is not None and likely > precision, "habits weigh less than needs"


def test_relations_that_are_mere_geometry_can_be_left_out() -> None:
    one = run(0)
    assert not without(one, ("lies_in",)).scenes[0].relations
    assert without(one, ()) is one


def test_a_household_without_good_runs_is_refused() -> None:
    with pytest.raises(InputError, match="no run that went well"):
        judge(Pegs(development=True))


def test_the_command_prints_and_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(registry, "FOREIGN", {"pegs": f"{__name__}:Pegs"})
    out = tmp_path / "found"
    assert call(["bench", "third-party", "pegs", "--quiet", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "pegs: 12 good programs, 2 failing runs" in printed and "dirty hole" in printed
    data: dict[str, Any] = json.loads(lzma.decompress((out / "results.json.xz").read_bytes()))
    tables = {p.stem: p.read_text().splitlines() for p in out.glob("*.csv")}
    assert set(tables) == {"judges", "changes", "needs"}
    assert len(tables["judges"]) == 1 + len(data["rows"])
    assert tables["judges"][1].startswith("none,its task,score,"), tables["judges"][1]
    assert len(data["runs"]) == 42 and data["rows"][0]["false_alarms"]["n"] == 12
    assert call(["bench", "third-party", "pegs", "--quiet", "--out", str(out)]) == 2
    with pytest.raises(UnknownNameError, match="unknown household 'nobody'"):
        registry.foreign("nobody")
