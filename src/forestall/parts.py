"""The parts of a run by name: strategy, detectors, reasoner, encoders. Imports implementations.

Called by `build`, which puts them together with an environment. Nothing here sees a simulator.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

from forestall.comparison.options import Feature
from forestall.comparison.preconditions import mine, violations
from forestall.comparison.score import BatchScorer, ScoreConfig
from forestall.detection.scene_graph import DetectorConfig, SceneGraphDetector
from forestall.diagnosis.symbolic import SymbolicReasoner
from forestall.domain.load import domain_of
from forestall.embeddings.views import view_of
from forestall.errors import InputError, UnknownNameError
from forestall.memory.retrieval import EmbeddingRetriever
from forestall.perception.config import ScopeConfig
from forestall.perception.scope import scope
from forestall.planning.validate import AcceptAll, GraphValidator
from forestall.registry import known, load
from forestall.replanning.symbolic import PlannerReplanner
from forestall.seams import (
    Captioner,
    Detector,
    ImageTextEncoder,
    PlanValidator,
    Reasoner,
    Replanner,
    StateEstimator,
    Strategy,
)
from forestall.types.demonstration import Demonstration, View
from forestall.types.episode import BoundaryRecord
from forestall.vocabulary import Vocabulary

STATES = "learned"
"""Where object states come from when nothing is said."""

FEATURES = tuple(f.value for f in Feature)

STATE_ENCODERS = {"learned": "two-tower", "clip": "clip"}
"""The image-text encoder behind each estimator that reads pixels."""

SCORE_WITHOUT: Mapping[str, str] = {
    "subtask-node": "subtask_node",
    "structure": "use_structure",
    "nodes": "use_node",
    "edges": "use_edge",
}
"""What the score can do without (paper, Table 2 left) → the option that it switches off."""

WITHOUT = (*SCORE_WITHOUT, "reasoning", "validation")
"""Everything that a run can do without."""

THRESHOLD = 0.9
"""Alarm below this score (paper, Sec. 3)."""


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
        detector: what judges a boundary.
        without: a part that is left out, one of `WITHOUT`.
        image_encoder: of pictures as a whole, for the detector "image".
        captioner: what describes pictures, for the detector "caption".
        final_look: whether the robot looks once more when the plan is finished.
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
    threshold: float = THRESHOLD
    keep_observations: bool = True
    detector: str = "scene-graph"
    without: str | None = None
    image_encoder: str = "two-tower"
    captioner: str = "listing"
    final_look: bool = False


def check_parts(config: RunConfig) -> None:
    """See that every part named is known.

    Raises:
        InputError: a name that is not, or a threshold out of range; says what would be valid.
    """
    load("strategy", config.strategy)
    load("segmenter", config.segmenter)
    load("encoder", config.encoder)
    load("detector", config.detector)
    load("image-encoder", config.image_encoder)
    load("captioner", config.captioner)
    if config.feature not in FEATURES:
        raise UnknownNameError("node feature", config.feature, FEATURES)
    if config.without is not None and config.without not in WITHOUT:
        raise UnknownNameError("part to leave out", config.without, WITHOUT)
    if config.without in SCORE_WITHOUT and config.detector != "scene-graph":
        raise InputError(
            f"without {config.without!r}: only the detector 'scene-graph' has that part, "
            f"not {config.detector!r}"
        )
    if not 0 <= config.threshold <= 1:
        raise InputError(f"threshold {config.threshold} is not between 0 and 1")


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
    _check_features(config, demonstrations)
    retriever = EmbeddingRetriever(demonstrations, load("encoder", config.encoder)())
    if config.strategy == "watch":
        reasoner = SymbolicReasoner(mine, violations, vocabulary)
        return kind(retriever, make_watchers(config, vocabulary), reasoner)  # type: ignore[no-any-return]
    parts: list[Any] = [
        retriever,
        make_detector(config, vocabulary),
        make_reasoner(config, vocabulary),
        make_replanner(config, vocabulary),
        GraphValidator(domain_of(vocabulary)),
    ]
    if config.strategy in ("online", "online-scene"):
        parts.append(partial(scope, vocabulary=vocabulary, config=ScopeConfig()))
    return kind(*parts)  # type: ignore[no-any-return]


def make_reasoner(config: RunConfig, vocabulary: Vocabulary) -> Reasoner:
    """What explains a mismatch; the goal alone where reasoning is left out."""
    if config.without == "reasoning":
        from forestall.diagnosis.none import NoReasoning

        return NoReasoning(domain_of(vocabulary))
    return SymbolicReasoner(mine, violations, vocabulary)


def make_replanner(config: RunConfig, vocabulary: Vocabulary) -> Replanner:
    """What corrects the plan: all of it anew where no reason is known.

    Where validation is left out, the first plan that is found is taken unchecked.
    """
    domain = domain_of(vocabulary)
    validator: PlanValidator = GraphValidator(domain)
    if config.without == "validation":
        validator = AcceptAll()
    if config.without == "reasoning":
        from forestall.replanning.anew import GoalReplanner

        return GoalReplanner(validator, domain)
    return PlannerReplanner(validator, domain)


def make_detector(config: RunConfig, vocabulary: Vocabulary) -> Detector:
    """The detector that a run's strategy asks."""
    threshold = DetectorConfig(threshold=config.threshold)
    kind = load("detector", config.detector)
    if config.detector == "scene-graph":
        scorer = BatchScorer(score_options(config), load("encoder", config.encoder)())
        return kind(scorer, threshold, name=watch_name(config.without))  # type: ignore[no-any-return]
    if config.detector == "image":
        return kind(make_image_encoder(config.image_encoder), threshold)  # type: ignore[no-any-return]
    if config.detector == "caption":
        text = load("encoder", config.encoder)()
        return kind(make_captioner(config.captioner, vocabulary), text, threshold)  # type: ignore[no-any-return]
    return kind(threshold)  # type: ignore[no-any-return]


