"""Which things of a scene a planning problem is about.

Called by `planner` before grounding; calls `closure` for what the wanted facts need, and keeps some
supports besides. Where the narrowed problem has no plan the planner takes `everything`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from forestall.deadline import Deadline
from forestall.planning.closure import Closure
from forestall.planning.goals import Conjunction, makeable
from forestall.planning.grounder import Universe, rigid_of
from forestall.planning.possible import possible
from forestall.planning.state import State
from forestall.types.facts import by_number

NEAR_BY_M = 0.8
"""Of supports that lie no farther apart than this none is nearer than the other."""
SUPPORTS = 2
"""How many supports are kept for putting things away."""


def everything(state: State) -> Universe:
    """All things, without a limit to where they are put."""
    things = tuple(sorted(state.kinds, key=by_number))
    made = makeable(state)
    kinds = {state.domain.canonical(n.rpartition("-")[0]) for ns in made.values() for n in ns}
    makers = {r[0] for s in state.domain.skills.values() for m in s.makes
              for r in state.domain.statics.get(m.by, ())}  # fmt: skip
    lasting = any(
        m.source not in {v for e in s.effects for v in e.gone}
        for s in state.domain.skills.values()
        for m in s.makes
    )
    return Universe(things, made, bounded=lasting or bool(kinds & makers))


def narrowed(
    state: State,
    goals: Sequence[Conjunction],
    also: Iterable[str] = (),
    shunned: frozenset[str] = frozenset(),
    deadline: Deadline | None = None,
) -> Universe:
    """The things that matter for any of the goals.

    Args:
        state: the first state.
        goals: ground alternatives.
        also: further things to keep.
        shunned: things that are taken last where others will do.
        deadline: when to stop.

    Raises:
        TimeUp: it is over.
    """
    made = makeable(state)
    with possible(state, made, deadline) as world:
        closure = Closure(state, world, shunned)
        closure.keep(h for _, h in state.in_hands())
        closure.keep(x for x in also if x in state.kinds)
        closure.keep(_map(state))
        for part in dict.fromkeys(p for goal in goals for p in goal):
            closure.want(part)
    chosen = _supports(state, closure.kept, closure.cleared, shunned)
    closure.keep(chosen)
    things = tuple(sorted((x for x in closure.kept if x not in state.lost), key=by_number))
    return Universe(things, closure.made, frozenset(closure.purposeful), tuple(chosen))


def _map(state: State) -> list[str]:
    """Things of one kind that a relation joins which nothing changes: where a way may lead over."""
    lasting = rigid_of(state.domain) & state.domain.relations.keys()
    joined = [f[1:] for f in sorted(state.facts) if f[0] in lasting] if lasting else []
    return [x for args in joined for x in args if len({state.kinds.get(a) for a in args}) == 1]


def _supports(state: State, kept: set[str], avoid: set[str], shunned: frozenset[str]) -> list[str]:
    """The best supports: room, not where something is to be cleared, near by."""
    domain = state.domain
    near = [x for x in kept if domain.is_a(state.kinds[x], domain.roles.movable)]
    beside = {state.root(x) for x in near}
    spots = [state.where[x] for x in near if x in state.where]

    def away(name: str) -> float:
        """How many ways of an arm's length it is from what may be moved."""
        if name in beside or name not in state.where or not spots:
            return 0.0
        return min(math.dist(state.where[name], s) for s in spots) // NEAR_BY_M

    roots = {state.root(x) for x in avoid}
    order = domain.roles.rest
    found = []
    for name, category in state.kinds.items():
        kinds = domain.kinds(category)
        ranks = [i for i, tag in enumerate(order) if tag in kinds]
        if ranks and not kinds & set(domain.roles.avoid):
            key = (
                name in shunned,
                name in state.crowded,
                name in roots,
                away(name),
                ranks[0],
                name not in kept,
            )
            found.append((key, by_number(name), name))
    best = sorted(found)[:SUPPORTS]
    return [name for _, _, name in sorted(best, key=lambda f: (f[0][:-1], f[1]))]
