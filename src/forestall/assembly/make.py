"""Configuration → a run: task, scenario, world, perception and strategy put together.

Calls: command line, experiments → here → registry (through `parts`), runtime. The oracle view of a
world is handed to exactly three places here: the oracle state estimator, when that is the one asked
for, the scorer, and the trace of the truth that an experiment may keep.
"""

from __future__ import annotations

import platform
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import forestall
from forestall.assembly.configuration import RunConfig, digest_of
from forestall.assembly.corrections import described, remembering
from forestall.assembly.options import built
from forestall.assembly.parts import Assembly
from forestall.assembly.registry import find, known
from forestall.config import DEMONSTRATION_SEEDS, PICTURE_SEEDS
from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.kinds import LIMIT, PERCEIVER, SEGMENTER, SENSOR, STATES, STRATEGY, WORLD
from forestall.runtime import Runtime, RuntimeConfig
from forestall.seams.acting import Environment, OpenWorld, OracleView, WorldPart
from forestall.seams.judging import Strategy
from forestall.seams.running import Listener
from forestall.tasks.edge import WorldsEdge, named
from forestall.tasks.faults import (
    Fault,
    apply_plan_faults,
    apply_scene_faults,
    check_steps,
    wrap,
)
from forestall.tasks.files import LoadedTask, Scenario, load_scenario
from forestall.tasks.goals import TruthGoalChecker, irreversible
from forestall.tasks.truth import TruthTrace
from forestall.types.demonstration import Demonstration
from forestall.types.episode import EpisodeRecord
from forestall.types.plan import Plan

STORED_STATES = "given"
"""The states of stored observations, which no run has."""

WITHOUT_MEMORY = ("none", "plan-check", "retry-once")
"""Strategies that compare with no demonstration."""

PACKAGES = ("numpy", "scipy", "mujoco-core", "embreex", "onnxruntime")
"""Whose versions stand in every record."""


@dataclass(frozen=True, slots=True)
class Prepared:
    """A checked run: what the files say, before anything is built.

    `model` is the domain as the monitor knows it, where that is another than the task's: what is
    true, and what is scored, stays as the task has it.
    """

    config: RunConfig
    loaded: LoadedTask
    scenario: Scenario | None
    model: Domain | None = None

    @property
    def plan(self) -> Plan:
        """The plan to start with: the nominal one with the scenario's changes."""
        return apply_plan_faults(self.loaded.task.plan, self.faults, self.loaded.domain)

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The scenario's faults, none for an undisturbed run."""
        return () if self.scenario is None else self.scenario.faults


def prepare(config: RunConfig) -> Prepared:
    """Read and check task and scenario against each other and the configuration.

    Raises:
        InputError: anything that does not fit, each with what would be valid.
    """
    loaded = config.load()
    if config.choice(STATES).name == STORED_STATES:
        of_runs = [n for n in known(STATES.name) if n != STORED_STATES]
        raise UnknownNameError("states of a run", STORED_STATES, of_runs)
    make_world(config, loaded.domain)
    scenario = None if config.scenario is None else load_scenario(config.scenario)
    if scenario is not None and scenario.task != loaded.task.name:
        raise InputError(
            f"scenario {scenario.name} is for the task {scenario.task}, not {loaded.task.name}"
        )
    if config.seed < 0:
        raise InputError(f"seed {config.seed} is negative; seeds are 0, 1, 2, ...")
    if config.seed >= DEMONSTRATION_SEEDS and needs_memory(config):
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


def needs_memory(config: RunConfig) -> bool:
    """Whether a run compares with demonstrations."""
    return config.choice(STRATEGY).name not in WITHOUT_MEMORY


def make_world(config: RunConfig, domain: Domain) -> WorldPart:
    """What makes the worlds of a run."""
    return Assembly(config.choices, domain).part(WORLD)


def make_strategy(
    config: RunConfig, domain: Domain, demonstrations: Sequence[Demonstration] | None
) -> Strategy:
    """The strategy with its collaborators, without a world."""
    return Assembly(config.choices, domain, demonstrations).part(STRATEGY)


