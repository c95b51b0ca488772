"""Image-level comparison (paper, Sec. 3): how like the references' pictures is this one?

Called like every detector at a boundary; calls the image encoder that it was given.
"""

from __future__ import annotations

from collections.abc import Sequence

from forestall.detection.baseline import check_same, judged, of_nearest
from forestall.detection.scene_graph import DetectorConfig
from forestall.embeddings.views import image_feature
from forestall.errors import InputError
from forestall.seams.perceiving import ImageEncoder
from forestall.types.feature import unquantised
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.verdict import Reference, Verdict, demonstrations_of, scenes


class ImageDetector:
    """Judges by the cosine of whole pictures, the best over the references (implements `Detector`).

    It sees the picture of the observation (`embeddings/views.py`) and nothing of the graph. A
    reference whose picture was not kept is not compared with.
    """

    name = "image"

    def __init__(self, encoder: ImageEncoder, config: DetectorConfig | None = None) -> None:
        self._encoder = encoder
        self._config = config or DetectorConfig()

    def noticed(
        self, verdict: Verdict, observed: SceneGraph, observation: Observation | None
    ) -> tuple[str, ...]:
        """What it sees of a mismatch: how alike the nearest picture is, and which one it is."""
        return of_nearest(verdict, "the picture", "picture")

    def judge(
        self, observed: SceneGraph, observation: Observation | None, references: Sequence[Reference]
    ) -> Verdict:
        """Compare the picture with that of every reference.

        Raises:
            InputError: a reference's feature comes from another encoder.
        """
        references = scenes(references)
        if observation is None:
            return judged(
                self.name, self._config, (), demonstrations_of(references), "no picture was given"
            )
        kept = []
        for r in references:
            if r.view is not None and r.view.image is not None:
                check_same("picture", self._encoder.name, r.view.encoder, r)
                kept.append((r, unquantised(r.view.image)))
        scores = []
        if kept:
            mine = unquantised(image_feature(self._encoder, observation))
            for r, row in kept:
                if row.shape != mine.shape:
                    raise InputError(
                        f"the picture of demonstration {r.demonstration} has {row.size} "
                        f"components, this run's {mine.size}"
                    )
                scores.append((round(float(mine @ row), 6), r))
        return judged(
            self.name,
            self._config,
            scores,
            demonstrations_of(references),
            "no reference keeps its picture",
        )