def watch_name(without: str | None) -> str:
    """The name under which the paper's detector, or an ablation of it, judges."""
    if without is None or without not in SCORE_WITHOUT:
        return SceneGraphDetector.name
    return f"{SceneGraphDetector.name} without {without.replace('-', ' ')}"


def make_watchers(config: RunConfig, vocabulary: Vocabulary) -> list[Detector]:
    """Every detector and every ablation of the score; the paper's own first."""
    choices = [replace(config, detector="scene-graph", without=None)]
    choices += [replace(config, detector="scene-graph", without=part) for part in SCORE_WITHOUT]
    choices += [
        replace(config, detector=name, without=None)
        for name in known("detector")
        if name != "scene-graph"
    ]
    return [make_detector(choice, vocabulary) for choice in choices]


def score_options(config: RunConfig) -> ScoreConfig:
    """How a run scores graphs."""
    options = ScoreConfig(feature=Feature(config.feature))
    off = SCORE_WITHOUT.get(config.without or "")
    return options if off is None else replace(options, **{off: False})  # type: ignore[arg-type]


def make_captioner(name: str, vocabulary: Vocabulary) -> Captioner:
    """What describes pictures in words."""
    if name == "listing":
        return load("captioner", name)(vocabulary)  # type: ignore[no-any-return]
    return _captioning_model(name)


@cache
def _captioning_model(name: str) -> Captioner:
    """One for each process: reading a model takes its time."""
    return load("captioner", name)()  # type: ignore[no-any-return]


def make_viewer(
    config: RunConfig, vocabulary: Vocabulary
) -> Callable[[BoundaryRecord], View | None]:
    """What keeps the pictures of a run as views: an image feature and a caption."""
    encoder = make_image_encoder(config.image_encoder)
    captioner = make_captioner(config.captioner, vocabulary)

    def view(boundary: BoundaryRecord) -> View | None:
        if boundary.observation is None:
            return None
        return view_of(boundary.observation, boundary.scoped, encoder, captioner)

    return view


def make_state_estimator(name: str, vocabulary: Vocabulary) -> StateEstimator:
    """An estimator that sees pixels only: a shipped one with its encoder, or somebody else's."""
    kind = load("states", name)
    if name in STATE_ENCODERS:
        return kind(make_image_encoder(STATE_ENCODERS[name]), vocabulary)  # type: ignore[no-any-return]
    return kind()  # type: ignore[no-any-return]


def node_encoder(config: RunConfig) -> ImageTextEncoder | None:
    """The encoder of node features, where they come from pictures."""
    if config.feature != Feature.IMAGE.value:
        return None
    return make_image_encoder(STATE_ENCODERS.get(config.states, "two-tower"))


def _check_features(config: RunConfig, demonstrations: Sequence[Demonstration]) -> None:
    """See that a memory's node features come from the encoder in use.

    Raises:
        InputError: they come from another one, or there are none.
    """
    encoder = node_encoder(config)
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
