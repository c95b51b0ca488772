"""The perceiver: images, depth, masks and the hand in, one fused scene graph out.

Called by the runtime; calls a segmenter, a state estimator and, where there is one, an image
encoder (given by the constructor), then `unproject.py` for each frame and `fuse.py` once for each
observation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from forestall.domain.model import Domain
from forestall.errors import InputError, PerceptionError
from forestall.perception.config import PerceptionConfig, ScopeConfig
from forestall.perception.fuse import SceneMemory
from forestall.perception.naming import name_detections
from forestall.perception.scope import scope
from forestall.perception.tracks import View
from forestall.perception.unproject import Cloud, Points, clouds, label_image
from forestall.seams import ImageEncoder, Segmenter, StateEstimator
from forestall.types.feature import quantised
from forestall.types.graph import SceneGraph
from forestall.types.observation import Detection, Frame, Observation
from forestall.types.plan import Subtask


class GraphPerceiver:
    """Implements the Perceiver Protocol.

    Args:
        segmenter: where masks come from.
        state_estimator: where states come from.
        domain: categories, their attributes and what goes where.
        config: thresholds.
        scope_config: what a subtask's graph keeps.
        image_encoder: gives every located thing the feature of its largest crop (f(v) of Eq. 1 as
            an image embedding); without it nodes have none.
    """

    def __init__(
        self,
        segmenter: Segmenter,
        state_estimator: StateEstimator,
        domain: Domain,
        config: PerceptionConfig | None = None,
        scope_config: ScopeConfig | None = None,
        *,
        image_encoder: ImageEncoder | None = None,
    ) -> None:
        self._segmenter = segmenter
        self._estimator = state_estimator
        self._domain = domain
        self._config = config or PerceptionConfig()
        self._scope = scope_config or ScopeConfig()
        self._image_encoder = image_encoder
        self._memory = SceneMemory(domain, self._config)

    def reset(self) -> None:
        """Forget everything."""
        self._memory.reset()

    def perceive(self, observation: Observation) -> SceneGraph:
        """Fuse an observation and return the whole graph as believed now.

        Raises:
            PerceptionError: no frame at all, one without the masks that the segmenter needs, a
                state estimator or an image encoder that does not answer for every detection.
        """
        if not observation.frames:
            raise PerceptionError(
                "the observation has no picture, only a scene graph: use the perceiver given-graph"
            )
        known: dict[str, Points] = {
            n: t.centroid_m for n, t in self._memory.tracks.items() if t.points_world_m is not None
        }
        views = []
        for frame in observation.frames:
            view = self._view(frame, known)
            for name, cloud in zip(view.ids, view.clouds, strict=True):
                if cloud is not None:
                    known[name] = cloud.centroid_m
            views.append(view)
        self._memory.integrate(observation, views)
        return self._memory.graph()

    def scope(self, graph: SceneGraph, subtask: Subtask) -> SceneGraph:
        """The part of a graph that concerns a (grounded) subtask, with its subtask node."""
        return scope(graph, subtask, self._domain, self._scope)

    def describe(self) -> Mapping[str, str]:
        """Which segmenter, state estimator and, if any, image encoder are used.

        Goes into every record and every demonstration.
        """
        used = {"segmenter": self._segmenter.name, "state_estimator": self._estimator.name}
        if self._image_encoder is not None:
            used["features"] = self._image_encoder.name
        return used

    def _view(self, frame: Frame, known: Mapping[str, Points]) -> View:
        detections = self._segmenter.segment(frame)
        states = self._estimator.estimate(frame, detections)
        if len(states) != len(detections):
            raise PerceptionError(
                f"the state estimator {self._estimator.name!r} answered for {len(states)} of "
                f"{len(detections)} detections"
            )
        labels = label_image(detections, frame.depth_m.shape)
        found = clouds(frame, labels, [self._voxel_m(d) for d in detections], self._config)
        names = name_detections(detections, found, known, self._config.same_place_m)
        return View(
            frame=frame,
            labels=labels,
            ids=tuple(names),
            categories=tuple(d.category for d in detections),
            clouds=tuple(found),
            states=tuple(states),
            features=self._features(frame, detections, found),
        )

    def _features(
        self, frame: Frame, detections: Sequence[Detection], found: Sequence[Cloud | None]
    ) -> tuple[bytes | None, ...]:
        """Quantised features of what has a cloud; nothing is encoded that no node could carry."""
        encoder = self._image_encoder
        located = [i for i, cloud in enumerate(found) if cloud is not None]
        features: list[bytes | None] = [None] * len(detections)
        if encoder is None or not located:
            return tuple(features)
        rows = encoder.encode_crops(frame.rgb, [detections[i].mask for i in located])
        if rows.ndim != 2 or len(rows) != len(located):
            raise PerceptionError(
                f"the image encoder {encoder.name!r} gave an array of shape {rows.shape} for "
                f"{len(located)} masks"
            )
        try:
            for i, row in zip(located, rows, strict=True):
                features[i] = quantised(row)
        except InputError as error:
            raise PerceptionError(f"the image encoder {encoder.name!r}: {error}") from error
        return tuple(features)

    def _voxel_m(self, detection: Detection) -> float:
        if self._domain.is_a(detection.category, self._domain.roles.fixture):
            return self._config.fixture_voxel_m
        return self._config.voxel_m
