"""Configuration → objects: where implementations of different families meet.

Calls: command line → here → runtime, environment, perception, memory, comparison, planning. The
oracle view of an environment is handed to exactly two places here: the oracle state estimator, when
that is the one asked for, and the scorer.
"""

from __future__ import annotations

import platform
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import forestall
from forestall.benchmark.faults import (
    Fault,
    apply_plan_faults,
    apply_scene_faults,
    check_steps,
    wrap,
)
from forestall.benchmark.files import LoadedTask, Scenario, load_scenario, load_task
from forestall.benchmark.goals import TruthGoalChecker
from forestall.comparison.options import Feature
from forestall.comparison.preconditions import MiningConfig, mine, violations
from forestall.comparison.score import BatchScorer, ScoreConfig
from forestall.config import DEMONSTRATION_SEEDS, PICTURE_SEEDS
from forestall.detection.scene_graph import DetectorConfig, SceneGraphDetector
from forestall.diagnosis.symbolic import SymbolicReasoner
from forestall.envs.kitchen.environment import KitchenEnvironment
from forestall.envs.kitchen.rendering import RENDERERS
from forestall.errors import InputError, UnknownNameError
from forestall.interfaces import ImageTextEncoder, Listener, StateEstimator, Strategy
from forestall.memory.retrieval import EmbeddingRetriever, RetrievalConfig
from forestall.perception.config import PerceptionConfig, ScopeConfig
from forestall.perception.perceiver import GraphPerceiver
from forestall.planning.search import SearchConfig
from forestall.planning.validate import GraphValidator
from forestall.registry import known, load
from forestall.replanning.symbolic import PlannerReplanner
from forestall.runtime import Runtime, RuntimeConfig
from forestall.types.demonstration import Demonstration
from forestall.types.episode import EpisodeRecord
from forestall.types.plan import Plan
from forestall.vocabulary import Vocabulary

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

STATES = "learned"
"""Where they come from when nothing is said."""

FEATURES = tuple(f.value for f in Feature)

STATE_ENCODERS = {"learned": "two-tower", "clip": "clip"}
"""The image-text encoder behind each estimator that reads pixels."""


@dataclass(frozen=True, slots=True)
class RunConfig:
    """Everything that a run can be configured with.

    Args:
        task: name of a shipped task, or a task file.
        scenario: name of a shipped scenario, or a scenario file; None for an undisturbed run.
        strategy: see `registry.TABLES`.
        seed: of the scene.
        renderer: "auto", "embree", "rays" or "gl".
        segmenter: where masks come from.
        states: where object states come from.
        encoder: text encoder of retrieval and node features.
        feature: what a node's feature encodes: text, parts or image (see `comparison.options`).
        threshold: alarm below this score (paper: 0.9).
        keep_observations: whether pictures stay in the record.
    """

    task: str
    scenario: str | None = None
    strategy: str = "proactive"
    seed: int = 0
    renderer: str = "auto"
    segmenter: str = "instance-ids"
    states: str = STATES
    encoder: str = "hashed-words"
    feature: str = "parts"
    threshold: float = 0.9
    keep_observations: bool = True


@dataclass(frozen=True, slots=True)
class Prepared:
    """A checked run: what the files say, before anything is built."""

    config: RunConfig
    loaded: LoadedTask
    scenario: Scenario | None

    @property
    def plan(self) -> Plan:
        """The plan to start with: the nominal one with the scenario's changes."""
        return apply_plan_faults(self.loaded.task.plan, self.faults)

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
    load("strategy", config.strategy)
    if config.states not in RUN_STATES:
        raise UnknownNameError("states of a run", config.states, RUN_STATES)
    load("segmenter", config.segmenter)
    load("encoder", config.encoder)
    if config.feature not in FEATURES:
        raise UnknownNameError("node feature", config.feature, FEATURES)
    if config.renderer not in RENDERERS:
        raise UnknownNameError("renderer", config.renderer, RENDERERS)
    scenario = None if config.scenario is None else load_scenario(config.scenario)
    if scenario is not None and scenario.task != loaded.task.name:
        raise InputError(
            f"scenario {scenario.name} is for the task {scenario.task}, not {loaded.task.name}"
        )
    if not 0 <= config.threshold <= 1:
        raise InputError(f"threshold {config.threshold} is not between 0 and 1")
    if config.seed < 0:
        raise InputError(f"seed {config.seed} is negative; seeds are 0, 1, 2, ...")
    if config.seed >= DEMONSTRATION_SEEDS and config.strategy != "none":
        raise InputError(f"seed {config.seed}: from {DEMONSTRATION_SEEDS} on are demonstrations")
    if config.seed >= PICTURE_SEEDS["train"]:
        raise InputError(f"seed {config.seed}: from {PICTURE_SEEDS['train']} on are pictures")
    prepared = Prepared(config, loaded, scenario)
    if scenario is not None:
        try:
            apply_scene_faults(loaded.task.scene, prepared.faults, loaded.vocabulary)
            check_steps(prepared.plan, prepared.faults, loaded.vocabulary)
        except InputError as error:
            raise InputError(f"scenario {scenario.name}: {error}") from error
    return prepared


