"""Programs executed by the package itself; skipped where it is not installed."""

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest
from flats import FETCH, FRIDGE, LIGHT, ME, PLATE, installed

from forestall import Monitor, Outcome
from forestall.domain.model import Domain
from forestall.testing.conformance import check_environment
from forestall.types.graph import Relation
from forestall.types.plan import Plan, Subtask
from forestall.worlds.virtualhome.evolving import Evolving
from forestall.worlds.virtualhome.household import Household
from forestall.worlds.virtualhome.importer import carried_out
from forestall.worlds.virtualhome.packages import Flat, Line, Packages, Program, read_start
from forestall.worlds.virtualhome.pddl import Kinds, as_published
from forestall.worlds.virtualhome.world import FlatWorld

pytestmark = pytest.mark.skipif(
    find_spec("virtualhome") is None, reason="the package virtualhome is not installed"
)

CHARACTER, IT, BOX = f"character-{ME}", f"plate-{PLATE}", f"fridge-{FRIDGE}"


@pytest.fixture
def packages(tmp_path: Path) -> Packages:
    data = Packages.found(installed(tmp_path, {"a": FETCH, "b": LIGHT}))
    spec = find_spec("virtualhome")
    assert spec is not None and spec.submodule_search_locations is not None
    return replace(data, engine=Path(spec.submodule_search_locations[0]))


@pytest.fixture
def fetch(packages: Packages) -> tuple[Program, Flat]:
    program = packages.programs()[0]
    return program, read_start(program.graphs)


@pytest.fixture
def domain(packages: Packages, fetch: tuple[Program, Flat]) -> Domain:
    kinds = Kinds()
    kinds.see(fetch[1])
    return as_published(packages.pddl, kinds)


def test_a_program_that_runs_is_a_demonstration(
    packages: Packages, fetch: tuple[Program, Flat]
) -> None:
    run = carried_out(packages, *fetch)
    assert run.fails is None and run.final is not None
    assert [s.skill for s in run.plan] == ["walk_towards", "open", "find", "grab"]
    before, after = run.scenes[0], run.final
    assert Relation(IT, "obj_inside", BOX) in before.relations
    assert Relation(CHARACTER, "next_to", BOX) not in before.relations
    assert Relation(CHARACTER, "next_to", BOX) in run.scenes[1].relations
    fridge = run.scenes[2].get(BOX)
    assert fridge is not None and fridge.state("opening") == "open"
    assert Relation(IT, "held_by", "right_gripper") in after.relations
    shown = run.demonstration()
    assert shown.task == "Fetch a plate" and shown.after(3) == after


def test_a_step_that_is_refused_ends_the_run_with_its_reason(
    packages: Packages, fetch: tuple[Program, Flat]
) -> None:
    program, start = fetch
    without = replace(program, lines=(program.lines[0], *program.lines[2:]))
    run = carried_out(packages, without, start, change="no OPEN")
    assert run.fails == 2 and len(run.scenes) == 3
    assert "inside other closed thing" in run.why


def test_what_the_evolving_graph_cannot_do_is_a_refusal(
    packages: Packages, fetch: tuple[Program, Flat]
) -> None:
    flat = Evolving(packages.evolving_graph, fetch[1])
    for line, said in (
        (Line("DANCE"), "no action"),
        (Line("GRAB"), "takes 1 argument"),
        (Line("GRAB", (("ghost", 99),)), "there is no thing 99"),
        (Line("PUTOFF", (("plate", PLATE),)), "cannot: TypeError"),
    ):
        assert said in str(flat.act(line))


def test_the_flat_conforms(packages: Packages, fetch: tuple[Program, Flat], domain: Domain) -> None:
    program, start = fetch
    steps = carried_out(packages, program, start).plan.subtasks
    make = lambda: FlatWorld(packages.evolving_graph, start, program.ids)  # noqa: E731
    assert check_environment(make, 0, steps, domain) == []


def test_from_alarm_to_success(
    packages: Packages, fetch: tuple[Program, Flat], domain: Domain
) -> None:
    program, start = fetch
    shown = [replace(carried_out(packages, program, start), name=str(n)) for n in range(4)]
    monitor = Monitor.from_demonstrations(
        [r.demonstration() for r in shown],
        domain,
        strategy={"name": "proactive", "judges": ("plan-check",)},
    )
    world = FlatWorld(packages.evolving_graph, start, program.ids)
    near = Subtask("walk_towards", (CHARACTER, BOX))
    monitor.start(Plan((near, Subtask("find", (CHARACTER, IT)), Subtask("grab", (CHARACTER, IT)))))
    alarms = looks = 0
    while not monitor.finished:
        decision = monitor.before(world.truth())
        if decision.outcome in (Outcome.LOOK, Outcome.REPLAN):
            alarms += decision.outcome is Outcome.REPLAN
            looks += 1
            assert looks < 9
            continue
        assert decision.may_start and decision.command is not None, str(decision)
        outcome = world.execute(decision.command)
        monitor.after(outcome)
    assert alarms
    assert Relation(IT, "held_by", "right_gripper") in world.truth().relations


def test_a_household_makes_good_and_failing_runs(packages: Packages, tmp_path: Path) -> None:
    (tmp_path / "virtualhome").rmdir()
    (tmp_path / "virtualhome").symlink_to(packages.engine)
    household = Household(tmp_path, development=True)
    assert household.tasks == ("Fetch a plate", "Light")
    assert [r.task for r in household.good] == ["Fetch a plate", "Light"]
    assert {r.change for r in household.failing()} >= {"no OPEN", "sitting", "unplugged"}
    assert household.demonstrations(household.good[0]) == ()
    assert Household(tmp_path).good == ()
