"""Caption-based comparison (paper, Sec. 3): do the references' descriptions say the same?

Called like every detector at a boundary; calls the captioner and the text encoder that it was
given.
"""

from __future__ import annotations

from collections.abc import Sequence

from forestall.detection.baseline import check_same, judged, of_nearest
from forestall.detection.scene_graph import DetectorConfig
from forestall.embeddings.views import caption_rows
from forestall.seams.perceiving import Captioner, TextEncoder
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.verdict import Reference, Verdict, demonstrations_of, scenes


class CaptionDetector:
    """Judges by the cosine of captions, the best over the references (implements `Detector`).

    A reference without a caption is not compared with, nor one whose caption has no words where the
    scene's has none either; with words on one side only the score is 0.
    """

    name = "caption"

    def __init__(
        self,
        captioner: Captioner,
        encoder: TextEncoder,
        config: DetectorConfig | None = None,
    ) -> None:
        self._captioner = captioner
        self._encoder = encoder
        self._config = config or DetectorConfig()

    def noticed(
        self, verdict: Verdict, observed: SceneGraph, observation: Observation | None
    ) -> tuple[str, ...]:
        """What it sees of a mismatch: the two captions."""
        if verdict.nearest is None or observation is None:
            return ()
        view = verdict.nearest.view
        then = "" if view is None else view.caption
        now = self._captioner.caption(observation, observed)
        lines = of_nearest(verdict, "the caption", "caption")
        return (f"now: {now}", f"then: {then}", *lines) if lines else ()

    def judge(
        self, observed: SceneGraph, observation: Observation | None, references: Sequence[Reference]
    ) -> Verdict:
        """Compare what the captioner says with what it said of every reference.

        Raises:
            InputError: a reference's caption comes from another captioner.
        """
        references = scenes(references)
        if observation is None:
            return judged(
                self.name, self._config, (), demonstrations_of(references), "no picture was given"
            )
        kept = []
        for r in references:
            if r.view is not None and r.view.captioner:
                check_same("caption", self._captioner.name, r.view.captioner, r)
                kept.append((r, r.view.caption))
        scores = []
        if kept:
            mine = self._captioner.caption(observation, observed)
            rows = caption_rows(self._encoder, [mine, *(text for _, text in kept)])
            scores = [
                (round(float(rows[0] @ row), 6), r)
                for (r, _), row in zip(kept, rows[1:], strict=True)
                if rows[0].any() or row.any()
            ]
        nothing = "nothing is said of either side" if kept else "no reference keeps a caption"
        return judged(self.name, self._config, scores, demonstrations_of(references), nothing)
