"""Whether a start fails when nobody steps in: its plan is played in a world, and the truth asked.

Called by `drawing` and the command line; calls a world (through its part), the faults, the goal
check. Nothing is perceived and nothing judged on the way, so that a start costs a fraction of an
episode; a refused step is passed over, as in a run without a monitor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from forestall.domain.model import Domain
from forestall.domain.truth import truth as truth_of
from forestall.errors import ForestallError
from forestall.perception.config import ScopeConfig
from forestall.perception.scope import scope
from forestall.seams.acting import OracleView, WorldPart
from forestall.tasks.aftermath import left, superfluous
from forestall.tasks.execution_faults import FaultyEnvironment
from forestall.tasks.eyes import SharedEyes
from forestall.tasks.faults import apply_plan_faults, apply_scene_faults, check_steps, wrap
from forestall.tasks.files import LoadedTask, Scenario
from forestall.tasks.goals import TruthGoalChecker, irreversible
from forestall.types.episode import SkillStatus
from forestall.types.facts import Literal, Truth
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask

Seen = frozenset[tuple[str, ...]]
"""What is compared before a step: states and relations as facts."""


class Label(StrEnum):
    """What playing a start in several rooms says about it."""

    FAILS = "fails"
    SUCCEEDS = "succeeds"
    SPOILS = "succeeds and spoils something else"
    STUMBLES = "succeeds although a step that was needed is refused"
    LEAVES = "succeeds and leaves something as the domain's safety rules forbid"
    LOST = "is lost before anybody could do anything"
    MIXED = "differs from room to room"
    IMPOSSIBLE = "cannot be built"


@dataclass(frozen=True, slots=True)
class Played:
    """One start, played to its end without a monitor.

    Args:
        success: by the strict check.
        failures: what the check says.
        refused: (position in the plan, reason) of every refusal.
        harmed: the first step that did what must never happen, None where nothing did.
        seen: for each step the part of the true scene that is compared before it, if asked for.
        visible: the first step before which what is watched is in view (the number of steps where
            it never is); `since` if nothing is.
        lost: whether the harm was there from the start.
        history: what has happened that cannot be undone, whether or not the goal is about it.
        problem: why the start could not be built; then nothing else is told.
        stumbled: whether a refused step had something left to do.
        left: names of the safety rules that are broken at the end and were not at the start.
    """

    success: bool
    failures: tuple[str, ...] = ()
    refused: tuple[tuple[int, str], ...] = ()
    harmed: int | None = None
    seen: tuple[Seen, ...] = ()
    visible: int = 0
    lost: bool = False
    history: frozenset[Literal] = frozenset()
    problem: str = ""
    stumbled: bool = False
    left: frozenset[str] = frozenset()


def play(
    world: WorldPart,
    loaded: LoadedTask,
    scenario: Scenario | None,
    seed: int,
    looking: bool = False,
    watch: Sequence[str] = (),
    since: int = 0,
    also: Sequence[tuple[int, Sequence[str]]] = (),
) -> Played:
    """Play a task with a scenario's faults in one room.

    Args:
        world: makes the world.
        loaded: the task.
        scenario: what is different; None for the undisturbed task.
        seed: of the room.
        looking: whether to keep what is compared before each step.
        watch: ("thing", name) or ("inside", container): what `visible` is about.
        since: the first step before which it counts.
        also: `since` and `watch` of what else is different.
    """
    shows = ((since, watch), *also)
    task, domain = loaded.task, loaded.domain
    faults = () if scenario is None else scenario.faults
    try:
        needs = apply_scene_faults(task.scene, faults, domain)
        plan = apply_plan_faults(task.plan, faults, domain)
        check_steps(plan, faults, domain)
        with world.open(needs, domain) as opened:
            env = wrap(opened.environment, faults, opened.disturbance, domain)
            env.reset(seed)
            before = left(opened.oracle.truth(), domain)
            refused, seen, stumbled = [], [], False
            told = [len(opened.oracle.events())]
            visible = None
            for at, step in enumerate(plan):
                if visible is None and any(
                    at >= first and _in_view(opened.oracle.truth(), what, domain)
                    for first, what in shows
                ):
                    visible = at
                if looking:
                    seen.append(compared(opened.oracle.truth(), step, domain))
                outcome = env.execute(step)
                told.append(len(opened.oracle.events()))
                if outcome.status is SkillStatus.REFUSED:
                    refused.append((at, outcome.reason))
                    stumbled |= not superfluous(opened.oracle.truth(), step, domain)
            success, _, failures = TruthGoalChecker(domain).check(task.goal, opened.oracle)
            harmed = _first_harm(loaded, opened.oracle, told)
            history = opened.oracle.history()
            after = left(opened.oracle.truth(), domain)
    except ForestallError as error:
        return Played(False, problem=str(error))
    idle = env.idle if isinstance(env, FaultyEnvironment | SharedEyes) else 0
    problem = f"{idle} fault(s) did not happen" if idle else ""
    visible = len(plan) if visible is None else visible
    return Played(
        success,
        failures,
        tuple(refused),
        None if harmed is None else max(harmed, 0),
        tuple(seen),
        visible,
        harmed == -1,
        history,
        problem,
        stumbled,
        after - before,
    )


def label(plays: Sequence[Played], usual: frozenset[str] = frozenset()) -> Label:
    """What several rooms say together.

    Args:
        plays: of one start.
        usual: the safety rules that the task itself breaks (a burner that is to be on).
    """
    if any(p.problem for p in plays):
        return Label.IMPOSSIBLE
    outcomes = {p.success for p in plays}
    if len(outcomes) != 1:
        return Label.MIXED
    if outcomes == {True}:
        if any(p.history for p in plays):
            return Label.SPOILS
        if any(p.stumbled for p in plays):
            return Label.STUMBLES
        return Label.LEAVES if any(p.left - usual for p in plays) else Label.SUCCEEDS
    done = any(p.lost or (p.harmed is not None and p.harmed < p.visible) for p in plays)
    return Label.LOST if done else Label.FAILS


def compared(truth: SceneGraph, step: Subtask, domain: Domain) -> Seen:
    """The facts of the true scene that concern a step, geometry left out."""
    scoped = scope(truth, step, domain, ScopeConfig())
    hidden = {n.id for n in truth.nodes if _shut_away(truth, n.id, domain)}
    facts = {(n.id, a, str(v)) for n in scoped.nodes if n.id not in hidden for a, v in n.states}
    relations = {(r.predicate, r.subject, r.object) for r in scoped.relations}
    relations = {r for r in relations if r[1] not in hidden}
    return frozenset({("step", str(step)), *facts, *relations})


def fixtures_in(world: WorldPart, loaded: LoadedTask, seed: int) -> set[str]:
    """Categories of the fixtures that a task's room has."""
    domain = loaded.domain
    with world.open(loaded.task.scene, domain) as opened:
        opened.environment.reset(seed)
        nodes = opened.oracle.truth().nodes
    ground = set(domain.tagged(domain.roles.ground))
    fixtures = {n.category for n in nodes if domain.is_a(n.category, domain.roles.fixture)}
    return fixtures - ground


