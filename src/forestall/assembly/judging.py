"""Factories of what remembers, judges, explains and corrects.

Named in `tables`, called through `parts`; calls memory, comparison, detection, diagnosis,
replanning, planning, strategies.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import Enum
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Annotated, Any, TypeVar

from forestall.assembly.calibrated import calibrated
from forestall.assembly.configuration import SWITCHES
from forestall.assembly.corrections import corrections_of
from forestall.assembly.seeing import look_encoder
from forestall.comparison.lacking import Knowledge
from forestall.comparison.needs import Needs, needs_of
from forestall.comparison.options import Feature, ScoreConfig
from forestall.comparison.preconditions import MiningConfig, mine, needed, violations
from forestall.comparison.score import BatchScorer
from forestall.detection.caption import CaptionDetector
from forestall.detection.image import ImageDetector
from forestall.detection.objects import ObjectCountDetector
from forestall.detection.preconditions import PreconditionConfig, PreconditionDetector
from forestall.detection.scene_graph import DetectorConfig, SceneGraphDetector
from forestall.diagnosis.locating import ModelLocator
from forestall.diagnosis.none import NoReasoning
from forestall.diagnosis.symbolic import SymbolicReasoner
from forestall.errors import InputError, UnknownNameError
from forestall.kinds import (
    CAPTIONER,
    DETECTOR,
    EXPECTATIONS,
    IMAGE_ENCODER,
    LLM,
    PERCEIVER,
    REASONER,
    REPLANNER,
    RETRIEVER,
    TEXT_ENCODER,
    VALIDATOR,
)
from forestall.memory.retrieval import EmbeddingRetriever, RetrievalConfig
from forestall.memory.store import SqliteStore, open_store
from forestall.perception.config import ScopeConfig
from forestall.perception.scope import scope
from forestall.planning.ahead import foresee
from forestall.planning.search import SearchConfig
from forestall.planning.validate import GraphValidator
from forestall.replanning.anew import GoalReplanner
from forestall.replanning.symbolic import PlannerReplanner
from forestall.seams.judging import Locator, PlanValidator
from forestall.seams.running import Parts
from forestall.strategies.judges import DetectorJudge
from forestall.strategies.online import Online, OnlineScene
from forestall.strategies.panel import Agree, Panel
from forestall.strategies.plan_check import PlanChecking
from forestall.strategies.post_hoc import PostHoc
from forestall.strategies.proactive import Proactive
from forestall.types.demonstration import Demonstration
from forestall.types.kind import Settled

S = TypeVar("S")

_SCORE = "score"
"""How the paper's detector is called among judges."""


_PROACTIVE, _POST_HOC, _ONLINE, _PLAN_CHECK = (
    signature(strategy).parameters["max_attempts"].default
    for strategy in (Proactive, PostHoc, Online, PlanChecking)
)
"""How often each strategy tries, as it has it by itself."""


def sqlite(*, path: str | None = None, busy_timeout_s: float = 5.0) -> SqliteStore:
    """A memory in one file.

    Args:
        path: of the file; a run without it uses its task's ready-made memory.
        busy_timeout_s: how long to wait for another process that is writing.
    """
    if path is None:
        raise InputError("the store 'sqlite' needs the option path, the memory file")
    return open_store(path, busy_timeout_s=busy_timeout_s)


def embedding(parts: Parts, *, retrieval: RetrievalConfig | None = None) -> EmbeddingRetriever:
    """References by the likeness of subtask texts.

    Raises:
        InputError: the memory is empty, or the node features in it come from another encoder.
    """
    demonstrations = parts.demonstrations
    if parts.options(PERCEIVER).get("feature") == Feature.IMAGE.value:
        wanted = look_encoder(parts).name
        for d in demonstrations:
            made = dict(d.perception).get("features")
            if made != wanted:
                raise InputError(
                    f"the node features of demonstration {d.id} come from {made or 'nothing'}, "
                    f"this run's from {wanted}: record the memory with the same --states and "
                    "--feature"
                )
    return EmbeddingRetriever(demonstrations, parts.part(TEXT_ENCODER), parts.domain, retrieval)


