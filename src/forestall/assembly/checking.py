"""Judging a stored observation of the user's own (no simulator, nothing is executed).

Calls: command line → here → parts, perception. Composition like `make`, for `forestall check`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from forestall.assembly.configuration import Given, choices, run_config
from forestall.assembly.make import STORED_STATES
from forestall.assembly.options import built
from forestall.assembly.parts import Assembly
from forestall.assembly.registry import find, known
from forestall.domain.model import Domain
from forestall.domain.names import ground_subtask
from forestall.errors import UnknownNameError
from forestall.kinds import DETECTOR, DOMAIN, PERCEIVER, REASONER, RETRIEVER, STATES
from forestall.perception.folder import read_observation
from forestall.types.demonstration import Demonstration
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.scene import SceneNeeds
from forestall.types.task import Goal, Task
from forestall.types.verdict import Decision, Diagnosis, Verdict

TRUTH_STATES = "oracle"
"""The simulator's own, which no stored observation has."""

DEFAULTS = Given.named({"segmenter": "given-masks", "states": STORED_STATES})
"""What a stored observation brings with it: its masks and, if nothing else reads them, states."""


def judge_stored(
    folder: Path,
    subtask: str,
    task: str | None,
    demonstrations: Sequence[Demonstration],
    given: Given | None = None,
) -> tuple[SceneGraph, Verdict, Diagnosis | None]:
    """The scoped graph, the verdict, and on an alarm the diagnosis.

    Args:
        folder: the observation, see docs/observation-format.md.
        subtask: in text form.
        task: name or file of the task; its own demonstrations are preferred.
        demonstrations: the memory.
        given: what was said about parts: the detector's threshold, what reads states off pictures.

    Raises:
        InputError: a name, the observation or the subtask is not valid.
    """
    chosen = choices((given or Given()).over(DEFAULTS))
    names = {c.kind: c.name for c in chosen}
    if names[STATES.name] == TRUTH_STATES:
        readable = [n for n in known(STATES.name) if n != TRUTH_STATES]
        raise UnknownNameError("states of a stored observation", TRUTH_STATES, readable)
    loaded = None if task is None else run_config(task, given=given).load()
    own = find(DOMAIN.name, names[DOMAIN.name])
    domain: Domain = built(own, {}, None) if loaded is None else loaded.domain
    wanted = domain.check(Subtask.parse(subtask))
    for name in wanted.args:
        domain[name]
    observation, stated = read_observation(folder, domain)
    parts = Assembly(chosen, domain, demonstrations, {"states": stated})
    perceiver = parts.part(PERCEIVER)
    graph = perceiver.perceive(observation)
    ground = ground_subtask(wanted, graph, domain, observation.robot_position_world_m, {})
    scoped = perceiver.scope(graph, ground)
    name = "" if loaded is None else loaded.task.name
    steps = () if loaded is None else loaded.task.plan.subtasks
    done = steps.index(wanted) if wanted in steps else 0
    references = tuple(parts.part(RETRIEVER).retrieve(ground, name, done))
    verdict = parts.part(DETECTOR).judge(scoped, observation, references)
    if verdict.decision is Decision.PROCEED:
        return scoped, verdict, None
    plan = Plan((wanted,))
    context = BoundaryContext(
        task=loaded.task if loaded is not None else Task(name, name, Goal(""), plan, SceneNeeds()),
        plan=plan,
        index=0,
        done=done,
        subtask=ground,
        graph=graph,
        scoped=scoped,
        observation=observation,
        references=references,
    )
    return scoped, verdict, parts.part(REASONER).diagnose(context, verdict)
