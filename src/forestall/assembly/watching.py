"""Factory of the strategy that watches: every judge there is, beside one another.

Named in `tables`, called through `parts`; calls `judging` for what one part alone does not tell.
"""

from __future__ import annotations

from typing import Any

from forestall.assembly.configuration import SWITCHES
from forestall.assembly.judging import knowledge
from forestall.comparison.options import Feature, ScoreConfig
from forestall.comparison.score import BatchScorer
from forestall.detection.preconditions import PreconditionDetector
from forestall.detection.scene_graph import DetectorConfig, SceneGraphDetector
from forestall.domain.distort import Distortion, distorted
from forestall.errors import InputError
from forestall.kinds import DETECTOR, REASONER, RETRIEVER, TEXT_ENCODER
from forestall.memory.retrieval import EmbeddingRetriever
from forestall.planning.validate import GraphValidator
from forestall.seams.judging import Detector
from forestall.seams.running import Parts
from forestall.strategies.judges import DetectorJudge, Judge, PlanJudge, WholeSceneJudge
from forestall.strategies.plan_check import PlanChecking
from forestall.strategies.watch import Watch

_NO_FLOOR = 0.01
"""The paper has no least similarity of two nodes that are matched."""


def watch(
    parts: Parts,
    *,
    models: tuple[str, ...] = (Distortion.EXACT.value,),
    model_seed: int = 0,
    counts: tuple[int, ...] = (),
) -> Watch:
    """Every detector, every ablation of the score and the plan check judge, the paper's own first.

    Args:
        parts: detectors, retriever, reasoner, demonstrations, domain.
        models: in each of these models of the domain the plan is checked: exact, coarse or wrong.
        model_seed: of what a wrong model has wrong.
        counts: the score and the preconditions judge with so many of the demonstrations, too, the
            first ones by seed.
    """
    paper = SceneGraphDetector.name
    primary = parts.part(DETECTOR, paper, **_shared(parts, paper, calibrated=True))
    ablated = [
        parts.part(DETECTOR, paper, **_shared(parts, paper), **{switch: False})
        for switch in SWITCHES.values()
    ]
    others: list[Detector] = [
        parts.part(DETECTOR, name, **_shared(parts, name, calibrated=True))
        for name in parts.declared(DETECTOR)
        if name != paper
    ]
    judges: list[Judge] = [
        *(DetectorJudge(d) for d in (*ablated, *others)),
        whole_scene(parts),
        *(_with_model(parts, model, model_seed) for model in models),
        *(j for n in sorted(set(counts)) for j in _with_few(parts, n)),
    ]
    return Watch(parts.part(RETRIEVER), primary, judges, parts.part(REASONER))


def whole_scene(parts: Parts) -> WholeSceneJudge:
    """The paper's equations as they stand, on all that is known: nothing is scoped or left out."""
    domain = parts.domain
    literal = ScoreConfig(
        feature=Feature.TEXT,
        floor=_NO_FLOOR,
        subtask_floor=_NO_FLOOR,
        state_changes_match=True,
        ignored_attributes=(),
        predicates=tuple(domain.relations),
        generic_supports=False,
        merge_supports=False,
        instance_categories=(),
    )
    paper = SceneGraphDetector.name
    options = _shared(parts, paper)
    alarm = DetectorConfig(**{k: v for k, v in options.items() if k == "threshold"})
    scorer = BatchScorer(literal, parts.part(TEXT_ENCODER), domain)
    wholes = {(d.id, s.index): s.whole for d in parts.demonstrations for s in d.steps}
    return WholeSceneJudge(SceneGraphDetector(scorer, alarm), wholes, f"{paper}, whole scene")


def _with_model(parts: Parts, model: str, seed: int) -> PlanJudge:
    domain = distorted(parts.domain, model, seed).domain
    exact = model == Distortion.EXACT.value
    name = PlanChecking.name if exact else f"{PlanChecking.name}, {model}"
    return PlanJudge(GraphValidator(domain), name)


def _with_few(parts: Parts, count: int) -> list[DetectorJudge]:
    """The score and the preconditions with the first demonstrations alone."""
    if count < 1:
        raise InputError(f"counts {count}: at least 1 demonstration is needed")
    first = sorted(parts.demonstrations, key=lambda d: (d.seed, d.id))[:count]
    retriever = EmbeddingRetriever(first, parts.part(TEXT_ENCODER), parts.domain)
    told = f"{count} demonstration{'s' if count > 1 else ''}"
    found = []
    for name in (SceneGraphDetector.name, PreconditionDetector.name):
        detector = parts.part(DETECTOR, name, **_shared(parts, name))
        if isinstance(detector, PreconditionDetector):
            detector = detector.knowing(knowledge(parts, first))
        found.append(DetectorJudge(detector, retriever, f"{name}, {told}"))
    return found


def _shared(parts: Parts, name: str, calibrated: bool = False) -> dict[str, Any]:
    """Options given to the run's detector that another has, too, the ablations apart.

    A calibration is of one detector with all that it compares with: only the run's own may have it.
    """
    known = parts.declared(DETECTOR, name)
    keeps = calibrated and parts.name(DETECTOR) == name
    own = (*SWITCHES.values(), *(() if keeps else ("calibration",)))
    return {
        option: value
        for option, value in parts.given(DETECTOR).items()
        if option in known and option not in own
    }
