"""The same things done in less of the robot's time: errands at another time, drives left out.

Called by the replanner with a plan that runs; calls `needless` and `robot_time`. An errand is what
lies between two moments with the same things in the hands. It is moved to where it saves driving,
or to where something dangerous lasts less long, if the plan then still runs and ends as before.
No errand passes a step that cannot be undone: what is to be right by then is right by then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from forestall.domain.facing import minds_facing
from forestall.domain.model import Domain
from forestall.planning.driving import landmark_of
from forestall.planning.needless import Accepts, content, unsafe
from forestall.planning.robot_time import Aim, Spot, aim, times_s, way_s
from forestall.planning.state import State
from forestall.planning.validate import Trace, run
from forestall.types.plan import Subtask

WORTH_S = 2.0
"""A plan that saves less than this stays as it is."""
TRIES = 4
"""How many of the most promising changes are tried before it is left at that."""
ROUNDS = 6
"""How many changes a plan can get."""
DANGER = 1.0
"""What a second with something dangerous going on counts, beside that second itself."""


@dataclass(frozen=True, slots=True)
class _Unit:
    """One step, with the drive before it, and where that is done."""

    drive: Subtask | None
    step: Subtask
    place: str | None
    spot: Spot | None
    landmark: str
    held: frozenset[str]  # before it
    danger: bool  # after it
    for_good: bool  # it cannot be undone
    mine: bool  # of the repair and not of the old plan


def cost_s(trace: Trace, start: Spot | None = None) -> float:
    """What a plan costs: the robot's time, and that with something dangerous going on again."""
    return sum(
        time_s * (1.0 + DANGER * bool(unsafe(before)))
        for time_s, before in zip(times_s(trace, start), trace.states, strict=False)
    )


def thrifty(
    state: State,
    steps: Sequence[Subtask],
    own: int,
    accepts: Accepts,
    start: Spot | None = None,
) -> tuple[Subtask, ...]:
    """A plan that costs less and ends as this one does, as far as somebody accepts it.

    Args:
        state: that it starts from.
        steps: of the plan, which runs.
        own: how many at its beginning are the repair.
        accepts: says whether a cheaper plan will do.
        start: where the robot stands, x and y in metres.
    """
    best = tuple(steps)
    trace = run(state, best)
    if trace.refusal is not None:
        return best
    known_s, end = cost_s(trace, start), content(trace.final)
    for _ in range(ROUNDS):
        units = _units(trace, best, own)
        for order in _promising(state, units, start):
            other, mine = _assembled(state, order)
            tried = run(state, other)
            if tried.refusal is not None or content(tried.final) != end:
                continue
            other_s = cost_s(tried, start)
            if other_s > known_s - WORTH_S or not accepts(other, mine):
                continue
            best, trace, known_s, own = other, tried, other_s, mine
            break
        else:
            return best
    return best


def _units(trace: Trace, steps: Sequence[Subtask], own: int) -> list[_Unit]:
    first, domain = trace.states[0], trace.states[0].domain
    units: list[_Unit] = []
    drive: tuple[Subtask, Subtask] | None = None
    for k, (step, meant) in enumerate(zip(steps, trace.meant, strict=True)):
        last = k == len(steps) - 1
        if domain.drives(step) and not last:
            drive = (step, meant)
            continue
        state = trace.states[k]
        to = aim(first, state, meant) or (aim(first, state, drive[1]) if drive else None)
        place, where = to or (None, None)
        subject = next((a for a in reversed(meant.args) if a in state.kinds), "")
        units.append(
            _Unit(
                drive[0] if drive else None,
                step,
                place,
                where,
                landmark_of(state, subject) if subject else "",
                frozenset(h for _, h in state.in_hands()),
                bool(unsafe(trace.states[k + 1])),
                for_good(state, trace.states[k + 1]),
                k < own,
            )
        )
        drive = None
    return units


