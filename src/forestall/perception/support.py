"""What each thing is inside or on top of: one parent, the smallest that holds it.

The domain says which of the two relations a receptacle offers and what it accepts; points say
whether it holds. Support is a surface found right below and around an object (which hides what is
under it) or, where others hide that too, the top of something it stands over. Containment is walls
found around it. Both use only what is visible of the receptacle.
Called by `fuse.py`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from forestall.domain.model import Domain
from forestall.perception.config import PerceptionConfig
from forestall.perception.geometry import DIRECTIONS, Stack
from forestall.perception.surfaces import SURFACE, fixed
from forestall.perception.unproject import Points

CONTAINMENT = "containment"
"""Geometry of a predicate that walls around a thing show; any other one shows by support."""

Parent = tuple[str, str]
"""(predicate, id of the receptacle)."""


def parents(
    stack: Stack,
    subjects: Collection[str],
    meant: Mapping[str, Parent],
    domain: Domain,
    config: PerceptionConfig,
) -> dict[str, Parent]:
    """For each subject that rests in or on something: the relation and the receptacle.

    Args:
        stack: every located thing.
        subjects: ids whose parent is asked for.
        meant: where things were put since they were seen, as far as is known. There a thing need
            not have walls found around it, which others may hide, and the place may have been shut.
        domain: which receptacle takes what, and how.
        config: thresholds.
    """
    found: dict[str, Parent] = {}
    for a, thing in enumerate(stack.things):
        if thing.id not in subjects or fixed(domain, thing.category):
            continue
        parent = _parent(stack, a, meant.get(thing.id), domain, config)
        if parent is not None:
            found[thing.id] = parent
    return found


def circular(links: Mapping[str, Parent], seen: Collection[str]) -> list[str]:
    """Whose links must go so that nothing holds what holds it.

    A thing that was on another can be seen beneath it while the other is out of view: of links in a
    circle one that is only remembered goes, else the last by name.

    Args:
        links: thing → what it is in or on.
        seen: things whose links come from the newest views.
    """
    left, gone = dict(links), []
    for name in sorted(links):
        circle = [name]
        while (parent := left.get(circle[-1])) is not None and parent[1] not in circle:
            circle.append(parent[1])
        if parent is not None and parent[1] == name:
            remembered = sorted(n for n in circle if n not in seen)
            gone.append((remembered or sorted(circle))[-1])
            del left[gone[-1]]
    return gone


def _parent(
    stack: Stack, a: int, meant: Parent | None, domain: Domain, config: PerceptionConfig
) -> Parent | None:
    near = _touching(stack, a, config)
    candidates = [
        r for r in near if _takes(domain, stack.things[r].category, stack.things[a].category)
    ]
    if not candidates:
        return _on_anything(stack, a, near, _bottom_m(stack, a, domain), domain, config)
    own = stack.samples[a]
    over = stack.over(own, candidates, config.footprint_slack_m)
    share = dict(zip(candidates, over.mean(axis=0).tolist(), strict=True))
    bottom = _bottom_m(stack, a, domain)
    area = np.prod(stack.high_m[:, :2] - stack.low_m[:, :2], axis=1)
    holding: list[tuple[float, str, int]] = []
    touching: list[tuple[float, str, int]] = []
    for r in candidates:
        predicate = offered(domain, stack.things[r].category) or ""
        if domain.predicates[predicate].geometry == CONTAINMENT:
            put = meant == (predicate, stack.things[r].id)
            shut = stack.things[r].closed and not put
            within = not shut and _within(stack, a, r, share[r], domain, config)
            if within and (put or _walls(stack, a, r, bottom, config) >= config.enclosed_sectors):
                holding.append((float(area[r]), predicate, r))
            continue
        contacts = _contacts(stack, a, r, bottom, config)
        needed = config.on_top_share
        stays = fixed(domain, stack.things[r].category)
        if contacts >= config.plenty_contacts and not stays:
            needed = config.on_dish_share
        over_it = share[r] >= needed
        level = abs(float(stack.high_m[r, 2]) - bottom) <= config.contact_below_m
        if contacts >= config.min_contacts and (over_it or _covers(stack, a, r, config)):
            holding.append((float(area[r]), predicate, r))
        elif contacts >= config.min_contacts:
            touching.append((-float(contacts), predicate, r))
        elif over_it and level:
            touching.append((0.0, predicate, r))
    if not holding and not touching:
        return _on_anything(stack, a, near, bottom, domain, config)
    _, predicate, r = min(holding or touching)
    return predicate, stack.things[r].id


def _on_anything(
    stack: Stack,
    a: int,
    near: Sequence[int],
    bottom_m: float,
    domain: Domain,
    config: PerceptionConfig,
) -> Parent | None:
    """On which thing of no known category it stands: most of it over it, and its top at its foot.

    Asked where nothing that is known carries it.
    """
    low_m = float(stack.low_m[a, 2])
    strange = [
        r
        for r in near
        if domain.find(stack.things[r].category) is None
        and stack.things[r].category != SURFACE
        and bottom_m - config.contact_below_m
        <= stack.high_m[r, 2]
        <= low_m + config.contact_above_m
        and _contacts(stack, a, r, bottom_m, config) >= config.min_contacts
    ]
    if not strange:
        return None
    over = stack.over(stack.samples[a], strange, config.footprint_slack_m).mean(axis=0)
    share, r = max(zip(over.tolist(), strange, strict=True))
    how = offered(domain, stack.things[r].category)
    return None if how is None or share < config.on_strange_share else (how, stack.things[r].id)


def offered(domain: Domain, receptacle: str) -> str | None:
    """The relation in which a receptacle takes things; None: it takes none.

    A surface, and what the domain does not know, takes them on top.
    """
    if domain.find(receptacle) is not None:
        return domain.offers(receptacle)
    tops = (p for p in domain.containing if domain.predicates[p].geometry != CONTAINMENT)
    return next(tops, None)


def contains(category: str, domain: Domain) -> bool:
    """Whether things are within its walls and not on its top."""
    relation = domain.offers(category)
    return relation is not None and domain.predicates[relation].geometry == CONTAINMENT


def _takes(domain: Domain, receptacle: str, thing: str) -> bool:
    """Whether a thing can be in or on another, by rule; within walls only points count.

    A book in an oven is in it, whether or not it belongs there.
    """
    how = offered(domain, receptacle)
    if how is None:
        return False
    if domain.offers(receptacle) is None:
        return receptacle == SURFACE
    walls = domain.predicates[how].geometry == CONTAINMENT
    anything = domain.find(thing) is None or walls
    return anything or domain.accepts(receptacle, thing)


def _touching(stack: Stack, a: int, config: PerceptionConfig) -> list[int]:
    """Things whose boxes come close to that of `a`."""
    reach = np.array([config.ring_m, config.ring_m, 4 * config.contact_below_m])
    close = np.all(
        (stack.low_m <= stack.high_m[a] + reach) & (stack.high_m >= stack.low_m[a] - reach), axis=1
    )
    close[a] = False
    return [int(r) for r in np.flatnonzero(close)]


def _bottom_m(stack: Stack, a: int, domain: Domain) -> float:
    """Height of the foot: the lowest visible point, or lower if the category is taller."""
    category = domain.find(stack.things[a].category)
    size = None if category is None else category.size_m
    low, high = float(stack.low_m[a, 2]), float(stack.high_m[a, 2])
    return low if not size else min(low, high - float(size[2]))


def _contacts(stack: Stack, a: int, r: int, bottom_m: float, config: PerceptionConfig) -> int:
    """How many points of `r` lie at the height of a's foot, below or around it."""
    low, high = stack.low_m[a], stack.high_m[a]
    p = stack.things[r].points_world_m
    level = p[
        (p[:, 2] >= bottom_m - config.contact_below_m)
        & (p[:, 2] <= low[2] + config.contact_above_m)
    ]
    beside = np.all(
        (level[:, :2] >= low[:2] - config.ring_m) & (level[:, :2] <= high[:2] + config.ring_m),
        axis=1,
    )
    return int(np.count_nonzero(beside))


