"""forestall: see a failing subtask coming, explain it, replan, succeed.

    from forestall import Monitor

    monitor = Monitor.from_demonstrations("memory.db")
    print(monitor.check(scene, "insert(peg-1, hole-1)"))

Everything that is named here is public, and nothing else is. Importing the package loads nothing
heavy: each name is looked up when it is first used. See `docs/python.md`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from forestall.types.drawing import drawn_by as _drawn_by

if TYPE_CHECKING:
    from forestall.assembly.monitor import Monitor as Monitor
    from forestall.assembly.opening import OpenTask as OpenTask
    from forestall.assembly.opening import open_task as open_task
    from forestall.conclusion import MonitorConfig as MonitorConfig
    from forestall.domain.load import load_domain as load_domain
    from forestall.domain.model import Domain as Domain
    from forestall.errors import ForestallError as ForestallError
    from forestall.errors import InputError as InputError
    from forestall.errors import ObservationError as ObservationError
    from forestall.errors import PartError as PartError
    from forestall.learning.learn import Learnt as Learnt
    from forestall.learning.learn import learn as learn
    from forestall.memory.store import SqliteStore as Memory
    from forestall.memory.store import open_store as open_memory
    from forestall.perception.scenes import Conventions as Conventions
    from forestall.perception.scenes import Found as Found
    from forestall.perception.scenes import Hand as Hand
    from forestall.perception.scenes import Picture as Picture
    from forestall.perception.scenes import Scenes as Scenes
    from forestall.supervision import Limits as Limits
    from forestall.types.decision import Hold as Hold
    from forestall.types.decision import MonitorDecision as MonitorDecision
    from forestall.types.decision import Outcome as Outcome
    from forestall.types.demonstration import Demonstration as Demonstration
    from forestall.types.demonstration import DemonstrationStep as DemonstrationStep
    from forestall.types.episode import ExecutedRecord as ExecutedRecord
    from forestall.types.episode import SkillOutcome as SkillOutcome
    from forestall.types.episode import SkillStatus as SkillStatus
    from forestall.types.facts import Literal as Literal
    from forestall.types.facts import Truth as Truth
    from forestall.types.finding import Finding as Finding
    from forestall.types.graph import Box as Box
    from forestall.types.graph import ObjectNode as ObjectNode
    from forestall.types.graph import Relation as Relation
    from forestall.types.graph import SceneGraph as SceneGraph
    from forestall.types.graph import Seen as Seen
    from forestall.types.observation import Detection as Detection
    from forestall.types.observation import Frame as Frame
    from forestall.types.observation import GripperState as GripperState
    from forestall.types.observation import Intrinsics as Intrinsics
    from forestall.types.observation import Observation as Observation
    from forestall.types.plan import Plan as Plan
    from forestall.types.plan import Subtask as Subtask
    from forestall.types.symbolic import scene_graph as scene_graph
    from forestall.types.task import Goal as Goal
    from forestall.types.task import Task as Task
    from forestall.types.verdict import Diagnosis as Diagnosis
    from forestall.types.verdict import Verdict as Verdict

__version__ = "0.1.0"

_drawn_by("forestall.report.notebook")  # graphs, verdicts, diagnoses and records in notebooks

_PUBLIC = {
    "Box": "types.graph",
    "Conventions": "perception.scenes",
    "Demonstration": "types.demonstration",
    "DemonstrationStep": "types.demonstration",
    "Detection": "types.observation",
    "Diagnosis": "types.verdict",
    "Domain": "domain.model",
    "ExecutedRecord": "types.episode",
    "Finding": "types.finding",
    "ForestallError": "errors",
    "Found": "perception.scenes",
    "Frame": "types.observation",
    "Goal": "types.task",
    "GripperState": "types.observation",
    "Hand": "perception.scenes",
    "Hold": "types.decision",
    "InputError": "errors",
    "Intrinsics": "types.observation",
    "Learnt": "learning.learn",
    "Limits": "supervision",
    "Literal": "types.facts",
    "Memory": "memory.store:SqliteStore",
    "Monitor": "assembly.monitor",
    "MonitorConfig": "conclusion",
    "MonitorDecision": "types.decision",
    "ObjectNode": "types.graph",
    "Observation": "types.observation",
    "ObservationError": "errors",
    "OpenTask": "assembly.opening",
    "Outcome": "types.decision",
    "PartError": "errors",
    "Picture": "perception.scenes",
    "Plan": "types.plan",
    "Relation": "types.graph",
    "SceneGraph": "types.graph",
    "Scenes": "perception.scenes",
    "Seen": "types.graph",
    "SkillOutcome": "types.episode",
    "SkillStatus": "types.episode",
    "Subtask": "types.plan",
    "Task": "types.task",
    "Truth": "types.facts",
    "Verdict": "types.verdict",
    "learn": "learning.learn",
    "load_domain": "domain.load",
    "open_memory": "memory.store:open_store",
    "open_task": "assembly.opening",
    "scene_graph": "types.symbolic",
}
"""Public name → module, and behind a colon what it is called there, where that differs."""

__all__ = [
    "Box",
    "Conventions",
    "Demonstration",
    "DemonstrationStep",
    "Detection",
    "Diagnosis",
    "Domain",
    "ExecutedRecord",
    "Finding",
    "ForestallError",
    "Found",
    "Frame",
    "Goal",
    "GripperState",
    "Hand",
    "Hold",
    "InputError",
    "Intrinsics",
    "Learnt",
    "Limits",
    "Literal",
    "Memory",
    "Monitor",
    "MonitorConfig",
    "MonitorDecision",
    "ObjectNode",
    "Observation",
    "ObservationError",
    "OpenTask",
    "Outcome",
    "PartError",
    "Picture",
    "Plan",
    "Relation",
    "SceneGraph",
    "Scenes",
    "Seen",
    "SkillOutcome",
    "SkillStatus",
    "Subtask",
    "Task",
    "Truth",
    "Verdict",
    "learn",
    "load_domain",
    "open_memory",
    "open_task",
    "scene_graph",
]


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, called = _PUBLIC[name].partition(":")
    found = getattr(import_module(f"{__name__}.{module}"), called or name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
