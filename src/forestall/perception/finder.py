"""The segmenter for real pictures: a detector's boxes, outlined, with the domain's categories.

Called by the perceiver; calls a finder and an outliner that are handed in. What is asked for are
the words of the domain's categories, or all that a detector of fixed classes knows; its answers
come back as categories. Several boxes of one thing become one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from forestall.domain.model import Domain
from forestall.domain.words import Words
from forestall.errors import InputError, PerceptionError, UnknownNameError
from forestall.perception.config import PerceptionConfig
from forestall.seams.perceiving import Finder, Outliner
from forestall.types.grounding import GroundedBox
from forestall.types.observation import Detection, Frame

_LEAST = PerceptionConfig().min_pixels


@dataclass(frozen=True, slots=True)
class FinderConfig:
    """What is asked for, and which boxes are of one thing.

    Args:
        categories: of the domain that are looked for; all of them if empty.
        synonyms: whether their other words are asked for, too: finds more, takes longer.
        same_overlap: boxes of one category that overlap (IoU) by more are of one thing; 0.5 as
            detectors are scored (Everingham et al., The PASCAL VOC Challenge, IJCV 2010).
        other_overlap: boxes of two categories that overlap by more are one thing that was called
            two things; the surer word is taken.
        min_pixels: masks with fewer are left out.
    """

    categories: tuple[str, ...] = ()
    synonyms: bool = False
    same_overlap: float = 0.5
    other_overlap: float = 0.8
    min_pixels: int = _LEAST

    def __post_init__(self) -> None:
        for name in ("same_overlap", "other_overlap"):
            if not 0 < getattr(self, name) <= 1:
                raise InputError(f"{name} is above 0 and at most 1, got {getattr(self, name)}")


class FoundSegmenter:
    """Pictures → masks with categories (implements `Segmenter`); nothing is tracked.

    Args:
        finder: boxes around what phrases name.
        outliner: masks of boxes.
        domain: whose categories are looked for.
        config: see above.

    Raises:
        UnknownNameError: a category that the domain, or the finder, does not have.
    """

    tracks = False

    def __init__(
        self,
        finder: Finder,
        outliner: Outliner,
        domain: Domain,
        config: FinderConfig | None = None,
    ) -> None:
        self._finder, self._outliner = finder, outliner
        self._config = config or FinderConfig()
        self._categories = _asked(domain, finder.vocabulary, self._config)
        self.name = f"{finder.name}, outlined by {outliner.name}"

    @property
    def phrases(self) -> tuple[str, ...]:
        """What is asked for."""
        return tuple(self._categories)

    def segment(self, frame: Frame) -> Sequence[Detection]:
        """What is found in one frame, which may be nothing."""
        return self._outlined(frame, self._finder.find([frame.rgb], self.phrases)[0])

    def segment_all(self, frames: Sequence[Frame]) -> Sequence[Sequence[Detection]]:
        """What is found in each frame of an observation.

        Raises:
            PerceptionError: nothing in any of them. A scene without a single thing and a detector
                that sees none look the same, and of neither may it be said that things are gone.
        """
        boxes = self._finder.find([f.rgb for f in frames], self.phrases)
        found = [self._outlined(f, b) for f, b in zip(frames, boxes, strict=True)]
        if not any(found):
            more = f", ... {len(self.phrases)} in all" if len(self.phrases) > 4 else ""
            several = "s" if len(frames) > 1 else ""
            raise PerceptionError(
                f"the finder {self._finder.name!r} found none of the things that it was asked for "
                f"({', '.join(self.phrases[:4])}{more}) in {len(frames)} picture{several}: ask for "
                "others (segmenter.categories), or take less sure answers (finder.least_score)"
            )
        return found

    def _outlined(self, frame: Frame, boxes: Sequence[GroundedBox]) -> list[Detection]:
        kept = self._apart(boxes)
        masks = self._outliner.outline(frame, [box.corners for box in kept])
        return [
            Detection(
                self._categories[box.phrase],
                mask,
                score=box.score,
                outlined=self._outliner.exact,
            )
            for box, mask in zip(kept, masks, strict=True)
            if int(mask.sum()) >= self._config.min_pixels
        ]

    def _apart(self, boxes: Sequence[GroundedBox]) -> list[GroundedBox]:
        """One box for each thing, the surest first."""
        kept: list[GroundedBox] = []
        for box in sorted(boxes, key=lambda b: (-b.score, b.phrase, b.corners)):
            category = self._categories[box.phrase]
            for other in kept:
                same = self._categories[other.phrase] == category
                most = self._config.same_overlap if same else self._config.other_overlap
                if box.overlap(other) > most:
                    break
            else:
                kept.append(box)
        return kept


def _asked(
    domain: Domain, vocabulary: Sequence[str] | None, config: FinderConfig
) -> dict[str, str]:
    """Phrase → category. What a detector knows and the domain does not is a thing all the same."""
    wanted = [domain[name].name for name in config.categories]
    if vocabulary is None:
        found: dict[str, str] = {}
        for name in wanted or domain.categories:
            category = domain.categories[name]
            for phrase in (category.spoken, *(category.synonyms if config.synonyms else ())):
                found.setdefault(phrase, name)
        return found
    words = Words(domain)
    known = {said: words.category(said) for said in vocabulary}
    missing = sorted(set(wanted) - set(known.values()))
    if missing:
        raise UnknownNameError("class of the finder", missing[0], sorted(set(known.values())))
    return {said: c for said, c in known.items() if not wanted or c in wanted}
