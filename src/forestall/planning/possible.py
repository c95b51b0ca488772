"""What some skill or process could bring about, one step back: ways to a fact.

Called by `relevance`; calls `schemas`. Only what never changes is judged, so nothing that can be
brought about is missed.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

from forestall.deadline import Deadline
from forestall.domain.formula import Formula
from forestall.domain.model import Domain
from forestall.domain.schema import Copy, Effect, Process, Skill
from forestall.planning.goals import Made
from forestall.planning.grounder import Grounder, Universe
from forestall.planning.needs import plain_parts, simple_needs
from forestall.planning.nodes import Node
from forestall.planning.schemas import schemas_of
from forestall.planning.state import State
from forestall.types.facts import Literal, by_number

Names = dict[str, str]
K = TypeVar("K")
T = TypeVar("T")
_RECENT = 8
STEPS = 16
"""How many facts back it is asked what could bring them about; what lies further is possible."""
LARGE = 100
"""Among more things than this only kinds are asked for: the rest takes long and tells little."""


@dataclass(frozen=True, slots=True)
class Way:
    """A fact or a copy in an effect of a skill or a process."""

    schema: Skill | Process
    effect: Effect
    what: Literal | Copy
    simple: Formula


class Possible(Grounder):
    """All things, with every relation that some skill could bring about (a `schemas.World`)."""

    def __init__(self, state: State, made: Made) -> None:
        things = tuple(sorted((x for x in state.kinds if x not in state.lost), key=by_number))
        super().__init__(state, Universe(things, made), schemas_of(state.domain))
        self.ways = ways_of(state.domain)
        self.source_of = {
            n: (source, skill, variable)
            for (source, skill, variable), names in made.items()
            for n in names
        }
        self._steps = 0
        self.most = STEPS if len(things) <= LARGE else 0
        self._can: dict[tuple[str, ...], bool] = {}
        self._bindings: dict[tuple[int, tuple[str, ...]], tuple[Names, ...]] = {}
        self._options: dict[tuple[object, ...], tuple[str, ...]] = {}

    def fact(self, predicate: str, args: tuple[str, ...]) -> Node:
        """A relation that holds or could be brought about."""
        atom = (predicate, *args)
        if predicate in self.rigid:
            return atom in self.state.facts
        if atom in self.state.facts:
            return self.number_of(atom)
        found = self._can.get(atom)
        if found is None:
            self.in_time()
            if self._steps == self.most:
                return self.number_of(atom) if self._of_such_kinds(predicate, args) else False
            self._can[atom] = False
            with self._step_back(self._can, atom):
                found = self._can[atom] = any(
                    True for way in self.ways.get(predicate, ()) for _ in self.bindings(way, atom)
                )
        return self.number_of(atom) if found else False

    def derived(self, predicate: str, args: tuple[str, ...]) -> Node:
        """A derived fact; among very many things it is not asked what it would take."""
        if self.most or predicate in self.rigid:
            return super().derived(predicate, args)
        return self.number_of((predicate, *args))

    def related(self, predicate: str, position: int, args: tuple[str, ...]) -> Sequence[str]:
        """What stands at a position or could be brought there."""
        key = (predicate, position, *args[:position], *args[position + 1 :])
        found = self._options.get(key)
        if found is None:
            self.in_time()
            if self._steps == self.most:
                return self._of_kinds(predicate, position)
            self._options[key] = ()
            names: dict[str, None] = {}
            atom = (predicate, *(a if i != position else "?" for i, a in enumerate(args)))
            with self._step_back(self._options, key):
                for way in self.ways.get(predicate, ()):
                    assert isinstance(way.what, Literal)
                    open_name = way.what.args[position]
                    for bound in self.bindings(way, atom):
                        name = bound.get(open_name)
                        if name is not None:
                            names[name] = None
            found = self._options[key] = tuple(names)
        now = [x for x in self.state.related(predicate, position, args) if x not in found]
        return (*now, *found)

    def _of_such_kinds(self, predicate: str, args: tuple[str, ...]) -> bool:
        """Whether some way brings a fact about things of such kinds about."""
        key = (predicate, *(self.categories.get(a, a) for a in args))
        found = self._can.get(key)
        if found is None:
            found = self._can[key] = any(
                all(self._fits(way, i, a) for i, a in enumerate(args))
                for way in self.ways.get(predicate, ())
            )
        return found

    def _of_kinds(self, predicate: str, position: int) -> tuple[str, ...]:
        """What is of a kind that some way brings to a position."""
        key = (predicate, position)
        found = self._options.get(key)
        if found is None:
            ways = self.ways.get(predicate, ())
            found = tuple(n for n in self.names if any(self._fits(w, position, n) for w in ways))
            self._options[key] = found
        return found

    def _fits(self, way: Way, position: int, name: str) -> bool:
        assert isinstance(way.what, Literal)
        variable = way.what.args[position]
        if not variable.startswith("?"):
            return variable == name
        own = (*way.schema.parameters, *way.effect.variables)
        kind = next((p.kind for p in own if p.name == variable), None)
        return kind is None or (name in self.categories and self.is_a(name, kind))

    @contextmanager
    def _step_back(self, known: dict[K, T], key: K) -> Iterator[None]:
        """One fact further back; what is not worked out to its end is not remembered."""
        self._steps += 1
        try:
            yield
        except BaseException:  # an interrupt, too, leaves nothing half worked out
            del known[key]
            raise
        finally:
            self._steps -= 1

    def known_bindings(self, way: Way, atom: tuple[str, ...]) -> Sequence[Names]:
        """The bindings of `bindings`, worked out once."""
        key = (id(way), atom)
        if key not in self._bindings:
            self._bindings[key] = tuple(self.bindings(way, atom))
        return self._bindings[key]

    def bindings(self, way: Way, atom: tuple[str, ...]) -> Iterator[Names]:
        """Bindings of a schema's parameters by which a way leads to a fact."""
        names: Names = {}
        args = way.what.args if isinstance(way.what, Literal) else (way.what.target,)
        for variable, name in zip(args, atom[1:], strict=False):
            if name.startswith("?"):
                continue
            if not variable.startswith("?"):
                if variable != name:
                    return
            elif names.setdefault(variable, name) != name:
                return
        yield from self.completed(way, names)

    def completed(self, way: Way, names: Names) -> Iterator[Names]:
        """Bindings of what is still open."""
        schema = way.schema
        if isinstance(schema, Skill):
            for make in schema.makes:
                piece = names.get(make.variable)
                if piece is not None:
                    source = self.source_of.get(piece)
                    if source is None or source[1:] != (schema.name, make.variable):
                        return
                    if names.setdefault(make.source, source[0]) != source[0]:
                        return
            names = dict(names)
            for make in schema.makes:
                mine = self.universe.made.get(
                    (names.get(make.source, ""), schema.name, make.variable)
                )
                if mine and make.variable not in names:
                    names[make.variable] = mine[0]
        for parameter in schema.parameters:
            name = names.get(parameter.name)
            if name is not None and name not in self.categories:
                return
            if name is not None and parameter.kind and not self.is_a(name, parameter.kind):
                return
        left = tuple(p for p in schema.parameters if p.name not in names)
        join = self.schemas.join(left, way.simple, frozenset(names) & self.schemas.free(way.simple))
        for bound, _ in join(self, names):
            yield from self._chosen(way, bound)

    def _chosen(self, way: Way, names: Names) -> Iterator[Names]:
        schema, several = way.schema, [names]
        for choice in schema.deciding if isinstance(schema, Skill) else ():
            variable = choice.variable.name
            if variable in names:
                continue
            more = []
            for known in several:
                found = []
                for formula in (*choice.among, choice.such_that):
                    plain = plain_parts(self.domain, formula)
                    if plain.parts and self.schemas.free(plain) - {variable} <= known.keys():
                        join = self.schemas.join((choice.variable,), plain, frozenset(known))
                        found = [{**known, variable: b[variable]} for b, _ in join(self, known)]
                        if found:
                            break
                more += found or [known]
            several = more
        for known in several:
            own = {v.name for v in way.effect.variables}
            needed = self.schemas.free(way.effect.condition) - own
            if needed <= known.keys():
                condition = way.effect.condition
                if own:
                    open_now = tuple(v for v in way.effect.variables if v.name not in known)
                    bound = frozenset(self.schemas.free(condition)) & frozenset(known)
                    join = self.schemas.join(open_now, condition, bound)
                    if any(True for _ in join(self, known)):
                        yield known
                elif self.schemas.formula(condition)(self, known) is not False:
                    yield known


