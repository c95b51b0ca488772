"""Explicit tables of what can be chosen by name, loaded only when asked for.

Others add their own by entry point: group "forestall.<kind>", for example

    [project.entry-points."forestall.segmenter"]
    my-segmenter = "my_package.masks:MySegmenter"
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from forestall.errors import InputError, UnknownNameError

TABLES: dict[str, dict[str, str]] = {
    "strategy": {
        "none": "forestall.strategies.none:NoReplanning",
        "online": "forestall.strategies.online:Online",
        "online-scene": "forestall.strategies.online:OnlineScene",
        "post-hoc": "forestall.strategies.post_hoc:PostHoc",
        "proactive": "forestall.strategies.proactive:Proactive",
        "watch": "forestall.strategies.watch:Watch",
    },
    "detector": {
        "caption": "forestall.detection.caption:CaptionDetector",
        "image": "forestall.detection.image:ImageDetector",
        "objects": "forestall.detection.objects:ObjectCountDetector",
        "scene-graph": "forestall.detection.scene_graph:SceneGraphDetector",
    },
    "captioner": {
        "blip": "forestall.embeddings.captioner:BlipCaptioner",
        "listing": "forestall.embeddings.captions:ListingCaptioner",
    },
    "segmenter": {
        "instance-ids": "forestall.perception.segmenters:InstanceSegmenter",
        "given-masks": "forestall.perception.segmenters:GivenMasks",
    },
    "states": {
        "clip": "forestall.perception.learned:LearnedStateEstimator",
        "learned": "forestall.perception.learned:LearnedStateEstimator",
        "oracle": "forestall.perception.oracle:OracleStateEstimator",
        "given": "forestall.perception.given:GivenStateEstimator",
    },
    "image-encoder": {
        "clip": "forestall.embeddings.clip:ClipEncoder",
        "two-tower": "forestall.embeddings.twotower:TwoTowerEncoder",
    },
    "encoder": {
        "hashed-words": "forestall.embeddings.hashed:HashedTextEncoder",
        "sentence": "forestall.embeddings.sentence:SentenceEncoder",
        "two-tower": "forestall.embeddings.twotower:TwoTowerEncoder",
    },
}


def known(kind: str) -> tuple[str, ...]:
    """Every name of a kind, entry points included."""
    others = (e.name for e in entry_points(group=f"forestall.{kind}"))
    return tuple(sorted({*TABLES[kind], *others}))


def load(kind: str, name: str) -> Any:
    """The class behind a name.

    Raises:
        UnknownNameError: no such name.
        InputError: it is known and cannot be imported.
    """
    target = TABLES[kind].get(name)
    if target is None:
        for entry in entry_points(group=f"forestall.{kind}"):
            if entry.name == name:
                target = entry.value
        if target is None:
            raise UnknownNameError(kind, name, known(kind))
    module, _, attribute = target.partition(":")
    try:
        return getattr(import_module(module), attribute)
    except ImportError as error:
        raise InputError(f"{kind} {name!r} cannot be loaded ({target}): {error}") from error
