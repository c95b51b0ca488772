"""What task and scenario files may hold: the tables of `files`, as pydantic checks them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from forestall.tasks.faults import Fault

Clutter = Annotated[int, Field(strict=True, ge=0, le=100)]
"""How many things that have nothing to do with the task; a room does not hold a hundred."""

_NAME = r"^[a-z0-9]+(-[a-z0-9]+)*$"


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class GoalFile(_Model):
    """The goal table: what must hold in the end, and what must never have happened."""

    text: str
    variables: dict[str, str] = Field(default_factory=dict)
    all: list[str] = Field(min_length=1)
    never: list[str] = Field(default_factory=list)
    weak: list[str] = Field(default_factory=list)


class ObjectFile(_Model):
    """One object that the scene must hold."""

    category: str
    id: str | None = None
    places: list[str] = Field(default_factory=list)
    states: dict[str, str] = Field(default_factory=dict)
    in_front_of: str | None = None


class SceneFile(_Model):
    """The scene table."""

    room: str = ""
    clutter: tuple[Clutter, Clutter] = (2, 6)
    objects: list[ObjectFile] = Field(default_factory=list)
    fixtures: dict[str, dict[str, str]] = Field(default_factory=dict)


class AttributeFile(_Model):
    """A new attribute, or other phrases for a known one; `domain.load` checks what it says."""

    model_config = ConfigDict(
        extra="allow", frozen=True, json_schema_extra={"additionalProperties": False}
    )

    values: list[str] | None = None
    bins: list[float] | None = None
    unit: str | None = None
    phrases: dict[str, list[str]] | None = None
    camera: bool | None = None
    by_category: dict[str, dict[str, list[str]]] | None = None


class TaskFile(_Model):
    """A task file."""

    name: str = Field(pattern=_NAME)
    title: str
    domain: str | None = None
    plan: list[str] = Field(min_length=1)
    goal: GoalFile
    scene: SceneFile = SceneFile()
    attributes: dict[str, AttributeFile] = Field(default_factory=dict)
    categories: dict[str, dict[str, Any]] = Field(default_factory=dict)


class ScenarioFields(_Model):
    """What every scenario has; `Scenario` in `files` says what each field means."""

    name: str = Field(pattern=_NAME)
    title: str
    kind: str
    cause: str
    source: str = ""
    known: str | None = None
    effect: str | None = None
    compared: bool | None = None
    faults: list[Fault] = Field(min_length=1)


class ScenarioFile(ScenarioFields):
    """A scenario file: a task with faults."""

    task: str


class ScenarioSetFile(_Model):
    """Several scenarios of one task; the folder that it lies in names their set."""

    task: str
    scenarios: list[ScenarioFields] = Field(min_length=1)