@contextmanager
def possible(state: State, made: Made, deadline: Deadline | None = None) -> Iterator[Possible]:
    """What could be brought about among the things of a state, worked out once for these things.

    While it is used it raises TimeUp where the deadline is over; what was then half worked out is
    forgotten.

    That a relation holds at first is asked anew; what follows from it may be remembered, by which
    too much is thought possible, never too little of what skills do.
    """
    recent = state.domain.__dict__.setdefault("_possible", OrderedDict())
    key = (tuple(state.kinds.items()), state.lost, tuple(made.items()))
    found: Possible | None = recent.get(key)
    if found is None:
        found = recent[key] = Possible(state, made)
        if len(recent) > _RECENT:
            recent.popitem(last=False)
    found.state, found.deadline = state, deadline
    try:
        yield found
    except BaseException:  # an interrupt, too, leaves nothing half worked out
        recent.pop(key, None)
        raise
    finally:
        found.deadline = None


def ways_of(domain: Domain) -> dict[str, list[Way]]:
    """Predicate (with "not " for what ends it) → effects that are about it."""
    found = domain.__dict__.get("_ways")
    if found is not None:
        return found  # type: ignore[no-any-return]
    ways: dict[str, list[Way]] = {}
    able = domain.robot.skills or tuple(domain.skills)
    seen: set[tuple[object, ...]] = set()
    schemas: list[Skill | Process] = [domain.skills[s] for s in able]
    for schema in [*schemas, *domain.processes]:
        simple = simple_needs(domain, schema) if isinstance(schema, Skill) else schema.condition
        if isinstance(schema, Skill) and schema.family:
            like = (schema.family, schema.parameters, schema.needs, schema.effects)
            if like in seen:
                continue
            seen.add(like)
        for effect in schema.effects:
            for fact in effect.facts:
                name = f"not {fact.predicate}" if fact.value == "false" else fact.predicate
                ways.setdefault(name, []).append(Way(schema, effect, fact, simple))
            for copy in effect.copies:
                ways.setdefault(copy.attribute, []).append(Way(schema, effect, copy, simple))
    domain.__dict__["_ways"] = ways
    return ways
