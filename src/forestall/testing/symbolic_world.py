"""A world of facts alone, for any domain: skills do what the domain's schemas say.

Implements `Environment`, `OracleView` and `Disturbance`. Called by the loop, by tests and by anyone
with a domain and no simulator; calls the domain's own execution. There are no pictures: an
observation holds the part of the state that is in view as a scene graph. What is inside something
shut is not in view. Boxes are synthetic: things of one place stand side by side there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from forestall.domain.model import Domain
from forestall.domain.schema import PredicateKind
from forestall.planning.execute import Refusal, apply, resolve
from forestall.planning.observed import state_of
from forestall.planning.settle import settle
from forestall.planning.state import State
from forestall.testing.symbolic_scene import relation_at, start_scene
from forestall.types.episode import Event, SkillOutcome, SkillStatus
from forestall.types.facts import Literal, by_number
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph
from forestall.types.observation import GripperState, Observation, Vec3
from forestall.types.plan import Subtask
from forestall.types.scene import SceneNeeds

SPEED_M_S = 0.5
REACH_M = 0.8
SKILL_S = 5.0
"""How long a skill takes of which the domain does not say it."""

LOOK_S = 1.0
HOLDS = "the robot was told to hold"
_APART_M = 1.5
_HALF_M = 0.05


class SymbolicWorld:
    """One scene of a domain.

    Args:
        domain: what things are and what skills do.
        start: what a task needs, drawn by the seed of `reset`; or a scene graph, the same for
            every seed.
    """

    def __init__(self, domain: Domain, start: SceneNeeds | SceneGraph) -> None:
        self._domain, self._start = domain, start
        self.reset(0)

    # --- Environment -----------------------------------------------------------------------------

    def reset(self, seed: int) -> None:
        """Put the world into the start state of this seed."""
        start = self._start
        graph = start_scene(self._domain, start, seed) if isinstance(start, SceneNeeds) else start
        self._state = state_of(graph, self._domain)
        self._state.hidden = frozenset()
        fixtures = [n for n in self._state.kinds if self._is_fixture(n)]
        order = sorted(fixtures, key=by_number)
        self._stands = {n: (_APART_M * i, 1.0, 0.5) for i, n in enumerate(order)}
        self._robot: Vec3 = (0.0, 0.0, 0.0)
        self._released: tuple[str, Vec3] | None = None
        self._time_s = 0.0
        self._holding = False
        self._events: list[Event] = []

    @property
    def time_s(self) -> float:
        """Simulated time since reset."""
        return self._time_s

    def scan(self, thorough: bool = False) -> Observation:
        """Everything that is in view."""
        self._time_s += LOOK_S
        return self._observation()

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """Everything that is in view, wherever the robot looks."""
        self._time_s += LOOK_S
        return self._observation()

    def approach(self, name: str) -> float:
        """Drive to where a thing can be reached, unless it is within reach; simulated seconds."""
        found = self._state.matches(name)
        if self._holding or not found or found[0] == self._state.held:
            return 0.0
        self._state.at = found[0]
        return self._drive(found[0])

    def execute(self, subtask: Subtask) -> SkillOutcome:
        """Run one skill; refuse with a reason when its needs are not met."""
        started = self._time_s
        if self._holding:
            return SkillOutcome(SkillStatus.REFUSED, 0.0, HOLDS)
        args = resolve(self._state, subtask)
        if isinstance(args, Refusal):
            return SkillOutcome(SkillStatus.REFUSED, 0.0, args.reason)
        command = Subtask(subtask.skill, args)
        skill = self._domain.skill(subtask.skill)
        names = self._domain.bound(command)
        target = names.get(skill.at or "", args[-1] if args else "")
        if target in self._state.kinds and target not in {h for _, h in self._state.in_hands()}:
            self._drive(target)
        after = apply(self._state, command)
        if isinstance(after, Refusal):
            return SkillOutcome(SkillStatus.REFUSED, self._time_s - started, after.reason)
        self._time_s += skill.duration_s or SKILL_S
        self._become(after)
        hand = None if self._released is None else self._released[1]
        return SkillOutcome(SkillStatus.SUCCEEDED, self._time_s - started, hand_world_m=hand)

    def hold(self) -> None:
        """Nothing moves again before `reset`."""
        self._holding = True

    def close(self) -> None:
        """There is nothing to free."""

    # --- OracleView ------------------------------------------------------------------------------

    def truth(self) -> SceneGraph:
        """The complete state as a graph."""
        return self._graph(set(self._state.kinds), seeing=False)

    def states(self, instance: str) -> Mapping[str, str]:
        """True attribute values of one instance, empty if there is no such instance now."""
        return {a: v for (n, a), v in self._state.values.items() if n == instance}

    def history(self) -> frozenset[Literal]:
        """History facts that hold: what has happened and cannot be undone."""
        return frozenset(Literal(f[0], f[1:]) for f in self._state.facts if self._is_history(f[0]))

    def events(self) -> tuple[Event, ...]:
        """Everything that has happened since reset, in order."""
        return tuple(self._events)

    # --- Disturbance -----------------------------------------------------------------------------

    def drop_held(self, hard: bool = False) -> str | None:
        """Let go of what is held: it lies on the ground, or is lost where a domain has none.

        What a hard fall breaks the domain does not say, so that it is the same as a soft one.
        """
        thing = self._state.held
        if thing is None:
            return None
        after = self._state.copy()
        ground = sorted(after.of_kind(self._domain.roles.ground), key=by_number)
        if ground:
            after.add((relation_at(self._domain, after.kinds[thing], ground[0]), thing, ground[0]))
        else:
            after.remove((self._domain.roles.holding or "", thing, self._hand_of(thing)))
            after.lost = after.lost | {thing}
        self._become(after)
        self._released = None
        return thing

    def rearrange(self, thing: str, place: str) -> bool:
        """See `Disturbance`; somebody else's hands reach everywhere and open what is shut."""
        domain, state = self._domain, self._state
        named = [n for n in state.matches(thing) if n != state.held]
        if not named or not domain.is_a(named[0], domain.roles.movable):
            return False
        name, after = named[0], state.copy()
        if place in domain.robot.hands:
            if state.held is not None or domain.roles.holding is None:
                return False
            after.add((domain.roles.holding, name, place))
        else:
            kind = after.kinds[name]
            free = [p for p in state.matches(place) if domain.accepts(p, kind) and p != name]
            free = [p for p in free if self._has_room(p) and not self._is_within(p, name)]
            here = state.place(name)
            free = [p for p in free if here is None or p != here.parent]
            if not free:
                return False
            after.add((relation_at(domain, kind, free[0]), name, free[0]))
        for fact in [f for f in after.facts if f[0] == domain.roles.blocking and name in f[1:]]:
            after.remove(fact)
        after.lost = after.lost - {name}
        settle(after)
        self._become(after)
        return True

    def alter(self, thing: str, attribute: str, value: str) -> bool:
        """See `Disturbance`."""
        named = self._state.matches(thing)
        if not named or self._state.value(named[0], attribute) in (None, value):
            return False
        after = self._state.copy()
        after.set_value(named[0], attribute, value)
        settle(after)
        self._become(after)
        return True

    def _has_room(self, place: str) -> bool:
        capacity = self._domain.number(place, "capacity")
        return capacity is None or len(self._state.contents(place)) < capacity

    def _is_within(self, place: str, thing: str) -> bool:
        return any(p.parent == thing for p in self._state.chain(place))

    # --- inside ----------------------------------------------------------------------------------

    def _is_fixture(self, name: str) -> bool:
        return self._domain.roles.fixture in self._state.kind(name).tags

    def _is_history(self, predicate: str) -> bool:
        return self._domain.predicates[predicate].kind is PredicateKind.HISTORY

    def _hand_of(self, thing: str) -> str:
        return next(hand for hand, held in self._state.in_hands() if held == thing)

    def _drive(self, name: str) -> float:
        """Come near a thing."""
        x, y, _ = self._place_of(name)
        distance = math.dist(self._robot[:2], (x, y - REACH_M / 2))
        if distance <= REACH_M:
            return 0.0
        self._robot = (x, y - REACH_M / 2, 0.0)
        self._time_s += distance / SPEED_M_S
        return distance / SPEED_M_S

    def _become(self, after: State) -> None:
        """Take over a new state, and write down what is different."""
        before, self._released = self._state, None
        for _, thing in before.in_hands():
            if thing not in {h for _, h in after.in_hands()} and thing in after.kinds:
                self._released = (thing, self._hand())
        made = tuple(sorted(set(after.kinds) - set(before.kinds), key=by_number))
        gone = tuple(sorted(set(before.kinds) - set(after.kinds), key=by_number))
        self._state = after
        if made:
            text = f"{', '.join(gone)} became {', '.join(made)}" if gone else ", ".join(made)
            self._note("made", (*gone, *made), text)
        for key in sorted(after.values):
            if before.values.get(key) not in (None, after.values[key]):
                literal = Literal(key[1], (key[0],), after.values[key])
                self._note("state", (key[0],), str(literal))
        for fact in sorted(after.facts - before.facts):
            literal, predicate = Literal(fact[0], fact[1:]), self._domain.predicates[fact[0]]
            if predicate.kind is PredicateKind.HISTORY:
                self._note(fact[0], fact[1:], predicate.words.format(*fact[1:]) or str(literal))
            else:
                self._note("relation", fact[1:], str(literal))

    def _note(self, kind: str, objects: tuple[str, ...], text: str) -> None:
        self._events.append(Event(self._time_s, kind, objects, text))

    def _observation(self) -> Observation:
        state = self._state
        visible = {n for n in state.kinds if n not in state.lost and not self._shut_away(n)}
        released, place = self._released or (None, None)
        gripper = GripperState(state.held, self._hand(), released, place)
        return Observation((), gripper, self._time_s, self._robot, self._graph(visible, True))

    def _shut_away(self, name: str) -> bool:
        shut = self._domain.roles.shut
        return any(self._state.says(shut, place.parent) for place in self._state.chain(name))

    def _graph(self, names: set[str], seeing: bool) -> SceneGraph:
        """The part of the state about some things; `seeing`: as a camera has it."""
        state, domain = self._state, self._domain
        hands = domain.robot.hands
        nodes = [self._node(n, seeing) for n in names]
        nodes += [ObjectNode(h, h, last_seen_s=self._time_s) for h in hands]
        known = names | set(hands)
        facts = [f for f in state.facts if f[0] in domain.relations and len(f) == 3]
        relations = [Relation(f[1], f[0], f[2]) for f in facts if {f[1], f[2]} <= known]
        shut = [n for n in names if seeing and state.says(domain.roles.shut, n)]
        return SceneGraph(tuple(nodes), tuple(relations), None, tuple(shut))

    def _node(self, name: str, seeing: bool) -> ObjectNode:
        states = {
            a: None if seeing and not self._domain.attributes[a].camera else v
            for a, v in self.states(name).items()
        }
        box = None
        if name not in self._state.lost:
            (x, y, z), h = self._place_of(name), _HALF_M
            wide = 8 * h if self._is_fixture(name) else h
            box = Box((x - wide, y - wide, z - h), (x + wide, y + wide, z + h))
        centre = None if box is None else box.centre
        kind = self._state.kinds[name]
        return ObjectNode(name, kind, tuple(states.items()), centre, box, last_seen_s=self._time_s)

    def _hand(self) -> Vec3:
        x, y, _ = self._robot
        return (x, y + 0.3, 1.0)

    def _place_of(self, name: str) -> Vec3:
        """Where a thing is: on its fixture, beside what else is there."""
        if name in self._stands:
            return self._stands[name]
        place = self._state.place(name)
        if place is None:
            return self._hand()
        x, y, z = self._place_of(place.parent)
        row = self._state.contents(place.parent).index(name)
        return (x - 0.3 + 3 * _HALF_M * (row % 5), y + 3 * _HALF_M * (row // 5), z + 2 * _HALF_M)