def _in_view(graph: SceneGraph, watch: Sequence[str], domain: Domain) -> bool:
    if not watch:
        return True
    sort, name = watch
    if sort == "inside":
        return not _is_shut(graph, name, domain)
    return graph.get(name) is not None and not _shut_away(graph, name, domain)


def _shut_away(graph: SceneGraph, name: str, domain: Domain) -> bool:
    parents = graph.parents(name, domain.containing)
    return any(
        (domain.encloses(p) and _is_shut(graph, p, domain)) or _shut_away(graph, p, domain)
        for p in parents
    )


def _is_shut(graph: SceneGraph, name: str, domain: Domain) -> bool:
    shut = domain.roles.shut
    if shut is None:
        return False
    return truth_of(graph, Literal(shut, (name,)), domain) is Truth.TRUE


def _first_harm(loaded: LoadedTask, oracle: OracleView, told: Sequence[int]) -> int | None:
    """The step during which something that must never happen first happened; -1: before any.

    Args:
        loaded: the task.
        oracle: after the run.
        told: how many events there were at the start and after each step.
    """
    found = irreversible(loaded.task.goal, oracle, loaded.domain)
    if not found:
        return None
    events = [(e.time_s, e.text) for e in oracle.events()]
    at = min((events.index(f) for f in found if f in events), default=-1)
    if any(f not in events for f in found):
        return -1
    return next((k - 1 for k, count in enumerate(told) if at < count), len(told) - 2)