def run_episode(
    prepared: Prepared,
    demonstrations: Sequence[Demonstration] | None,
    listeners: Sequence[Listener] = (),
    memory: str | None = None,
) -> EpisodeRecord:
    """Build everything and run one episode.

    Args:
        prepared: from `prepare`.
        demonstrations: the memory; None only for a strategy that uses none.
        listeners: told what happens.
        memory: where the demonstrations come from, for the record.
    """
    config, loaded, task = prepared.config, prepared.loaded, prepared.loaded.task
    needs = apply_scene_faults(task.scene, prepared.faults, loaded.vocabulary)
    kitchen = KitchenEnvironment(needs, loaded.vocabulary, config.renderer)
    try:
        perceiver = GraphPerceiver(
            load("segmenter", config.segmenter)(),
            _state_estimator(config.states, kitchen, loaded.vocabulary),
            loaded.vocabulary,
            image_encoder=_image_encoder(config),
        )
        runtime = Runtime(
            wrap(kitchen, prepared.faults, kitchen, loaded.vocabulary),
            perceiver,
            make_strategy(config, loaded.vocabulary, demonstrations),
            loaded.vocabulary,
            listeners,
            RuntimeConfig(keep_observations=config.keep_observations),
        )
        return runtime.run(
            task,
            prepared.plan,
            config.seed,
            None if prepared.scenario is None else prepared.scenario.name,
            _scorer(kitchen),
            (
                *provenance(config),
                ("memory", memory),
                ("demonstrations", [{"id": d.id, "seed": d.seed} for d in demonstrations or ()]),
                ("inputs", {"task": repr(loaded.task), "scenario": repr(prepared.scenario)}),
            ),
        )
    finally:
        kitchen.close()


def make_strategy(
    config: RunConfig, vocabulary: Vocabulary, demonstrations: Sequence[Demonstration] | None
) -> Strategy:
    """The strategy with its collaborators."""
    kind = load("strategy", config.strategy)
    if config.strategy == "none":
        return kind()  # type: ignore[no-any-return]
    if not demonstrations:
        raise InputError(
            f"strategy {config.strategy!r} compares with demonstrations, and the memory has none"
        )
    encoder = load("encoder", config.encoder)()
    validator = GraphValidator(vocabulary)
    _check_features(config, demonstrations)
    return kind(  # type: ignore[no-any-return]
        EmbeddingRetriever(demonstrations, encoder),
        make_detector(config, vocabulary),
        SymbolicReasoner(mine, violations, vocabulary),
        PlannerReplanner(validator, vocabulary),
        validator,
    )


def make_detector(config: RunConfig, vocabulary: Vocabulary) -> SceneGraphDetector:
    """The paper's detector with our default options."""
    encoder = load("encoder", config.encoder)()
    return SceneGraphDetector(
        BatchScorer(score_options(config), encoder), DetectorConfig(threshold=config.threshold)
    )


def score_options(config: RunConfig) -> ScoreConfig:
    """How a run scores graphs."""
    return ScoreConfig(feature=Feature(config.feature))


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


def _state_estimator(name: str, kitchen: KitchenEnvironment, vocabulary: Vocabulary) -> Any:
    if name == "oracle":
        unseen = [a.name for a in vocabulary.attributes.values() if not a.camera]
        return load("states", name)(kitchen.oracle.states, not_visible=unseen)
    return make_state_estimator(name, vocabulary)


def make_state_estimator(name: str, vocabulary: Vocabulary) -> StateEstimator:
    """An estimator that sees pixels only: a shipped one with its encoder, or somebody else's."""
    kind = load("states", name)
    if name in STATE_ENCODERS:
        return kind(make_image_encoder(STATE_ENCODERS[name]), vocabulary)  # type: ignore[no-any-return]
    return kind()  # type: ignore[no-any-return]


def _image_encoder(config: RunConfig) -> ImageTextEncoder | None:
    """The encoder of node features, where they come from pictures."""
    if config.feature != Feature.IMAGE.value:
        return None
    return make_image_encoder(STATE_ENCODERS.get(config.states, "two-tower"))


def _check_features(config: RunConfig, demonstrations: Sequence[Demonstration]) -> None:
    """See that a memory's node features come from the encoder in use.

    Raises:
        InputError: they come from another one, or there are none.
    """
    encoder = _image_encoder(config)
    if encoder is None:
        return
    for d in demonstrations:
        made = dict(d.perception).get("features")
        if made != encoder.name:
            raise InputError(
                f"the node features of demonstration {d.id} come from {made or 'nothing'}, this "
                f"run's from {encoder.name}: record the memory with the same --states and --feature"
            )


@cache
def make_image_encoder(name: str) -> ImageTextEncoder:
    """An image-text encoder, one for each process: reading a model takes its time."""
    return load("image-encoder", name)()  # type: ignore[no-any-return]


def _scorer(kitchen: KitchenEnvironment) -> Callable[[EpisodeRecord], EpisodeRecord]:
    def score(record: EpisodeRecord) -> EpisodeRecord:
        strict, weak, failures = TruthGoalChecker().check(record.task.goal, kitchen.oracle)
        return replace(
            record,
            success=strict,
            weak_success=weak,
            failures=(*record.failures, *failures),
            events=kitchen.oracle.events(),
        )

    return score
