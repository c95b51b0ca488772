"""What can be chosen by name: one table for each kind, loaded only when asked for.

Read by the rest of this package. A part is a factory: a function or a class whose keyword
parameters are its options (`assembly.options`) and whose first parameter, if it is called `parts`,
lends it what it needs (`seams.Parts`). Others add theirs by entry point, group "forestall.<kind>",
for example

    [project.entry-points."forestall.segmenter"]
    my-segmenter = "my_package.masks:MySegmenter"

or are named where they stand: "my_package.masks:MySegmenter".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points, packages_distributions
from typing import Any

from forestall import kinds
from forestall.domain.load import load_domain
from forestall.errors import InputError, UnknownNameError
from forestall.extras import installed, missed
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
                name: f"{_SEEING}:{name}"
                for name in ("clip", "given", "learned", "oracle", "siglip")
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
    (kinds.TEXT_ENCODER.name, "sentence"): "text",
    (kinds.TEXT_ENCODER.name, "two-tower"): "perception",
    (kinds.IMAGE_ENCODER.name, "clip"): "vision",
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


@dataclass(frozen=True, slots=True)
class Found:
    """A factory and where it comes from.

    Args:
        kind: of the part.
        name: of the part.
        factory: builds it.
        package: whose it is in words, None for a shipped one.
    """

    kind: str
    name: str
    factory: Callable[..., Any]
    package: str | None

    @property
    def text(self) -> str:
        """Which part is meant, for messages."""
        of = "" if self.package is None else f" of the package {self.package}"
        return f"{self.kind} {self.name!r}{of}"


def default(kind: Kind[Any]) -> str:
    """The part of a kind that a run has when nothing is said."""
    return TABLES[kind.name].default


def table(kind: str) -> Table:
    """The table of a kind.

    Raises:
        UnknownNameError: no such kind.
    """
    if kind not in TABLES:
        raise UnknownNameError("kind of part", kind, TABLES)
    return TABLES[kind]


def known(kind: str) -> tuple[str, ...]:
    """Every name of a kind, entry points included."""
    return tuple(sorted({*table(kind).targets, *(e.name for e in _entries(kind))}))


def lacking(kind: str, name: str) -> str | None:
    """The extra without which a part does not work, where it is not installed."""
    extra = NEEDS.get((kind, name))
    return None if extra is None or installed(extra) else extra


def find(kind: str, name: str) -> Found:
    """The factory behind a name, behind "module:attribute", or behind the file of a domain.

    Raises:
        UnknownNameError: no such name.
        InputError: it is known and cannot be imported.
    """
    if (target := table(kind).targets.get(name)) is not None:
        try:
            return Found(kind, name, _imported(target), None)
        except ImportError as error:
            why = missed(error) or error
            raise InputError(f"{kind} {name!r} cannot be loaded ({target}): {why}") from error
    target, package = name, None
    for entry in _entries(kind):
        if entry.name == name:
            target, package = entry.value, _package(entry)
    if kind == kinds.DOMAIN.name and name.endswith((".toml", ".pddl")):
        return Found(kind, name, _domain_file(name), None)
    if ":" not in target:
        raise UnknownNameError(kind, name, known(kind))
    package = package or _owner(target)
    try:
        return Found(kind, name, _imported(target), package)
    except Exception as error:  # somebody else's code: whatever breaks is told with its package
        raise InputError(
            f"{kind} {name!r} of the package {package} cannot be loaded ({target}): "
            f"{type(error).__name__}: {error}"
        ) from error


def foreign(name: str) -> Callable[..., Any]:
    """What makes a household of others, by its name.

    Raises:
        UnknownNameError: no such household.
        InputError: it is known and cannot be imported.
    """
    return _of_others("household", name, FOREIGN, "third-party")


def data_set(name: str) -> Callable[..., Any]:
    """What opens recorded runs of others, by the name of their data set.

    Raises:
        UnknownNameError: no such data set.
        InputError: it is known and cannot be imported.
    """
    return _of_others("data set", name, DATA_SETS, "data-set")


def log(name: str) -> Callable[..., Any]:
    """What writes a log, by its name.

    Raises:
        UnknownNameError: no such log.
        InputError: it is known and cannot be imported.
    """
    return _of_others("log", name, LOGS, "log")


def plan_set(name: str) -> Callable[..., Any] | None:
    """What opens plans of others, by the name of their set; None where no set has it.

    Raises:
        InputError: it is known and cannot be imported.
    """
    if name not in PLAN_SETS and name not in {e.name for e in _entries("plan-set")}:
        return None
    return _of_others("set of plans", name, PLAN_SETS, "plan-set")


def imported_sets() -> tuple[str, ...]:
    """Every name that `forestall import` takes."""
    others = [e.name for group in ("data-set", "plan-set") for e in _entries(group)]
    return tuple(sorted({*DATA_SETS, *PLAN_SETS, *others}))


def _of_others(what: str, name: str, shipped: Mapping[str, str], group: str) -> Callable[..., Any]:
    others = {e.name: e.value for e in _entries(group)}
    target = shipped.get(name, others.get(name))
    if target is None:
        raise UnknownNameError(what, name, (*shipped, *others))
    try:
        return _imported(target)
    except ImportError as error:
        why = missed(error) or error
        raise InputError(f"{what} {name!r} cannot be loaded ({target}): {why}") from error


def _entries(kind: str) -> tuple[EntryPoint, ...]:
    return tuple(entry_points(group=f"forestall.{kind}"))


@cache
def _domain_file(path: str) -> Callable[..., Any]:
    def read() -> Any:
        return load_domain(path)

    return read


def _imported(target: str) -> Callable[..., Any]:
    module, _, attribute = target.partition(":")
    try:
        factory: Callable[..., Any] = getattr(import_module(module), attribute)
    except AttributeError as error:
        raise ImportError(f"{module} has no {attribute!r}") from error
    return factory


def _package(entry: EntryPoint) -> str | None:
    return None if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"


def _owner(target: str) -> str:
    """The distribution that a module comes from; the module's first name where it has none."""
    top = target.partition(":")[0].partition(".")[0]
    return ", ".join(dict.fromkeys(packages_distributions().get(top, [top])))
