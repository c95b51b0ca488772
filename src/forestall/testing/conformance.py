"""Conformance suite: what every `Environment` must do, whatever world is behind it.

Run it on a new adapter before anything else (after Gymnasium's environment checker). It speaks to
the Protocol only, tries the skills of the world's domain, and returns complaints in words; an empty
list is a pass. How exactly a run must repeat is the world's level (`levels`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from threading import Thread

import numpy as np

from forestall.domain.model import Domain
from forestall.seams.acting import Environment, Unnamed
from forestall.seams.perceiving import Perceiver
from forestall.testing.levels import NONE, Level, Tolerance, differences
from forestall.testing.sight import unseen
from forestall.types.episode import SkillStatus
from forestall.types.observation import Observation
from forestall.types.plan import Subtask

NONSENSE = "NoSuchThing"
NOWHERE_M = (99.0, 99.0, 99.0)

HOLD_S = 5.0
"""How long `hold` may take."""


def check_environment(
    make: Callable[[], Environment],
    seed: int,
    subtasks: Sequence[Subtask],
    domain: Domain,
    level: Level = Level.EXACT,
    tolerance: Tolerance | None = None,
    perceiver: Perceiver | None = None,
) -> list[str]:
    """Complaints about an environment; empty when it conforms.

    Args:
        make: builds a fresh environment.
        seed: of the scene to check.
        subtasks: a short plan that the scene allows; its outcomes must repeat.
        domain: what the world is about; each of its skills is tried on names that mean nothing.
        level: what of it must repeat. On hardware nothing need, the plan runs once and
            nothing is asked for that makes no sense.
        tolerance: how far apart two runs may be, at the level TOLERANCE.
        perceiver: whether it sees what was done is checked, too.

    Returns:
        One sentence for each thing that is wrong: a run that does not repeat as the level has it,
        time that goes backwards or disagrees with reported durations, observations that are not
        valid, nonsense that is not refused, an exception where a refusal is due, motion after
        `hold`, for one that shares no names (`seams.Unnamed`) a thing taken where a name points at
        none, and what was done and perception does not see.
    """
    if level is Level.HARDWARE:
        return _on_hardware(make(), seed, subtasks, domain, perceiver)
    within = NONE if level is Level.EXACT else tolerance or Tolerance()
    first, second = make(), make()
    try:
        runs = (_run(first, seed, subtasks), _run(second, seed, subtasks))
        again = _run(first, seed, subtasks)
        return [
            *dict.fromkeys(runs[0].complaints),
            *_repeats(f"two fresh environments with seed {seed}", *runs, within),
            *_repeats(f"two resets with seed {seed}", runs[0], again, within),
            *_refuses_nonsense(first, seed, domain),
            *_refuses_wrong_places(first, seed, domain),
            *_holds(first, seed, subtasks, within),
            *(() if perceiver is None else unseen(first, seed, subtasks, domain, perceiver)),
        ]
    finally:
        first.close()
        second.close()


def _on_hardware(
    robot: Environment,
    seed: int,
    subtasks: Sequence[Subtask],
    domain: Domain,
    perceiver: Perceiver | None,
) -> list[str]:
    try:
        return [
            *dict.fromkeys(_run(robot, seed, subtasks).complaints),
            *(() if perceiver is None else unseen(robot, seed, subtasks, domain, perceiver)),
            *_holds(robot, seed, subtasks, Tolerance()),
        ]
    finally:
        robot.close()


class _Run:
    """What one run of a plan showed."""

    def __init__(self) -> None:
        self.observations: list[Observation] = []
        self.outcomes: list[tuple[str, float, str]] = []
        self.complaints: list[str] = []


def _run(environment: Environment, seed: int, subtasks: Sequence[Subtask]) -> _Run:
    run = _Run()
    environment.reset(seed)
    if environment.time_s != 0.0:
        run.complaints.append(f"time is {environment.time_s} s after reset, not 0")
    clock = environment.time_s
    run.observations.append(environment.scan())
    run.observations.append(environment.observe())
    run.observations.append(environment.observe([(1.0, 1.0, 1.0), (0.0, 1.0, 0.5)]))
    if len(run.observations[-1].frames) > 2:
        run.complaints.append("observe with two focus points gives more than two frames")
    for subtask in subtasks:
        before = environment.time_s
        outcome = environment.execute(subtask)
        run.outcomes.append((outcome.status.value, outcome.duration_s, outcome.reason))
        passed = environment.time_s - before
        if outcome.duration_s < 0 or abs(passed - outcome.duration_s) > 1e-6:
            run.complaints.append(
                f"{subtask} reports {outcome.duration_s} s while {passed} s passed"
            )
        if outcome.status is SkillStatus.REFUSED and not outcome.reason:
            run.complaints.append(f"{subtask} is refused without a reason")
        run.observations.append(environment.observe())
    for observation in run.observations:
        if observation.time_s < clock:
            run.complaints.append(f"time went back from {clock} s to {observation.time_s} s")
        clock = observation.time_s
        run.complaints += _invalid(observation)
    return run


def _invalid(observation: Observation) -> Iterator[str]:
    """What the observation types do not check themselves."""
    for frame in observation.frames:
        if not (frame.depth_m > 0).any():
            yield "a frame has no depth at all"
        ids = frame.instance_ids
        if ids is None:
            continue
        if not np.issubdtype(ids.dtype, np.integer):
            yield f"instance_ids are {ids.dtype}, not integers"
        elif ids.min() < -1 or ids.max() >= len(frame.instance_names):
            yield "instance_ids point beyond instance_names"
    holding = observation.gripper.holding
    if holding is not None and not isinstance(holding, str):
        yield f"gripper.holding is {holding!r}, not a name"


def _repeats(what: str, run: _Run, again: _Run, within: Tolerance) -> Iterator[str]:
    if not _same_outcomes(run, again, within):
        yield f"{what} give different outcomes"
    for index, (a, b) in enumerate(zip(run.observations, again.observations, strict=True)):
        for name in differences(a, b, within):
            yield f"observation {index}: {name} differs between {what}"


def _same_outcomes(run: _Run, again: _Run, within: Tolerance) -> bool:
    """Statuses and durations; the words of a refusal, too, where all must be the same."""
    if within is NONE:
        return run.outcomes == again.outcomes
    return all(
        a[0] == b[0] and abs(a[1] - b[1]) <= within.time_s
        for a, b in zip(run.outcomes, again.outcomes, strict=True)
    )


def _refuses_nonsense(environment: Environment, seed: int, domain: Domain) -> Iterator[str]:
    environment.reset(seed)
    known = domain.tagged(domain.roles.movable)[:1]
    absent = [NONSENSE, f"{NONSENSE}-7", "", *(f"{category}-99999" for category in known)]
    tried = [
        Subtask(skill.name, (name,) * len(skill.parameters))
        for skill in domain.skills.values()
        for name in absent
        if skill.parameters
    ]
    without = [Subtask(s.name, ()) for s in domain.skills.values() if s.parameters]
    tried += [Subtask(NONSENSE.lower(), known), *without]
    for subtask in tried:
        try:
            outcome = environment.execute(subtask)
        except Exception as error:  # noqa: BLE001  (that nothing is raised is what is checked)
            yield f"{subtask} raises {error!r}; it must be refused with a reason"
            continue
        if outcome.status is SkillStatus.SUCCEEDED:
            yield f"{subtask} succeeds; it must be refused"
        elif not outcome.reason:
            yield f"{subtask} is refused without a reason"


def _refuses_wrong_places(environment: Environment, seed: int, domain: Domain) -> Iterator[str]:
    """Where a name points at nothing, nothing else is taken, and nothing is driven into."""
    if not isinstance(environment, Unnamed):
        return
    environment.reset(seed)
    for skill in domain.skills.values():
        for category in domain.tagged(domain.roles.movable)[:1] if skill.parameters else ():
            subtask = Subtask(skill.name, (f"{category}-1",) * len(skill.parameters))
            outcome = environment.execute_at(subtask, {f"{category}-1": NOWHERE_M})
            if outcome.status is SkillStatus.SUCCEEDED or not outcome.reason:
                yield f"{subtask} is not refused with a reason where its place shows nothing"


def _holds(
    environment: Environment, seed: int, subtasks: Sequence[Subtask], within: Tolerance
) -> Iterator[str]:
    """Told to hold in the middle of a plan, from another thread, nothing moves before a reset."""
    environment.reset(seed)
    half = len(subtasks) // 2
    for subtask in subtasks[:half]:
        environment.execute(subtask)
    before = environment.observe()
    yield from _told_to_hold(environment)
    after = environment.observe()
    if after.gripper.holding != before.gripper.holding:
        yield f"hold lets go of {before.gripper.holding}"
    start_s = environment.time_s
    held = set()
    for subtask in subtasks[half:]:
        for name in subtask.args:
            environment.approach(name)
        outcome = environment.execute(subtask)
        held.add(outcome.reason)
        if outcome.status is not SkillStatus.REFUSED or not outcome.reason:
            yield f"after hold {subtask} is not refused with a reason"
    if abs(environment.time_s - start_s) > within.time_s:
        yield f"after hold the robot moves for {environment.time_s - start_s} s"
    rest = environment.scan()
    for name in differences(replace(before, frames=rest.frames), rest, within):
        if name == "the robot's position":
            yield "after hold the robot drives"
    for name in differences(replace(after, frames=rest.frames), rest, within):
        if name == "the gripper":
            yield "after hold the hand moves"
    environment.reset(seed)
    if any(environment.execute(s).reason in held - {""} for s in subtasks[:1]):
        yield "after hold it takes more than one reset until the robot acts again"


def _told_to_hold(environment: Environment) -> Iterator[str]:
    """Twice, from another thread."""
    failed: list[Exception] = []

    def told() -> None:
        try:
            environment.hold()
        except Exception as error:  # noqa: BLE001  (that nothing is raised is what is checked)
            failed.append(error)

    for _ in range(2):
        thread = Thread(target=told, daemon=True)
        thread.start()
        thread.join(HOLD_S)
        if thread.is_alive():
            yield f"hold does not come back within {HOLD_S:g} s"
            return
    for error in failed:
        yield f"hold raises {error!r}"