def _promising(state: State, units: list[_Unit], start: Spot | None) -> list[list[_Unit]]:
    """Other orders, those first of which most is to be expected."""
    now_s = _guessed_s(state, units, start)
    found: list[tuple[float, int, list[_Unit]]] = [(now_s, 0, units)]  # its idle drives may go
    count = len(units)
    for i in range(count):
        end = _errand(units, i)
        if end is None:
            continue
        errand = units[i:end]
        for k in (*range(i), *range(end + 1, count + 1)):
            if any(u.for_good for u in units[min(i, k) : max(end, k)]):
                continue
            held = units[k].held if k < count else None
            if held is not None and held != units[i].held:
                continue
            order = (
                [*units[:k], *errand, *units[k:i], *units[end:]]
                if k < i
                else [*units[:i], *units[end:k], *errand, *units[k:]]
            )
            guess_s = _guessed_s(state, order, start)
            if guess_s <= now_s - WORTH_S or any(u.danger for u in units[min(i, k) : max(end, k)]):
                found.append((guess_s, len(found), order))
    found.sort()
    return [order for _, _, order in found[: TRIES + 1]]


def _errand(units: list[_Unit], start: int) -> int | None:
    """The end of the errand that begins with a unit, None where it goes on to the end."""
    for end in range(start + 1, len(units)):
        if units[end].held == units[start].held:
            return end
    return len(units)


def _guessed_s(state: State, units: Sequence[_Unit], start: Spot | None) -> float:
    """What an order takes if everything is done where it is done now."""
    at: tuple[str, Spot | None] | None = None if start is None else ("", start)
    total_s = 0.0
    for unit in units:
        if unit.place is not None:
            to = (unit.place, unit.spot)
            total_s += 0.0 if at is None else way_s(state.domain, at, to)
            at = to
    return total_s


def _assembled(state: State, units: Sequence[_Unit]) -> tuple[tuple[Subtask, ...], int]:
    """The steps of an order, with drives where the place changes, and how many are the repair's."""
    driving = state.domain.driving()
    steps: list[Subtask] = []
    at: Aim | None = None
    mine = 0
    for unit in units:
        to = None if unit.place is None else (unit.place, unit.spot)
        away = to is not None and (at is None or way_s(state.domain, at, to) > 0)
        if unit.drive is not None and (away or to is None or minds_facing(unit.step, state.domain)):
            steps.append(unit.drive)
        elif driving is not None and away and unit.landmark and at is not None:
            steps.append(Subtask(driving.name, (unit.landmark,)))
        at = to if away else at
        steps.append(unit.step)
        if unit.mine:
            mine = len(steps)
    return tuple(steps), mine


def for_good(before: State, after: State) -> bool:
    """Whether something has happened that no skill and no process takes back."""
    domain = before.domain
    if before.kinds != after.kinds:
        return True
    passing = _passing(domain)
    for fact in content(after) - content(before):
        if fact[0] in domain.histories:
            return True
        if len(fact) == 3 and fact[1] in domain.attributes and fact[0] in after.kinds:
            usual = domain.default_states(after.kinds[fact[0]]).get(fact[1])
            if fact[2] != usual and (fact[1], fact[2]) not in passing:
                return True
    return False


def _passing(domain: Domain) -> frozenset[tuple[str, str]]:
    """Values of attributes that some skill or process puts an end to."""
    found: frozenset[tuple[str, str]] | None = domain.__dict__.get("_passing")
    if found is None:
        effects = [e for s in domain.skills.values() for e in s.effects]
        effects += [e for p in domain.processes for e in p.effects]
        ends = {(f.predicate, f.value) for e in effects for f in e.facts}
        copied = {c.attribute for e in effects for c in e.copies}
        found = domain.__dict__["_passing"] = frozenset(
            (name, value)
            for name, attribute in domain.attributes.items()
            for value in attribute.values
            if name in copied or any(p == name and v != value for p, v in ends)
        )
    return found