def _covers(stack: Stack, a: int, r: int, config: PerceptionConfig) -> bool:
    """Whether most of a small support lies under `a` (what shows of a burner under a pot)."""
    reach = stack.samples[r][:, :2] @ DIRECTIONS
    under = np.all(reach <= stack.footprint_m[a] + config.ring_m, axis=1)
    return bool(under.mean() >= config.covered_share)


def _within(
    stack: Stack, a: int, r: int, share: float, domain: Domain, config: PerceptionConfig
) -> bool:
    """Whether `a` is over the floor of `r` and not over its rim; beside it are perhaps no walls."""
    receptacle = stack.things[r]
    if share < config.inside_share:
        return False
    z = stack.samples[a][:, 2]
    floor, rim = float(stack.low_m[r, 2]), float(stack.high_m[r, 2])
    if float(np.median(z)) < floor - config.rim_slack_m:
        return False
    if domain.encloses(receptacle.category):
        return float((z <= rim).mean()) >= config.inside_share
    return float(stack.low_m[a, 2]) <= rim + config.rim_slack_m


def _walls(stack: Stack, a: int, r: int, bottom_m: float, config: PerceptionConfig) -> int:
    """In how many directions around `a`, at its height, points of `r` are found."""
    centre = (stack.low_m[a, :2] + stack.high_m[a, :2]) / 2
    p: Points = stack.things[r].points_world_m
    level = (p[:, 2] >= bottom_m - config.wall_reach_m) & (
        p[:, 2] <= stack.high_m[a, 2] + config.wall_reach_m
    )
    offset = p[level][:, :2] - centre
    turn = np.arctan2(offset[:, 1], offset[:, 0]) / (2 * np.pi) * config.sectors
    return len(np.unique(np.floor(turn).astype(np.int64) % config.sectors))