def run_episode(
    prepared: Prepared,
    demonstrations: Sequence[Demonstration] | None,
    listeners: Sequence[Listener] = (),
    memory: str | None = None,
    trace: TruthTrace | None = None,
    world: WorldPart | None = None,
    beside: Mapping[str, Any] | None = None,
) -> EpisodeRecord:
    """Build everything and run one episode.

    Args:
        prepared: from `prepare`.
        demonstrations: the memory; None only for a strategy that uses none.
        listeners: told what happens.
        memory: where the demonstrations come from, for the record.
        trace: keeps what is true at each boundary, for scoring.
        world: made before and used again, so that it may remember what it drew.
        beside: which run this is the same start of, for the record.
    """
    loaded = prepared.loaded
    needs = apply_scene_faults(loaded.task.scene, prepared.faults, loaded.domain)
    part = world or make_world(prepared.config, loaded.domain)
    with part.open(needs, loaded.domain, remember=world is not None) as opened:
        environment = make_environment(prepared, opened)
        if trace is not None:
            meanings = environment if isinstance(environment, WorldsEdge) else None
            trace.attach(opened.oracle, loaded.domain, meanings)
            listeners = (*listeners, trace)
        runtime = make_runtime(prepared, opened, environment, demonstrations, listeners, memory)
        return runtime.run(
            loaded.task,
            prepared.plan,
            prepared.config.seed,
            None if prepared.scenario is None else prepared.scenario.name,
            _scorer(opened.oracle, loaded.domain),
            (
                *provenance(prepared.config),
                ("memory", memory),
                ("corrections", described(prepared.config.choices, memory)),
                ("demonstrations", [{"id": d.id, "seed": d.seed} for d in demonstrations or ()]),
                (
                    "inputs",
                    {
                        "task": repr(loaded.task),
                        "scenario": repr(prepared.scenario),
                        "domain": digest_of(loaded.domain),
                        "model": None if prepared.model is None else digest_of(prepared.model),
                    },
                ),
                *(() if beside is None else (("beside", dict(beside)),)),
            ),
        )


def make_environment(prepared: Prepared, world: OpenWorld) -> Environment:
    """What the robot gets of an open world: its faults, its sensor, an edge where names end."""
    domain = prepared.loaded.domain
    faulty = wrap(world.environment, prepared.faults, world.disturbance, domain)
    lent = {"truth": world.oracle, "task": prepared.loaded.task.name}
    parts = Assembly(prepared.config.choices, domain, None, lent)
    eye = parts.part(SENSOR)
    seen = eye.around(faulty)
    named_by_world = getattr(world, "shares_names", True) and eye.identities
    if named_by_world and getattr(parts.part(SEGMENTER), "tracks", True):
        return seen
    return WorldsEdge(seen, world.oracle.truth, domain, named(prepared.plan))


def make_runtime(
    prepared: Prepared,
    world: OpenWorld,
    environment: Environment,
    demonstrations: Sequence[Demonstration] | None,
    listeners: Sequence[Listener],
    memory: str | None = None,
) -> Runtime:
    """The loop around an open world."""
    config, domain = prepared.config, prepared.loaded.domain
    known = prepared.model or domain
    lent = {"truth": world.oracle, "task": prepared.loaded.task.name}
    parts = Assembly(remembering(config.choices, memory), known, demonstrations, lent)
    return Runtime(
        environment,
        parts.part(PERCEIVER),
        parts.part(STRATEGY),
        known,
        listeners,
        _limits(config),
    )


def provenance(config: RunConfig) -> tuple[tuple[str, Any], ...]:
    """What is needed to run the same again: what was given, and what was left to defaults."""
    return (
        ("config", config.to_json()),
        ("loop", asdict(_limits(config))),
        (
            "versions",
            {
                "forestall": forestall.__version__,
                "python": sys.version.split()[0],
                **{name: _version(name) for name in PACKAGES},
                "platform": platform.platform(),
            },
        ),
    )


def _limits(config: RunConfig) -> RuntimeConfig:
    choice = config.choice(LIMIT)
    return RuntimeConfig(
        keep_observations=config.keep_observations,
        final_look=config.final_look,
        limits=built(find(choice.kind, choice.name), dict(choice.given), None),
    )


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _scorer(oracle: OracleView, domain: Domain) -> Callable[[EpisodeRecord], EpisodeRecord]:
    def score(record: EpisodeRecord) -> EpisodeRecord:
        strict, weak, failures = TruthGoalChecker(domain).check(record.task.goal, oracle)
        return replace(
            record,
            success=strict,
            weak_success=weak,
            failures=(*record.failures, *failures),
            events=oracle.events(),
            harmed=irreversible(record.task.goal, oracle, domain),
        )

    return score
