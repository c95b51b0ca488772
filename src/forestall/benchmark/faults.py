"""Faults: small, composable changes of a scene, of a plan, or of how skills are carried out.

Scenario files hold them as tables that `kind` tells apart; `Fault` is the type to embed in a file
schema. Scene faults edit `SceneNeeds` and plan faults edit a `Plan` before a run; execution faults
wrap the environment. Each execution fault applies `times` times, once by default, so that a
corrected plan can succeed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    model_validator,
)

from forestall.benchmark.execution_faults import FaultyEnvironment
from forestall.errors import InputError, UnknownNameError
from forestall.interfaces import Disturbance, Environment
from forestall.types.facts import category_of, is_instance
from forestall.types.plan import SKILLS, Plan, Subtask, same_step
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.vocabulary import Vocabulary, household


def _readable(text: str) -> str:
    try:
        return str(Subtask.parse(text))
    except InputError as error:
        raise ValueError(str(error)) from error


Step = Annotated[
    str,
    AfterValidator(_readable),
    Field(description="a subtask as plans write it, for example put_in(Plate, Microwave)"),
]
Occurrence = Annotated[int, Field(ge=1, description="which of several equal ones, from 1")]


class _Fault(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class AddObject(_Fault):
    """A further object; `in_front_of` makes it block another one."""

    kind: Literal["add_object"] = "add_object"
    category: str
    id: str | None = None
    places: tuple[str, ...] = ()
    states: dict[str, str] = Field(default_factory=dict)
    in_front_of: str | None = None


class SetState(_Fault):
    """Another start state of an object that the task asks for, or of a fixture."""

    kind: Literal["set_state"] = "set_state"
    object: str
    attribute: str
    value: str


class MoveObject(_Fault):
    """An object that the task asks for starts somewhere else."""

    kind: Literal["move_object"] = "move_object"
    object: str
    places: tuple[str, ...] = Field(min_length=1)


class RemoveObject(_Fault):
    """An object that the task asks for is missing."""

    kind: Literal["remove_object"] = "remove_object"
    object: str


class DropStep(_Fault):
    """The plan forgets a step."""

    kind: Literal["drop_step"] = "drop_step"
    step: Step
    occurrence: Occurrence = 1


class _Anchored(_Fault):
    before: Step | None = None
    after: Step | None = None
    occurrence: Occurrence = 1

    @model_validator(mode="after")
    def _one_anchor(self) -> _Anchored:
        if (self.before is None) == (self.after is None):
            raise ValueError("give one of 'before' and 'after', a step of the plan")
        return self


class InsertStep(_Anchored):
    """The plan has a step too many; `occurrence` counts the anchor step."""

    kind: Literal["insert_step"] = "insert_step"
    step: Step


class MoveStep(_Anchored):
    """The plan has a step at the wrong place; `occurrence` counts the moved step."""

    kind: Literal["move_step"] = "move_step"
    step: Step


class ReplaceArgument(_Fault):
    """The plan names another thing; `argument` is the role, object or target."""

    kind: Literal["replace_argument"] = "replace_argument"
    step: Step
    occurrence: Occurrence = 1
    argument: Literal["object", "target"]
    by: str


class ReplacePlan(_Fault):
    """Another plan altogether."""

    kind: Literal["replace_plan"] = "replace_plan"
    plan: tuple[Step, ...] = Field(min_length=1)


class _Execution(_Fault):
    step: Step
    occurrence: Occurrence = 1
    times: Annotated[int, Field(ge=1, description="how many times it happens at most")] = 1


class Drop(_Execution):
    """The held object slips out of the gripper while the step is carried out."""

    kind: Literal["drop"] = "drop"


class FailedAction(_Execution):
    """The step does nothing and reports success."""

    kind: Literal["failed_action"] = "failed_action"


class WrongObject(_Execution):
    """The step acts on another type than the plan names."""

    kind: Literal["wrong_object"] = "wrong_object"
    acts_on: str


class WrongReceptacle(_Execution):
    """The step puts the object on or into another receptacle than the plan names."""

    kind: Literal["wrong_receptacle"] = "wrong_receptacle"
    acts_on: str

    @model_validator(mode="after")
    def _has_receptacle(self) -> WrongReceptacle:
        skill = Subtask.parse(self.step).skill
        if len(SKILLS[skill]) < 2:
            fits = ", ".join(s for s, roles in SKILLS.items() if len(roles) == 2)
            raise ValueError(f"step {self.step} has no receptacle; it must be one of {fits}")
        return self


SceneFault = AddObject | SetState | MoveObject | RemoveObject
PlanFault = DropStep | InsertStep | MoveStep | ReplaceArgument | ReplacePlan
ExecutionFault = Drop | FailedAction | WrongObject | WrongReceptacle
Fault = Annotated[SceneFault | PlanFault | ExecutionFault, Field(discriminator="kind")]
"""Any fault, told apart by `kind`."""

_ADAPTER: TypeAdapter[Any] = TypeAdapter(Fault)


def parse_fault(table: Mapping[str, Any]) -> Any:
    """Read one fault from its table.

    Raises:
        InputError: an unknown kind or field, or a value that does not fit; names the field.
    """
    try:
        return _ADAPTER.validate_python(dict(table))
    except ValidationError as error:
        problems = "; ".join(
            f"{'.'.join(str(p) for p in e['loc']) or 'fault'}: {e['msg']}" for e in error.errors()
        )
        raise InputError(f"fault: {problems}") from error


def apply_scene_faults(
    needs: SceneNeeds, faults: Iterable[Any], vocabulary: Vocabulary
) -> SceneNeeds:
    """The scene with its scene faults; other faults are left for their own functions.

    Raises:
        InputError: a fault names an object, place, attribute or value that is not there.
    """
    for fault in faults:
        if isinstance(fault, AddObject):
            needs = _add(needs, fault, vocabulary)
        elif isinstance(fault, SetState):
            needs = _set(needs, fault, vocabulary)
        elif isinstance(fault, MoveObject):
            chosen = _chosen(needs, fault.object, "move_object.object", vocabulary)
            places = _places(fault.places, "move_object.places", vocabulary)
            objects = (
                replace(o, places=places, in_front_of=None) if o in chosen else o
                for o in needs.objects
            )
            needs = replace(needs, objects=tuple(objects))
        elif isinstance(fault, RemoveObject):
            chosen = _chosen(needs, fault.object, "remove_object.object", vocabulary)
            needs = replace(needs, objects=tuple(o for o in needs.objects if o not in chosen))
    return needs


def apply_plan_faults(plan: Plan, faults: Iterable[Any]) -> Plan:
    """The plan with its plan faults, in order.

    Raises:
        InputError: a fault names a step that the plan does not have.
    """
    steps = list(plan.subtasks)
    for fault in faults:
        if isinstance(fault, DropStep):
            del steps[_find(steps, fault.step, fault.occurrence, "drop_step.step")]
        elif isinstance(fault, InsertStep):
            at = _anchor(steps, fault, fault.occurrence)
            steps.insert(at, Subtask.parse(fault.step))
        elif isinstance(fault, MoveStep):
            moved = steps.pop(_find(steps, fault.step, fault.occurrence, "move_step.step"))
            steps.insert(_anchor(steps, fault, 1), moved)
        elif isinstance(fault, ReplaceArgument):
            at = _find(steps, fault.step, fault.occurrence, "replace_argument.step")
            steps[at] = _with_argument(steps[at], fault.argument, fault.by)
        elif isinstance(fault, ReplacePlan):
            steps = [Subtask.parse(s) for s in fault.plan]
    return replace(plan, subtasks=tuple(steps))


def check_steps(plan: Plan, faults: Iterable[Any], vocabulary: Vocabulary) -> None:
    """Check the names in a plan that faults have changed, and that execution faults can happen.

    Raises:
        InputError: an unknown thing, or a fault of a step that the plan does not have.
    """
    for subtask in plan:
        for name in subtask.args:
            vocabulary[name]
    for fault in faults:
        if not isinstance(fault, Drop | FailedAction | WrongObject | WrongReceptacle):
            continue
        step = Subtask.parse(fault.step)
        for name in (*step.args, *([fault.acts_on] if hasattr(fault, "acts_on") else [])):
            vocabulary[name]
        times = sum(
            same_step(_canonical(s, vocabulary), _canonical(step, vocabulary)) for s in plan
        )
        if times < fault.occurrence:
            raise InputError(
                f"{fault.kind}.step: {step} comes {times} time(s) in the plan, "
                f"which has: {', '.join(plan.texts())}"
            )


def _canonical(subtask: Subtask, vocabulary: Vocabulary) -> Subtask:
    return Subtask(subtask.skill, tuple(vocabulary.canonical(a) for a in subtask.args))


def wrap(
    environment: Environment,
    faults: Iterable[Any],
    disturbance: Disturbance,
    vocabulary: Vocabulary | None = None,
) -> Environment:
    """The environment with its execution faults; the same one where there are none."""
    chosen = [
        f for f in faults if isinstance(f, Drop | FailedAction | WrongObject | WrongReceptacle)
    ]
    if not chosen:
        return environment
    return FaultyEnvironment(environment, chosen, disturbance, vocabulary or household())


def _add(needs: SceneNeeds, fault: AddObject, vocabulary: Vocabulary) -> SceneNeeds:
    category = vocabulary[fault.category]
    if category.fixture:
        raise InputError(
            f"add_object.category: {category.name} is a fixture; fixtures belong to the room"
        )
    taken = {o.id for o in needs.objects}
    number = 1
    while fault.id is None and f"{category.name}-{number}" in taken:
        number += 1
    name = fault.id or f"{category.name}-{number}"
    if name in taken:
        raise InputError(f"add_object.id: {name} is already in the scene")
    if category_of(name) != category.name or not is_instance(name):
        raise InputError(f"add_object.id: {name!r} must read {category.name}-<number>")
    for attribute, value in fault.states.items():
        _check_state(category.name, attribute, value, "add_object.states", vocabulary)
    front = fault.in_front_of
    if front is not None:
        front = _chosen(needs, front, "add_object.in_front_of", vocabulary)[0].id
    places = _places(fault.places, "add_object.places", vocabulary)
    for place in places:
        if not vocabulary.accepts(place, category.name):
            raise InputError(f"add_object.places: {place} does not take {category.name}")
    need = ObjectNeed(name, category.name, places, tuple(sorted(fault.states.items())), front)
    return replace(needs, objects=(*needs.objects, need))


def _set(needs: SceneNeeds, fault: SetState, vocabulary: Vocabulary) -> SceneNeeds:
    name = vocabulary.canonical(fault.object)
    category = vocabulary[name]
    _check_state(category.name, fault.attribute, fault.value, "set_state", vocabulary)
    if category.fixture:
        instance = name if is_instance(name) else f"{name}-1"
        kept = tuple(f for f in needs.fixtures if f[:2] != (instance, fault.attribute))
        return replace(needs, fixtures=(*kept, (instance, fault.attribute, fault.value)))
    chosen = _chosen(needs, name, "set_state.object", vocabulary)
    objects = (
        replace(o, states=tuple(sorted((dict(o.states) | {fault.attribute: fault.value}).items())))
        if o in chosen
        else o
        for o in needs.objects
    )
    return replace(needs, objects=tuple(objects))


def _check_state(
    category: str, attribute: str, value: str, field: str, vocabulary: Vocabulary
) -> None:
    known = vocabulary[category].attributes
    if attribute not in known:
        raise UnknownNameError(f"attribute of {category} ({field})", attribute, known)
    values = vocabulary.values(attribute)
    if value not in values:
        raise UnknownNameError(f"value of {attribute} ({field})", value, values)


def _places(places: Sequence[str], field: str, vocabulary: Vocabulary) -> tuple[str, ...]:
    names = tuple(vocabulary.canonical(p) for p in places)
    for name in names:
        if vocabulary[name].receptacle is None:
            raise InputError(f"{field}: nothing can be put on or into {name}")
    return names


def _chosen(
    needs: SceneNeeds, name: str, field: str, vocabulary: Vocabulary
) -> tuple[ObjectNeed, ...]:
    """The needs that an instance or category name means."""
    wanted = vocabulary.canonical(name)
    found = tuple(o for o in needs.objects if wanted in (o.id, o.category))
    if not found:
        known = {n for o in needs.objects for n in (o.id, o.category)}
        raise UnknownNameError(f"object of the task ({field})", name, known)
    return found


def _find(steps: Sequence[Subtask], text: str, occurrence: int, field: str) -> int:
    wanted = Subtask.parse(text)
    at = [i for i, s in enumerate(steps) if s == wanted]
    if not at:
        raise UnknownNameError(f"step of the plan ({field})", text, {str(s) for s in steps})
    if occurrence > len(at):
        raise InputError(f"{field}: {text} is in the plan {len(at)} time(s), not {occurrence}")
    return at[occurrence - 1]


def _anchor(steps: Sequence[Subtask], fault: InsertStep | MoveStep, occurrence: int) -> int:
    if fault.before is not None:
        return _find(steps, fault.before, occurrence, f"{fault.kind}.before")
    return _find(steps, fault.after or "", occurrence, f"{fault.kind}.after") + 1


def _with_argument(step: Subtask, role: str, by: str) -> Subtask:
    roles = SKILLS[step.skill]
    if role not in roles:
        raise InputError(
            f"replace_argument.argument: {step} has no {role}; it has {', '.join(roles)}"
        )
    args = tuple(by if r == role else a for r, a in zip(roles, step.args, strict=True))
    return Subtask(step.skill, args)
