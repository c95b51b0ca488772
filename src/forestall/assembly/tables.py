"""What is shipped under which name: a table for each kind of part, and for what others wrote.

Read by `registry`; loads nothing of what it names.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from forestall import kinds
from forestall.types.kind import Kind


@dataclass(frozen=True, slots=True)
class Table:
    """The shipped parts of one kind.

    Args:
        kind: and the Protocol that they implement.
        default: the one that a run has when nothing is said. It stands only here.
        targets: name → "module:factory".
    """

    kind: Kind[Any]
    default: str
    targets: Mapping[str, str]


_SEEING = "forestall.assembly.seeing"
_JUDGING = "forestall.assembly.judging"
_EMBEDDINGS = "forestall.embeddings"
_VISION = "forestall.vision"
_LANGUAGE = "forestall.assembly.language"

TABLES: Mapping[str, Table] = {
    table.kind.name: table
    for table in (
        Table(
            kinds.WORLD,
            "kitchen",
            {
                "ai2thor": "forestall.worlds.ai2thor.part:Thor",
                "frankakitchen": "forestall.worlds.frankakitchen.part:FrankaKitchens",
                "kitchen": "forestall.worlds.kitchen.part:Kitchens",
                "symbolic": "forestall.testing.part:SymbolicWorlds",
            },
        ),
        Table(
            kinds.SENSOR,
            "perfect",
            {
                name: f"{_SEEING}:{name}"
                for name in ("kinect", "perfect", "realistic", "realsense", "tof")
            },
        ),
        Table(
            kinds.DOMAIN,
            "household",
            {
                name: f"{_SEEING}:{name}"
                for name in ("ai2thor", "bench", "frankakitchen", "household")
            },
        ),
        Table(
            kinds.SEGMENTER,
            "instance-ids",
            {
                "finder": f"{_SEEING}:finder",
                "instance-ids": f"{_SEEING}:instance_ids",
                "given-masks": f"{_SEEING}:given_masks",
            },
        ),
        Table(
            kinds.FINDER,
            "grounding-dino",
            {
                "grounding-dino": f"{_VISION}.grounding_dino:GroundingDinoFinder",
                "onnx": f"{_VISION}.onnx_finder:OnnxFinder",
                "owlv2": f"{_VISION}.owl:Owlv2Finder",
            },
        ),
        Table(
            kinds.OUTLINER,
            "depth",
            {
                "depth": "forestall.perception.outlines:DepthOutliner",
                "sam": f"{_VISION}.sam:SamOutliner",
            },
        ),
        Table(
            kinds.STATES,
            "learned",
            {
                **{
                    name: f"{_SEEING}:{name}"
                    for name in ("clip", "given", "learned", "oracle", "siglip")
                },
                "model": f"{_LANGUAGE}:model_states",
            },
        ),
        Table(
            kinds.PERCEIVER,
            "graph",
            {"given-graph": f"{_SEEING}:given_graph", "graph": f"{_SEEING}:graph"},
        ),
        Table(
            kinds.TEXT_ENCODER,
            "hashed-words",
            {
                "hashed-words": f"{_EMBEDDINGS}.hashed:HashedTextEncoder",
                "sentence": f"{_EMBEDDINGS}.sentence:SentenceEncoder",
                "two-tower": f"{_EMBEDDINGS}.twotower:TwoTowerEncoder",
            },
        ),
        Table(
            kinds.IMAGE_ENCODER,
            "two-tower",
            {
                "clip": f"{_EMBEDDINGS}.clip:ClipEncoder",
                "siglip": f"{_EMBEDDINGS}.siglip:SiglipEncoder",
                "two-tower": f"{_EMBEDDINGS}.twotower:TwoTowerEncoder",
            },
        ),
        Table(
            kinds.CAPTIONER,
            "listing",
            {"blip": f"{_EMBEDDINGS}.captioner:BlipCaptioner", "listing": f"{_SEEING}:listing"},
        ),
        Table(kinds.STORE, "sqlite", {"sqlite": f"{_JUDGING}:sqlite"}),
        Table(kinds.RETRIEVER, "embedding", {"embedding": f"{_JUDGING}:embedding"}),
        Table(
            kinds.DETECTOR,
            "scene-graph",
            {
                "caption": f"{_JUDGING}:caption",
                "image": f"{_JUDGING}:image",
                "objects": f"{_JUDGING}:objects",
                "preconditions": f"{_JUDGING}:always_held",
                "scene-graph": f"{_JUDGING}:scene_graph",
            },
        ),
        Table(
            kinds.EXPECTATIONS,
            "none",
            {
                "model": "forestall.assembly.expecting:model",
                "none": "forestall.comparison.expectations:NoExpectations",
            },
        ),
        Table(
            kinds.LLM,
            "none",
            {name: f"{_LANGUAGE}:{name}" for name in ("none", "openai", "replay")},
        ),
        Table(
            kinds.REASONER,
            "preconditions",
            {
                "model": f"{_LANGUAGE}:model_reasoner",
                "none": f"{_JUDGING}:no_reasoning",
                "preconditions": f"{_JUDGING}:preconditions",
            },
        ),
        Table(
            kinds.REPLANNER,
            "planner",
            {
                "anew": f"{_JUDGING}:anew",
                "model": f"{_LANGUAGE}:model_replanner",
                "planner": f"{_JUDGING}:planner",
            },
        ),
        Table(
            kinds.VALIDATOR,
            "graph",
            {
                "accept-all": "forestall.planning.validate:AcceptAll",
                "graph": f"{_JUDGING}:graph_validator",
            },
        ),
        Table(kinds.LIMIT, "patient", {"patient": "forestall.supervision:patient"}),
        Table(
            kinds.STRATEGY,
            "proactive",
            {
                "none": "forestall.strategies.none:NoReplanning",
                "online": f"{_JUDGING}:online",
                "online-scene": f"{_JUDGING}:online_scene",
                "plan-check": f"{_JUDGING}:plan_check",
                "post-hoc": f"{_JUDGING}:post_hoc",
                "proactive": f"{_JUDGING}:proactive",
                "retry-once": "forestall.strategies.retry:RetryOnce",
                "watch": "forestall.assembly.watching:watch",
            },
        ),
    )
}


NEEDS: Mapping[tuple[str, str], str] = {
    (kinds.WORLD.name, "ai2thor"): "ai2thor",
    (kinds.WORLD.name, "frankakitchen"): "kitchen",
    (kinds.WORLD.name, "kitchen"): "kitchen",
    (kinds.PERCEIVER.name, "graph"): "perception",
    **{(kinds.SENSOR.name, n): "perception" for n in ("kinect", "realistic", "realsense", "tof")},
    (kinds.STATES.name, "clip"): "vision",
    (kinds.STATES.name, "learned"): "perception",
    (kinds.STATES.name, "model"): "llm",
    (kinds.STATES.name, "siglip"): "vision",
    (kinds.TEXT_ENCODER.name, "sentence"): "text",
    (kinds.TEXT_ENCODER.name, "two-tower"): "perception",
    (kinds.IMAGE_ENCODER.name, "clip"): "vision",
    (kinds.IMAGE_ENCODER.name, "siglip"): "vision",
    (kinds.IMAGE_ENCODER.name, "two-tower"): "perception",
    (kinds.CAPTIONER.name, "blip"): "vision",
    (kinds.LLM.name, "openai"): "llm",
}
"""Kind and name of a shipped part that works only with an extra → that extra."""

FOREIGN: Mapping[str, str] = {
    "virtualhome": "forestall.worlds.virtualhome.household:Household",
}
"""Households that somebody else wrote (`seams.Foreign`): no part of a run. Others add theirs by
entry point, group "forestall.third-party"."""

DATA_SETS: Mapping[str, str] = {
    "folder": "forestall.assembly.log_folder:FolderRuns",
    "lerobot": "forestall.logs.lerobot_data:LeRobotData",
    "mcap": "forestall.logs.mcap_data:McapLogs",
    "record": "forestall.assembly.log_record:Records",
    "robofail": "forestall.worlds.ai2thor.robofail.dataset:RoboFail",
}
"""Recorded runs of others (`seams.DataSet`), each made with its folder: no part of a run. Others
add theirs by entry point, group "forestall.data-set"."""

LOGS: Mapping[str, str] = {
    "folder": "forestall.assembly.log_folder:FolderWriter",
    "lerobot": "forestall.logs.lerobot_out:LeRobotWriter",
    "mcap": "forestall.logs.mcap_out:McapWriter",
    "rerun": "forestall.logs.rerun_out:RerunWriter",
}
"""What writes a run as it happens (`logs.writing.LogWriter`), each made with a path: no part of a
run. Others add theirs by entry point, group "forestall.log"."""

PLAN_SETS: Mapping[str, str] = {
    "isbench": "forestall.worlds.isbench.tasks:Tasks",
    "safeagentbench": "forestall.worlds.ai2thor.safeagentbench.plans:SafeAgentBench",
}
"""Plans of others (`seams.PlanSet`), each made with its file or folder: no part of a run. Others
add theirs by entry point, group "forestall.plan-set"."""
