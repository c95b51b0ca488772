"""Configuration → objects: where implementations of different families meet.

Calls: command line → here → runtime, environment, perception, memory, comparison, planning. The
oracle view of an environment is handed to exactly three places here: the oracle state estimator,
when that is the one asked for, the scorer, and the trace of the truth that an experiment may keep.
"""

from __future__ import annotations

import platform
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import forestall
from forestall.comparison.preconditions import MiningConfig
from forestall.config import DEMONSTRATION_SEEDS, PICTURE_SEEDS
from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.memory.retrieval import RetrievalConfig
from forestall.parts import (
    STATES,
    RunConfig,
    check_parts,
    make_state_estimator,
    make_strategy,
    node_encoder,
    score_options,
)
from forestall.perception.config import PerceptionConfig, ScopeConfig
from forestall.perception.perceiver import GraphPerceiver
from forestall.planning.search import SearchConfig
from forestall.registry import known, load
from forestall.runtime import Runtime, RuntimeConfig
from forestall.seams import Listener
from forestall.tasks.faults import (
    Fault,
    apply_plan_faults,
    apply_scene_faults,
    check_steps,
    wrap,
)
from forestall.tasks.files import LoadedTask, Scenario, load_scenario, load_task
from forestall.tasks.goals import TruthGoalChecker, irreversible
from forestall.tasks.truth import TruthTrace
from forestall.types.demonstration import Demonstration
from forestall.types.episode import EpisodeRecord
from forestall.types.plan import Plan
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.rendering import RENDERERS, FrameMemory

__all__ = ["RUN_STATES", "STATES", "Prepared", "RunConfig", "prepare", "provenance", "run_episode"]

OPTIONS = (
    MiningConfig(),
    PerceptionConfig(),
    RetrievalConfig(),
    RuntimeConfig(),
    ScopeConfig(),
    SearchConfig(),
)
"""The options of the parts as every run uses them; with the score's they go into the record."""

RUN_STATES = tuple(n for n in known("states") if n != "given")
"""Where a run's object states may come from; given ones belong to stored observations."""


@dataclass(frozen=True, slots=True)
class Prepared:
    """A checked run: what the files say, before anything is built."""

    config: RunConfig
    loaded: LoadedTask
    scenario: Scenario | None

    @property
    def plan(self) -> Plan:
        """The plan to start with: the nominal one with the scenario's changes."""
        return apply_plan_faults(self.loaded.task.plan, self.faults, self.loaded.domain)

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The scenario's faults, none for an undisturbed run."""
        return () if self.scenario is None else self.scenario.faults


def prepare(config: RunConfig) -> Prepared:
    """Read and check task, scenario and names.

    Raises:
        InputError: anything that does not fit, each with what would be valid.
    """
    loaded = load_task(config.task)
    check_parts(config)
    if config.states not in RUN_STATES:
        raise UnknownNameError("states of a run", config.states, RUN_STATES)
    if config.renderer not in RENDERERS:
        raise UnknownNameError("renderer", config.renderer, RENDERERS)
    scenario = None if config.scenario is None else load_scenario(config.scenario)
    if scenario is not None and scenario.task != loaded.task.name:
        raise InputError(
            f"scenario {scenario.name} is for the task {scenario.task}, not {loaded.task.name}"
        )
    if config.seed < 0:
        raise InputError(f"seed {config.seed} is negative; seeds are 0, 1, 2, ...")
    if config.seed >= DEMONSTRATION_SEEDS and config.strategy != "none":
        raise InputError(f"seed {config.seed}: from {DEMONSTRATION_SEEDS} on are demonstrations")
    if config.seed >= PICTURE_SEEDS["train"]:
        raise InputError(f"seed {config.seed}: from {PICTURE_SEEDS['train']} on are pictures")
    prepared = Prepared(config, loaded, scenario)
    if scenario is not None:
        try:
            apply_scene_faults(loaded.task.scene, prepared.faults, loaded.domain)
            check_steps(prepared.plan, prepared.faults, loaded.domain)
            scenario.moments(prepared.plan)
        except InputError as error:
            raise InputError(f"scenario {scenario.name}: {error}") from error
    return prepared


def run_episode(
    prepared: Prepared,
    demonstrations: Sequence[Demonstration] | None,
    listeners: Sequence[Listener] = (),
    memory: str | None = None,
    trace: TruthTrace | None = None,
    frames: FrameMemory | None = None,
) -> EpisodeRecord:
    """Build everything and run one episode.

    Args:
        prepared: from `prepare`.
        demonstrations: the memory; None only for a strategy that uses none.
        listeners: told what happens.
        memory: where the demonstrations come from, for the record.
        trace: keeps what is true at each boundary, for scoring.
        frames: pictures that were drawn before.
    """
    config, loaded, task = prepared.config, prepared.loaded, prepared.loaded.task
    needs = apply_scene_faults(task.scene, prepared.faults, loaded.domain)
    kitchen = KitchenEnvironment(needs, loaded.domain, config.renderer, frames=frames)
    if trace is not None:
        trace.attach(kitchen.oracle, loaded.domain)
        listeners = (*listeners, trace)
    try:
        perceiver = GraphPerceiver(
            load("segmenter", config.segmenter)(),
            _state_estimator(config.states, kitchen, loaded.domain),
            loaded.domain,
            image_encoder=node_encoder(config),
        )
        runtime = Runtime(
            wrap(kitchen, prepared.faults, kitchen, loaded.domain),
            perceiver,
            make_strategy(config, loaded.domain, demonstrations),
            loaded.domain,
            listeners,
            RuntimeConfig(keep_observations=config.keep_observations, final_look=config.final_look),
        )
        return runtime.run(
            task,
            prepared.plan,
            config.seed,
            None if prepared.scenario is None else prepared.scenario.name,
            _scorer(kitchen, loaded.domain),
            (
                *provenance(config),
                ("memory", memory),
                ("demonstrations", [{"id": d.id, "seed": d.seed} for d in demonstrations or ()]),
                ("inputs", {"task": repr(loaded.task), "scenario": repr(prepared.scenario)}),
            ),
        )
    finally:
        kitchen.close()


def provenance(config: RunConfig) -> tuple[tuple[str, Any], ...]:
    """What is needed to run the same again."""
    packages = ("numpy", "scipy", "mujoco-core", "embreex", "onnxruntime")
    return (
        ("config", asdict(config)),
        ("options", {type(o).__name__: asdict(o) for o in (*OPTIONS, score_options(config))}),
        (
            "versions",
            {
                "forestall": forestall.__version__,
                "python": sys.version.split()[0],
                **{name: _version(name) for name in packages},
                "platform": platform.platform(),
            },
        ),
    )


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _state_estimator(name: str, kitchen: KitchenEnvironment, domain: Domain) -> Any:
    if name == "oracle":
        return load("states", name)(kitchen.oracle.states, domain)
    return make_state_estimator(name, domain)


def _scorer(
    kitchen: KitchenEnvironment, domain: Domain
) -> Callable[[EpisodeRecord], EpisodeRecord]:
    def score(record: EpisodeRecord) -> EpisodeRecord:
        strict, weak, failures = TruthGoalChecker(domain).check(record.task.goal, kitchen.oracle)
        return replace(
            record,
            success=strict,
            weak_success=weak,
            failures=(*record.failures, *failures),
            events=kitchen.oracle.events(),
            harmed=irreversible(record.task.goal, kitchen.oracle, domain),
        )

    return score
