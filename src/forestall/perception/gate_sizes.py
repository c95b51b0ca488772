"""Visible sizes of things against those of their categories. Called by `gate_scene.py`.

A thing that the border of the picture cuts, or that something stands before, may look too small and
never too large: it is left out where it looks small, and the others are judged. Where the domain
states how high furniture is, the height of its top over the floor is held against depth, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from forestall.domain.model import Domain
from forestall.perception.coarse import Coarse
from forestall.perception.gate_config import GateConfig
from forestall.perception.unproject import Points
from forestall.types.finding import Finding

_APART_M = 0.08
_WRONG = "the unit of depth or the focal length is wrong"


@dataclass(frozen=True, slots=True)
class Sized:
    """How large a thing looks: its visible diagonal over that of its category.

    Args:
        name: of the instance, or of the category.
        ratio: 1 where all of it shows and it is as the category says.
        whole: whether neither the border nor another thing hides a part of it.
    """

    name: str
    ratio: float
    whole: bool


def judge_sizes(
    look: Coarse, index: int, stands_m: float, domain: Domain, limits: GateConfig
) -> Iterator[Finding]:
    """Everything is larger, or everything whole is smaller, than it can be.

    Of one thing alone it is said, and refused only where no wrong name explains it.

    Args:
        look: the picture.
        index: of the picture.
        stands_m: height of the floor on which the robot stands.
        domain: how large things are.
        limits: of the gate.
    """
    found = list(_extents(look, domain, limits))
    whole = [s for s in found if s.whole]
    small = limits.too_small if len(whole) == 1 else limits.all_too_small
    if whole and max(s.ratio for s in whole) < small:
        yield _finding(whole, "smaller", index, limits)
        return
    for least, count in ((limits.all_too_large, 2), (limits.too_large, 1)):
        told = [s for s in found if s.whole or s.ratio > least]
        if len(told) >= count and min(s.ratio for s in told) > least:
            yield _finding(told, "larger", index, limits)
            return
    yield from _furniture(look, index, stands_m, whole, domain, limits)


def _finding(found: Sequence[Sized], than: str, index: int, limits: GateConfig) -> Finding:
    """One thing alone may be another than it is called: by that much no thing is another."""
    told = f"everything whose size is known is {than} than it can be ({_listed(found)})"
    off = max(max(s.ratio, 1 / s.ratio) for s in found)
    if len(found) == 1 and off < limits.lone_refused:
        return Finding("sizes", f"{told}: it is miscalled, or {_WRONG}", index, refuses=False)
    return Finding("sizes", f"{told}: {_WRONG}", index)


def _listed(found: Sequence[Sized]) -> str:
    listed = ", ".join(f"{s.name} {s.ratio:.2g} times" for s in found[:3])
    return f"{listed} as long as its category"


def _furniture(
    look: Coarse,
    index: int,
    stands_m: float,
    whole: Sequence[Sized],
    domain: Domain,
    limits: GateConfig,
) -> Iterator[Finding]:
    """Things and the top of the highest furniture say that depth is off by the same factor."""
    if len(whole) < 2:
        return
    ratios = [s.ratio for s in whole]
    if limits.furniture_small <= max(ratios) and min(ratios) <= limits.furniture_large:
        return
    top = _highest(look, stands_m, domain, limits)
    if top is None:
        return
    name, seen_m, stated_m = top
    camera_m = float(look.frame.camera_to_world[2, 3]) - stands_m
    factor = (camera_m - seen_m) / (camera_m - stated_m)
    said = float(np.median(ratios))
    near = max(said / factor, factor / said) <= limits.furniture_near
    if near and max(factor, 1 / factor) >= limits.furniture_off:
        than = "larger" if factor > 1 else "smaller"
        yield Finding(
            "sizes",
            f"things are {than} than their categories ({_listed(whole)}), and the top of {name} "
            f"is seen {seen_m:.2f} m above the floor, its category is {stated_m:.2f} m high; both "
            f"fit if depth is {factor:.2g} times what it is: {_WRONG}",
            index,
        )


def _highest(
    look: Coarse, stands_m: float, domain: Domain, limits: GateConfig
) -> tuple[str, float, float] | None:
    """Name, seen height and stated height over the floor of the support that is stated highest.

    None where no top is seen whose stated height is below the camera.
    """
    found: list[tuple[float, str, float]] = []
    camera_m = float(look.frame.camera_to_world[2, 3]) - stands_m
    for label, category in enumerate(look.categories):
        known = domain.find(category)
        if known is None or not known.size_m or not domain.is_open_support(category):
            continue
        if not domain.is_a(category, domain.roles.fixture):
            continue
        tops = look.lying(label, limits.level)
        if len(tops) < limits.sized_cells:
            continue
        seen_m = float(np.median(tops[:, 2])) - stands_m
        if min(camera_m - seen_m, camera_m - known.size_m[2]) > limits.min_distance_m:
            found.append((known.size_m[2], look.instances[label] or category, seen_m))
    if not found:
        return None
    stated_m, name, seen_m = max(found)
    return name, seen_m, stated_m


def _extents(look: Coarse, domain: Domain, limits: GateConfig) -> Iterator[Sized]:
    """Every thing whose category has a size and that is seen well enough."""
    for label, category in enumerate(look.categories):
        known = domain.find(category)
        if known is None or not known.size_m:
            continue
        cells = look.cells(label)
        if int(cells.sum()) < limits.sized_cells:
            continue
        low, high = np.percentile(_main_part(look, label), (4, 96), axis=0)
        ratio = float(np.linalg.norm(high - low) / np.linalg.norm(known.size_m))
        hidden = look.cut(label) or look.covered(label, limits.covered_step) >= limits.covered
        yield Sized(look.instances[label] or category, ratio, not hidden)


def _main_part(look: Coarse, label: int) -> Points:
    """(n, 3) points of a mask without what a mask that is too wide shows behind or before it."""
    points = look.points_world_m[look.cells(label)]
    away = np.linalg.norm(points - look.frame.camera_to_world[:3, 3], axis=1)
    order = np.argsort(away)
    part = np.cumsum(np.diff(away[order], prepend=away[order[0]]) > _APART_M)
    largest: Points = points[order[part == int(np.bincount(part).argmax())]]
    return largest
