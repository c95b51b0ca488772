"""Factories of what sees: segmenters, state estimators, the perceiver, the captioner that lists.

Named in `tables`, called through `parts`; calls perception and embeddings.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Annotated

from forestall.assembly.registry import default
from forestall.comparison.options import Feature, ScoreConfig
from forestall.domain.load import shipped
from forestall.domain.model import Domain
from forestall.embeddings.captions import ListingCaptioner
from forestall.kinds import FINDER, IMAGE_ENCODER, OUTLINER, SEGMENTER, STATES
from forestall.perception.config import PerceptionConfig, ScopeConfig
from forestall.perception.finder import FinderConfig, FoundSegmenter
from forestall.perception.gate_config import WatchConfig
from forestall.perception.given import GivenStateEstimator
from forestall.perception.given_graph import GraphPassthrough
from forestall.perception.learned import LearnedStateEstimator
from forestall.perception.oracle import OracleStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import GivenMasks, InstanceSegmenter
from forestall.planning.altered import altered
from forestall.seams.acting import OracleView
from forestall.seams.perceiving import ImageTextEncoder
from forestall.seams.running import Parts
from forestall.sensors import REALISTIC, Errors, SensorPart
from forestall.types.kind import Settled

_PERCEPTION, _SCORE = PerceptionConfig(), ScoreConfig()

_Further = Annotated[Errors | None, Settled("depth")]
"""Errors besides those of a camera's depth."""

STATE_ENCODERS = {"learned": default(IMAGE_ENCODER), "clip": "clip", "siglip": "siglip"}
"""The image-text encoder behind each estimator that reads pixels."""


def instance_ids(*, min_pixels: int = _PERCEPTION.min_pixels) -> InstanceSegmenter:
    """The simulator's own masks, of things with enough pixels."""
    return InstanceSegmenter(PerceptionConfig(min_pixels=min_pixels))


def given_masks(*, min_pixels: int = _PERCEPTION.min_pixels) -> GivenMasks:
    """The masks that a stored observation comes with."""
    return GivenMasks(PerceptionConfig(min_pixels=min_pixels))


def finder(parts: Parts, *, asked: FinderConfig | None = None) -> FoundSegmenter:
    """The domain's things in real pictures: what the finder finds, outlined by the outliner.

    Args:
        parts: finder, outliner, domain.
        asked: what is looked for, and which boxes are of one thing.
    """
    return FoundSegmenter(parts.part(FINDER), parts.part(OUTLINER), parts.domain, asked)


def perfect(parts: Parts, *, errors: Errors | None = None) -> SensorPart:
    """Pictures as they are drawn, unless errors are given."""
    return SensorPart(errors or Errors(), parts.domain)


def realsense(parts: Parts, *, errors: _Further = None) -> SensorPart:
    """An active stereo camera (RealSense D400)."""
    return SensorPart(replace(errors or Errors(), depth="realsense"), parts.domain)


def kinect(parts: Parts, *, errors: _Further = None) -> SensorPart:
    """A structured-light camera (the first Kinect)."""
    return SensorPart(replace(errors or Errors(), depth="kinect"), parts.domain)


def tof(parts: Parts, *, errors: _Further = None) -> SensorPart:
    """A time-of-flight camera (the second Kinect)."""
    return SensorPart(replace(errors or Errors(), depth="tof"), parts.domain)


def realistic(parts: Parts) -> SensorPart:
    """A stereo camera on a robot, and a detector without identities: all errors, moderately."""
    return SensorPart(REALISTIC, parts.domain)


def learned(parts: Parts) -> LearnedStateEstimator:
    """States off pixels, by the shipped encoder."""
    return _reading(parts, "learned")


def clip(parts: Parts) -> LearnedStateEstimator:
    """States off pixels, by CLIP, whose weights it needs."""
    return _reading(parts, "clip")


def siglip(parts: Parts) -> LearnedStateEstimator:
    """States off pixels, by SigLIP, whose weights it needs."""
    return _reading(parts, "siglip")


def _reading(parts: Parts, name: str) -> LearnedStateEstimator:
    return LearnedStateEstimator(_encoder(parts, STATE_ENCODERS[name]), parts.domain)


def _encoder(parts: Parts, name: str) -> ImageTextEncoder:
    """The run's image encoder with its options, where it is the one of that name."""
    own = parts.name(IMAGE_ENCODER) == name
    return parts.part(IMAGE_ENCODER) if own else parts.part(IMAGE_ENCODER, name)


def household() -> Domain:
    """The household that comes with the project."""
    return shipped("household")


def ai2thor() -> Domain:
    """The household over AI2-THOR's object types."""
    return shipped("ai2thor")


def bench() -> Domain:
    """The assembly bench that comes with the project."""
    return shipped("bench")


def frankakitchen() -> Domain:
    """The fixtures of FrankaKitchen."""
    return shipped("frankakitchen")


def oracle(parts: Parts) -> OracleStateEstimator:
    """The truth of what a camera could tell."""
    oracle: OracleView = parts.lent("truth")
    return OracleStateEstimator(oracle.states, parts.domain, oracle.truth)


def given(parts: Parts) -> GivenStateEstimator:
    """The states that a stored observation comes with."""
    return GivenStateEstimator(parts.lent("states"))


def graph(
    parts: Parts,
    *,
    feature: Feature = _SCORE.feature,
    perception: PerceptionConfig | None = None,
    scope: ScopeConfig | None = None,
    watch: WatchConfig | None = None,
) -> GraphPerceiver:
    """RGB-D to one scene graph over the episode.

    States that a skill may have changed are believed again when they are read again.

    Args:
        parts: segmenter, states, encoder, domain.
        feature: what a node's feature encodes; "image" keeps the look of every object.
        perception: every threshold.
        scope: what concerns a subtask.
        watch: what may change from one observation to the next.
    """
    return GraphPerceiver(
        parts.part(SEGMENTER),
        parts.part(STATES),
        parts.domain,
        perception,
        scope,
        image_encoder=look_encoder(parts) if feature is Feature.IMAGE else None,
        watch=watch or WatchConfig(),
        alters=partial(altered, domain=parts.domain),
    )


def given_graph(parts: Parts, *, scope: ScopeConfig | None = None) -> GraphPassthrough:
    """The scene graph that an observation comes with.

    A state that it leaves open is presumed to be what the robot's skills should have made of it.

    Args:
        parts: the domain.
        scope: what concerns a subtask.
    """
    return GraphPassthrough(parts.domain, scope, alters=partial(altered, domain=parts.domain))


def look_encoder(parts: Parts) -> ImageTextEncoder:
    """The encoder of how objects look: that of their states, where those are read off pixels.

    Else it is the image encoder of the run.
    """
    return _encoder(parts, STATE_ENCODERS.get(parts.name(STATES), parts.name(IMAGE_ENCODER)))


def listing(parts: Parts) -> ListingCaptioner:
    """Says in words what perception made of a picture."""
    return ListingCaptioner(parts.domain)
