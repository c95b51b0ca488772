"""Faults: small, composable changes of a scene, of a plan, or of how skills are carried out.

Scenario files hold them as tables that `kind` tells apart; `Fault` is the type to embed in a file
schema. Scene faults (`scene_faults`) edit `SceneNeeds` and plan faults edit a `Plan` before a run;
execution faults wrap the environment. Each execution fault applies `times` times, once by default,
so that a corrected plan can succeed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    Field,
    TypeAdapter,
    ValidationError,
    model_validator,
)

from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.seams.acting import Disturbance, Environment
from forestall.tasks.execution_faults import FaultyEnvironment
from forestall.tasks.eyes import SharedEyes
from forestall.tasks.scene_faults import FaultTable, SceneFault, check_state
from forestall.tasks.scene_faults import apply_scene_faults as apply_scene_faults  # noqa: PLC0414
from forestall.types.facts import is_instance
from forestall.types.plan import Plan, Subtask, same_step


def _readable(text: str) -> str:
    try:
        return str(Subtask.parse(text))
    except InputError as error:
        raise ValueError(str(error)) from error


Step = Annotated[
    str,
    AfterValidator(_readable),
    Field(description="a subtask as plans write it, for example skill(Thing, Place)"),
]
Occurrence = Annotated[int, Field(ge=1, description="which of several equal ones, from 1")]


class DropStep(FaultTable):
    """The plan forgets a step."""

    kind: Literal["drop_step"] = "drop_step"
    step: Step
    occurrence: Occurrence = 1


class _Anchored(FaultTable):
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


class ReplaceArgument(FaultTable):
    """The plan names another thing; `argument` is the role, as the skill names it."""

    kind: Literal["replace_argument"] = "replace_argument"
    step: Step
    occurrence: Occurrence = 1
    argument: str
    by: str


class ReplacePlan(FaultTable):
    """Another plan altogether."""

    kind: Literal["replace_plan"] = "replace_plan"
    plan: tuple[Step, ...] = Field(min_length=1)


class _Execution(FaultTable):
    step: Step
    occurrence: Occurrence = 1
    times: Annotated[int, Field(ge=1, description="how many times it happens at most")] = 1


class Drop(_Execution):
    """The held object slips out of the gripper while the step is carried out."""

    kind: Literal["drop"] = "drop"
    hard: bool = Field(default=False, description="so hard that what is fragile breaks")


class FailedAction(_Execution):
    """The step does nothing and reports success."""

    kind: Literal["failed_action"] = "failed_action"


class WrongObject(_Execution):
    """The step acts on another type than the plan names."""

    kind: Literal["wrong_object"] = "wrong_object"
    acts_on: str
    shared: bool = Field(
        default=False, description="whether who watches the robot sees with its eyes, too"
    )


class WrongReceptacle(_Execution):
    """The step puts the object on or into another receptacle than the plan names."""

    kind: Literal["wrong_receptacle"] = "wrong_receptacle"
    acts_on: str

    @model_validator(mode="after")
    def _has_receptacle(self) -> WrongReceptacle:
        if len(Subtask.parse(self.step).args) < 2:
            raise ValueError(f"step {self.step} has no receptacle: it has one argument")
        return self


class Meanwhile(FaultTable):
    """Somebody else changes the world while the robot works: puts a thing somewhere, or a state.

    It happens right after the step, before the robot looks again; without a step before the robot
    does anything. What cannot be done there does not happen.
    """

    kind: Literal["meanwhile"] = "meanwhile"
    step: Step | None = None
    occurrence: Occurrence = 1
    times: Annotated[int, Field(ge=1, description="how many times it happens at most")] = 1
    object: str
    place: str | None = Field(default=None, description="a receptacle, or the robot's hand")
    attribute: str | None = None
    value: str | None = None

    @model_validator(mode="after")
    def _one_change(self) -> Meanwhile:
        state = (self.attribute is not None, self.value is not None)
        if state not in ((True, True), (False, False)) or state[0] == (self.place is not None):
            raise ValueError("give either 'place', or 'attribute' and 'value'")
        return self


PlanFault = DropStep | InsertStep | MoveStep | ReplaceArgument | ReplacePlan
ExecutionFault = Drop | FailedAction | WrongObject | WrongReceptacle | Meanwhile
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


def knowable(faults: Iterable[Any]) -> str:
    """Through what a failure can be known: "scene", "plan" or "after" something went wrong.

    Where faults of several sorts meet, the one that shows last decides.
    """
    kinds = {type(f) for f in faults}
    if kinds & {Drop, FailedAction, WrongObject, WrongReceptacle, Meanwhile}:
        return "after"
    if kinds & {DropStep, InsertStep, MoveStep, ReplaceArgument, ReplacePlan}:
        return "plan"
    return "scene"


def apply_plan_faults(plan: Plan, faults: Iterable[Any], domain: Domain) -> Plan:
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
            steps[at] = _with_argument(steps[at], fault.argument, fault.by, domain)
        elif isinstance(fault, ReplacePlan):
            steps = [Subtask.parse(s) for s in fault.plan]
    return replace(plan, subtasks=tuple(steps))


def check_steps(plan: Plan, faults: Iterable[Any], domain: Domain) -> None:
    """Check the names in a plan that faults have changed, and that execution faults can happen.

    Raises:
        InputError: an unknown thing, or a fault of a step that the plan does not have.
    """
    domain.check_plan(plan)
    for subtask in plan:
        for name in subtask.args:
            domain[name]
    for fault in faults:
        if not isinstance(fault, ExecutionFault):
            continue
        if isinstance(fault, Meanwhile):
            _check_change(fault, domain)
        if fault.step is None:
            continue
        step = domain.check(Subtask.parse(fault.step))
        for name in (*step.args, *([fault.acts_on] if hasattr(fault, "acts_on") else [])):
            domain[name]
        times = sum(same_step(_canonical(s, domain), _canonical(step, domain)) for s in plan)
        if times < fault.occurrence:
            raise InputError(
                f"{fault.kind}.step: {step} comes {times} time(s) in the plan, "
                f"which has: {', '.join(plan.texts())}"
            )


def _check_change(fault: Meanwhile, domain: Domain) -> None:
    category = domain[fault.object].name
    if fault.attribute is not None and fault.value is not None:
        check_state(category, fault.attribute, fault.value, "meanwhile", domain)
        return
    place = fault.place or ""
    if place not in domain.robot.hands and not domain.accepts(domain[place].name, category):
        raise InputError(f"meanwhile.place: {place} does not take {category}")


def _canonical(subtask: Subtask, domain: Domain) -> Subtask:
    return Subtask(subtask.skill, tuple(domain.canonical(a) for a in subtask.args))


def wrap(
    environment: Environment,
    faults: Iterable[Any],
    disturbance: Disturbance,
    domain: Domain,
) -> Environment:
    """The environment with its execution faults; the same one where there are none."""
    chosen = [f for f in faults if isinstance(f, ExecutionFault)]
    if not chosen:
        return environment
    faulty = FaultyEnvironment(environment, chosen, disturbance, domain)
    mistaken = {
        (f.acts_on if is_instance(f.acts_on) else f"{domain[f.acts_on].name}-1"): domain[
            Subtask.parse(f.step).args[0]
        ].name
        for f in chosen
        if isinstance(f, WrongObject) and f.shared
    }
    return SharedEyes(faulty, mistaken, domain) if mistaken else faulty


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


def _with_argument(step: Subtask, role: str, by: str, domain: Domain) -> Subtask:
    roles = domain.skill(step.skill).roles
    if role not in roles:
        raise InputError(
            f"replace_argument.argument: {step} has no {role}; it has {', '.join(roles)}"
        )
    args = tuple(by if r == role else a for r, a in zip(roles, step.args, strict=True))
    return Subtask(step.skill, args)