def scene_graph(
    parts: Parts,
    *,
    alarm: DetectorConfig | None = None,
    score: Annotated[ScoreConfig | None, Settled("feature")] = None,
    calibration: Path | None = None,
) -> SceneGraphDetector:
    """The paper's score; without a part of it, its name says so.

    What a node's feature encodes is the perceiver's affair, who makes it.

    Args:
        parts: text encoder, perceiver; of a calibration also retriever and demonstrations.
        alarm: the threshold.
        score: what is compared, and how.
        calibration: a file of `forestall calibrate`, whose thresholds stand for the fixed one.
    """
    options = score or ScoreConfig()
    feature = parts.options(PERCEIVER).get("feature")
    if feature is not None:
        options = replace(options, feature=Feature(feature))
    left_out = [part for part, switch in SWITCHES.items() if not getattr(options, switch)]
    name = SceneGraphDetector.name
    if left_out:
        name = f"{name} without {' and '.join(p.replace('-', ' ') for p in left_out)}"
    scorer = BatchScorer(options, parts.part(TEXT_ENCODER), parts.domain)
    used = (alarm or DetectorConfig(), options)
    thresholds = calibrated(parts, calibration, SceneGraphDetector.name, *used)
    return SceneGraphDetector(scorer, alarm, name, thresholds)


def objects(parts: Parts, *, alarm: DetectorConfig | None = None) -> ObjectCountDetector:
    """Likeness of the counts of categories."""
    return ObjectCountDetector(parts.domain, alarm)


def image(parts: Parts, *, alarm: DetectorConfig | None = None) -> ImageDetector:
    """Likeness of whole pictures."""
    return ImageDetector(parts.part(IMAGE_ENCODER), alarm)


def always_held(
    parts: Parts,
    *,
    alarm: PreconditionConfig | None = None,
    mining: MiningConfig | None = None,
    calibration: Path | None = None,
    corrections: str | None = None,
) -> PreconditionDetector:
    """What always held before the subtask in its demonstrations.

    Args:
        parts: domain, demonstrations, expectations; of a calibration also the retriever.
        alarm: the threshold.
        mining: how much evidence a precondition needs.
        calibration: a file of `forestall calibrate`, which says whether it may alarm.
        corrections: file of corrections by hand; the one beside the memory, where there is one.
    """
    used = (alarm or PreconditionConfig(), mining or MiningConfig())
    thresholds = calibrated(parts, calibration, PreconditionDetector.name, *used)
    return PreconditionDetector(
        parts.domain,
        mining,
        alarm,
        thresholds,
        corrections_of(parts, corrections),
        knowledge=knowledge(parts),
        expectations=parts.part(EXPECTATIONS),
    )


def knowledge(parts: Parts, demonstrations: Sequence[Demonstration] | None = None) -> Knowledge:
    """The counts of the run's memory, or of some demonstrations, and who executes plans."""
    domain = parts.domain

    def counts() -> Needs:
        return needs_of(parts.demonstrations if demonstrations is None else demonstrations, domain)

    return Knowledge(counts, foresee)


def caption(parts: Parts, *, alarm: DetectorConfig | None = None) -> CaptionDetector:
    """Likeness of captions."""
    return CaptionDetector(parts.part(CAPTIONER), parts.part(TEXT_ENCODER), alarm)


def preconditions(
    parts: Parts, *, mining: MiningConfig | None = None, corrections: str | None = None
) -> SymbolicReasoner:
    """What always held before the subtask and does not now; options as `always_held`."""
    return SymbolicReasoner(
        partial(mine, config=mining),
        violations,
        parts.domain,
        corrections_of(parts, corrections),
        knowledge=knowledge(parts),
        remembered=partial(needed, config=mining),
        expectations=parts.part(EXPECTATIONS),
    )


def no_reasoning(parts: Parts) -> NoReasoning:
    """The goal alone."""
    return NoReasoning(parts.domain)


def planner(
    parts: Parts, *, validator: str | None = None, search: SearchConfig | None = None
) -> PlannerReplanner:
    """A repair by search.

    Args:
        parts: validator, domain.
        validator: of what is found; the run's own by default.
        search: its limits.
    """
    return PlannerReplanner(_validator(parts, validator), parts.domain, search)


def anew(
    parts: Parts, *, validator: str | None = None, search: SearchConfig | None = None
) -> GoalReplanner:
    """A plan for the goal as if there had been none; options as `planner`."""
    return GoalReplanner(_validator(parts, validator), parts.domain, search)


