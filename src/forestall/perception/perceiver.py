"""The perceiver: images, depth, masks and the hand in, one fused scene graph out.

Called by the runtime; calls a segmenter, a state estimator and, where there is one, an image
encoder (given by the constructor), `gate.py` before anything is believed, then `unproject.py` for
each frame and `fuse.py` once for each observation.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

from forestall.domain.model import Domain
from forestall.errors import InputError, PerceptionError
from forestall.extras import need
from forestall.perception.config import PerceptionConfig, ScopeConfig
from forestall.perception.foreground import own_pixels
from forestall.perception.forgetting import join
from forestall.perception.fuse import SceneMemory
from forestall.perception.gate import Masks, inspect
from forestall.perception.gate_config import GateConfig, WatchConfig
from forestall.perception.gate_time import SenseWatch
from forestall.perception.miscalled import called_right
from forestall.perception.named import with_names
from forestall.perception.naming import Known, mean_looks, name_detections
from forestall.perception.own_names import expected, join_parts, known, named_hands
from forestall.perception.scope import scope
from forestall.perception.surfaces import fixed, with_surfaces
from forestall.perception.tracks import View, vec
from forestall.perception.unproject import (
    Cloud,
    Labels,
    clouds,
    label_image,
)
from forestall.perception.vantage import best_vantage
from forestall.seams.perceiving import (
    Alters,
    ConfidentStateEstimator,
    ImageEncoder,
    Segmenter,
    StateEstimator,
)
from forestall.types.facts import category_of
from forestall.types.feature import quantised
from forestall.types.finding import Finding, refuse
from forestall.types.graph import SceneGraph
from forestall.types.observation import Detection, Frame, Observation, Vec3
from forestall.types.plan import Subtask

_GATE = GateConfig()


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
        gate: what observations cannot be; None lets everything in.
        watch: what may change from one observation to the next; by default everything may.
        alters: what a skill may have changed; without it a state is believed until it is read anew.
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
        gate: GateConfig | None = _GATE,
        watch: WatchConfig | None = None,
        alters: Alters | None = None,
    ) -> None:
        self._segmenter = segmenter
        self._estimator = state_estimator
        self._domain = domain
        self._config = config or PerceptionConfig()
        self._scope = scope_config or ScopeConfig()
        self._image_encoder = image_encoder
        self._gate = gate
        self._alters = alters
        self._watch = None if watch is None else SenseWatch(watch, gate)
        self.findings: tuple[Finding, ...] = ()
        self.named: tuple[tuple[Detection, ...], ...] = ()
        self._memory = SceneMemory(domain, self._config)
        self._eye: Vec3 | None = None

    def reset(self) -> None:
        """Forget everything."""
        self._memory.reset()
        self._eye = None
        self.findings, self.named = (), ()
        if self._watch is not None:
            self._watch.reset()

    def perceive(self, observation: Observation) -> SceneGraph:
        """Fuse an observation and return the whole graph as believed now.

        What the gate found of it stands in `findings`, and in `named` what the segmenter found in
        each frame, with the names that things bear in the graph.

        Raises:
            PerceptionError: no frame at all, one without the masks that the segmenter needs, a
                state estimator or an image encoder that does not answer for every detection.
            ObservationError: the gate refuses it; nothing of it was taken in.
        """
        if not observation.frames:
            raise PerceptionError(
                "the observation has no picture, only a scene graph: use the perceiver given-graph"
            )
        need("a scene graph from pictures", "perception", "scipy")
        masked = self._masks(observation)
        given = [m.detections for m in masked]
        tracks, held = self._memory.tracks, self._memory.held
        observation = named_hands(observation, tracks, held, self._domain)
        masked = [
            self._cut_out(observation, f, m)
            for f, m in zip(observation.frames, masked, strict=True)
        ]
        views = self._views(observation, masked)
        self._memory.integrate(observation, views)
        self._eye = vec(observation.frames[-1].camera_to_world[:3, 3])
        self.named = tuple(map(with_names, given, views))
        if self._memory.forgotten:
            names = ", ".join(self._memory.forgotten)
            self.findings += (Finding("forgotten", f"no room to remember {names}", refuses=False),)
        return self._memory.graph()

    def acted(self, subtask: Subtask, succeeded: bool) -> None:
        """A skill was carried out: what it may have changed is not known until it is read again.

        Args:
            subtask: in the names of the graph.
            succeeded: whether the robot believes that it has done it.
        """
        if self._alters is not None:
            self._memory.doubt(self._alters(self._memory.graph(), subtask), succeeded)

    def best_vantage(self, eyes: Sequence[Vec3], points: Sequence[Vec3]) -> int | None:
        """See `Perceiver`."""
        if self._eye is None:
            return None
        tracks = self._memory.tracks
        return best_vantage(tracks, points, eyes, self._eye, self._domain, self._config)

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

    def _masks(self, observation: Observation) -> list[Masks]:
        """What the segmenter finds in each frame, once the gate has let it in."""
        frames = observation.frames
        together = getattr(self._segmenter, "segment_all", None)
        found = map(self._segmenter.segment, frames) if together is None else together(frames)
        masks = [
            Masks(detections, label_image(detections, frame.depth_m.shape))
            for frame, detections in zip(frames, found, strict=True)
        ]
        self.findings = ()
        if self._gate is not None:
            self.findings = inspect(observation, self._domain, self._gate, masks)
            refuse(self.findings)
        if self._watch is not None:
            self.findings += self._watch.look(observation)
            refuse(self.findings)
        return masks

    def _cut_out(self, observation: Observation, frame: Frame, masks: Masks) -> Masks:
        """Masks without what is not their thing's own, and surfaces that nothing masks."""
        movable = [not fixed(self._domain, d.category) for d in masks.detections]
        labels = own_pixels(frame, masks.labels, movable, self._config)
        if frame.colour_only:
            return masks
        furniture = [
            (t.low_m, t.high_m)
            for t in self._memory.tracks.values()
            if t.points_world_m is not None and fixed(self._domain, t.category)
        ]
        floor_m = observation.robot_position_world_m[2]
        return Masks(
            *with_surfaces(
                frame, masks.detections, labels, furniture, floor_m, self._domain, self._config
            )
        )

    def _views(self, observation: Observation, masked: Sequence[Masks]) -> list[View]:
        """Every frame with names for what it shows; what one frame tells the next ones know."""
        kinds = {d.category for m in masked for d in m.detections if d.instance is None}
        tracks, domain = self._memory.tracks, self._domain
        places = expected(tracks, observation, domain, kinds)
        axis_m = observation.robot_position_world_m
        used = {*tracks, *(n for n, _ in observation.told)}
        parts: dict[str, str] = {}
        views: list[View] = []
        for frame, masks in zip(observation.frames, masked, strict=True):
            view = self._view(frame, masks, places, axis_m, used)
            looks = view.looks or (None,) * len(view.ids)
            for name, category, cloud, look in zip(
                view.ids, view.categories, view.clouds, looks, strict=True
            ):
                if cloud is not None:
                    points = cloud.points_world_m
                    seen = known(category, points, cloud.centroid_m, domain, kinds, look)
                    places[name] = places[name].with_view(seen) if name in places else seen
            views.append(view)
            if kinds:
                apart = [set(v.ids) for v in views]
                parts |= join_parts(view, places, tracks, apart)
        for part, whole in parts.items():
            join(tracks, part, whole)
        views = [replace(v, ids=tuple(_whole(n, parts) for n in v.ids)) for v in views]
        return called_right(views, tracks, observation.hands, axis_m, domain)

    def _view(
        self,
        frame: Frame,
        masks: Masks,
        known: Mapping[str, Known],
        axis_m: Vec3,
        used: Collection[str],
    ) -> View:
        detections, labels = masks.detections, masks.labels
        states, sure = self._read(frame, detections)
        stays = [fixed(self._domain, d.category) for d in detections]
        voxel_m = [self._config.fixture_voxel_m if f else self._config.voxel_m for f in stays]
        found = clouds(frame, labels, voxel_m, self._config, [not f for f in stays])
        if self._gate is not None:
            least = self._gate.least_score
            found = [
                None if d.score < least else cloud
                for d, cloud in zip(detections, found, strict=True)
            ]
        nameless = any(d.instance is None for d in detections)
        looks = mean_looks(frame.rgb, labels, len(detections)) if nameless else []
        names = name_detections(detections, found, known, axis_m, self._config, used, looks)
        return View(
            frame=frame,
            labels=labels,
            ids=tuple(names),
            categories=tuple(d.category for d in detections),
            clouds=tuple(found),
            states=states,
            sure=sure,
            features=self._features(frame, detections, found),
            unlocated=tuple(_placeless(frame, detections, labels, found, known)),
            guessed=frozenset(
                n for n, d in zip(names, detections, strict=True) if d.instance is None
            ),
            looks=tuple(looks),
        )

    def _read(
        self, frame: Frame, detections: Sequence[Detection]
    ) -> tuple[tuple[Mapping[str, str | None], ...], tuple[Mapping[str, float], ...]]:
        """States of detections, and how sure they are where their estimator says so."""
        estimator = self._estimator
        if isinstance(estimator, ConfidentStateEstimator):
            told = estimator.estimate_with_confidence(frame, detections)
        else:
            told = [(states, {}) for states in estimator.estimate(frame, detections)]
        if len(told) != len(detections):
            raise PerceptionError(
                f"the state estimator {estimator.name!r} answered for {len(told)} of "
                f"{len(detections)} detections"
            )
        return tuple(states for states, _ in told), tuple(sure for _, sure in told)

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


def _whole(name: str, parts: Mapping[str, str]) -> str:
    while name in parts:
        name = parts[name]
    return name


def _placeless(
    frame: Frame,
    detections: Sequence[Detection],
    labels: Labels,
    found: Sequence[Cloud | None],
    known: Collection[str],
) -> Iterator[bool]:
    """Which detections show something that cannot be located, and that is not known already.

    One without an instance name may well be what was located before.
    """
    near = {category_of(n) for n in known}
    for label, (detection, cloud) in enumerate(zip(detections, found, strict=True)):
        if cloud is not None or (detection.instance is None and detection.category in near):
            yield False
        else:
            dark = not bool((frame.depth_m[labels == label] > 0).any())
            yield dark or detection.score < _GATE.least_score
