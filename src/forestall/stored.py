"""Judging a stored observation of the user's own (no simulator, nothing is executed).

Calls: command line → here → build, perception. Composition like `build.py`, for `forestall check`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from forestall.comparison.preconditions import mine, violations
from forestall.diagnosis.symbolic import SymbolicReasoner
from forestall.domain.load import shipped
from forestall.domain.names import ground_subtask
from forestall.embeddings.hashed import HashedTextEncoder
from forestall.errors import UnknownNameError
from forestall.memory.retrieval import EmbeddingRetriever
from forestall.parts import RunConfig, make_detector, make_state_estimator
from forestall.perception.folder import read_observation
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import GivenMasks
from forestall.registry import known
from forestall.tasks.files import load_task
from forestall.types.demonstration import Demonstration
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.scene import SceneNeeds
from forestall.types.task import Goal, Task
from forestall.types.verdict import Decision, Diagnosis, Verdict


def judge_stored(
    folder: Path,
    subtask: str,
    task: str | None,
    demonstrations: Sequence[Demonstration],
    threshold: float,
    states: str = "given",
) -> tuple[SceneGraph, Verdict, Diagnosis | None]:
    """The scoped graph, the verdict, and on an alarm the diagnosis.

    Args:
        folder: the observation, see docs/observation-format.md.
        subtask: in text form.
        task: name or file of the task; its own demonstrations are preferred.
        demonstrations: the memory.
        threshold: of the detector.
        states: "given", those in the folder; or what reads them off its pictures.

    Raises:
        InputError: a name, the observation or the subtask is not valid.
    """
    loaded = None if task is None else load_task(task)
    domain = shipped("household") if loaded is None else loaded.domain
    wanted = domain.check(Subtask.parse(subtask))
    for name in wanted.args:
        domain[name]
    if states not in known("states") or states == "oracle":
        options = [n for n in known("states") if n != "oracle"]
        raise UnknownNameError("states of a stored observation", states, options)
    observation, given = read_observation(folder, domain)
    estimator = (
        GivenStateEstimator(given) if states == "given" else make_state_estimator(states, domain)
    )
    perceiver = GraphPerceiver(GivenMasks(), estimator, domain)
    graph = perceiver.perceive(observation)
    ground = ground_subtask(wanted, graph, domain, observation.robot_position_world_m, {})
    scoped = perceiver.scope(graph, ground)
    name = "" if loaded is None else loaded.task.name
    steps = () if loaded is None else loaded.task.plan.subtasks
    done = steps.index(wanted) if wanted in steps else 0
    encoder = HashedTextEncoder()
    references = tuple(
        EmbeddingRetriever(demonstrations, encoder, domain).retrieve(ground, name, done)
    )
    detector = make_detector(RunConfig(name, threshold=threshold), domain)
    verdict = detector.judge(scoped, observation, references)
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
    reasoner = SymbolicReasoner(mine, violations, domain)
    return scoped, verdict, reasoner.diagnose(context, verdict)