def _validator(parts: Parts, name: str | None) -> PlanValidator:
    return parts.part(VALIDATOR) if name is None else parts.part(VALIDATOR, name)


def graph_validator(parts: Parts) -> GraphValidator:
    """Executes a plan on the observed graph."""
    return GraphValidator(parts.domain)


def proactive(
    parts: Parts,
    *,
    max_attempts: int = _PROACTIVE,
    repeats: bool = False,
    judges: tuple[str, ...] = (),
    judges_agree: Agree = Agree.ANY,
) -> Proactive:
    """Ours: before each subtask.

    Args:
        parts: what it is made of.
        max_attempts: repairs of one cause.
        repeats: whether what the robot says was not done is to be done again.
        judges: who judges: score, plan-check, or the name of a detector, such as preconditions;
            several are heard together. By default the run's own detector.
        judges_agree: whether any of them raises an alarm, or all must.
    """
    heard = _panel(parts, judges, judges_agree) if judges else None
    strategy = partial(Proactive, repeats=repeats, panel=heard)
    return _stepping_in(strategy, parts, max_attempts)


def _panel(parts: Parts, judges: tuple[str, ...], agree: Agree) -> Panel:
    """Judges by name; what the run says of its detector holds for that one alone."""
    paper, known = SceneGraphDetector.name, parts.declared(DETECTOR)
    names = [paper if name == _SCORE else name for name in dict.fromkeys(judges)]
    for name in names:
        if name not in known and name != PlanChecking.name:
            raise UnknownNameError("judge", name, (_SCORE, PlanChecking.name, *sorted(known)))
    detectors = [n for n in dict.fromkeys(names) if n != PlanChecking.name]
    own = parts.name(DETECTOR)
    heard = [
        DetectorJudge(parts.part(DETECTOR) if n == own else parts.part(DETECTOR, n))
        for n in detectors
    ]
    return Panel(heard, PlanChecking.name in names, agree)


class Locate(Enum):
    """Who says at which step a run went wrong."""

    SCENES = "scenes"
    MODEL = "model"


def post_hoc(
    parts: Parts, *, max_attempts: int = _POST_HOC, locate: Locate = Locate.SCENES
) -> PostHoc:
    """After the whole task (REFLECT).

    Args:
        parts: what it is made of.
        max_attempts: corrections of one run.
        locate: who names the step that went wrong: the scenes that did not fit, or a language model
            by REFLECT's questions about the whole run.
    """
    strategy = partial(PostHoc, locator=_locator(parts, locate), scope=_scoping(parts))
    return _stepping_in(strategy, parts, max_attempts)


def online(parts: Parts, *, max_attempts: int = _ONLINE, locate: Locate = Locate.SCENES) -> Online:
    """After each subtask, by its own outcome (REFLECT, online).

    Args:
        parts: what it is made of.
        max_attempts: repairs of one cause.
        locate: who says whether a subtask did what it is for: the scene after it, or a language
            model by REFLECT's questions.
    """
    strategy = partial(Online, locator=_locator(parts, locate))
    return _stepping_in(strategy, parts, max_attempts, _scoping(parts))


def _locator(parts: Parts, locate: Locate) -> Locator | None:
    return None if locate is Locate.SCENES else ModelLocator(parts.part(LLM), parts.domain)


def online_scene(parts: Parts, *, max_attempts: int = _ONLINE) -> OnlineScene:
    """After each subtask, by the scene."""
    return _stepping_in(OnlineScene, parts, max_attempts, _scoping(parts))


def _scoping(parts: Parts) -> Callable[..., Any]:
    return partial(scope, domain=parts.domain, config=ScopeConfig())


def _stepping_in(strategy: Callable[..., S], parts: Parts, max_attempts: int, *more: Any) -> S:
    return strategy(
        parts.part(RETRIEVER),
        parts.part(DETECTOR),
        parts.part(REASONER),
        parts.part(REPLANNER),
        parts.part(VALIDATOR),
        *more,
        max_attempts=max_attempts,
    )


def plan_check(parts: Parts, *, max_attempts: int = _PLAN_CHECK) -> PlanChecking:
    """Before each subtask, by the rest of the plan and without demonstrations."""
    return PlanChecking(parts.part(REPLANNER), parts.part(VALIDATOR), max_attempts)
