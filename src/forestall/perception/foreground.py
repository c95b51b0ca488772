"""Which pixels of a mask are its thing's own: masks of cameras bleed, erode and overlap.

A mask has a core, which is well inside, and a rim. A piece of the rim belongs to the thing if depth
goes on from the core to it, and to what is around if it goes on from outside and not from the core:
to another thing's mask, or to what is behind. What lies in the level surface around the thing is
that surface's, also at its foot, where depth goes on from both. Flying pixels are nobody's, unless
they are as near to the core as the thing is wide. All masks of a picture are looked at together,
large ones on the lattice on which they are unprojected. Called by the perceiver.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from forestall.perception.config import PerceptionConfig
from forestall.perception.unproject import Labels, heights, rays, strides
from forestall.types.observation import Depth, Frame

Flags = npt.NDArray[np.bool_]
Index = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float32]
Depths = npt.NDArray[np.uint8]
Pairs = tuple[Index, npt.NDArray[np.int32]]

_NOISE_ROWS = 16
_SECOND_DIFFERENCE = 0.6745 * np.sqrt(6.0)  # its median, by the deviation of one value
_MODE_M = 0.005


def noise_share(depth_m: Depth) -> float:
    """Deviation of depth by its square, in 1/m: how rough what is smooth looks.

    From second differences along some rows, whose median does not see edges.
    """
    rows = depth_m[:: max(1, len(depth_m) // _NOISE_ROWS)].astype(np.float64)
    a, b, c = rows[:, :-2], rows[:, 1:-1], rows[:, 2:]
    known = (a > 0) & (b > 0) & (c > 0)
    if not known.any():
        return 0.0
    rough = np.abs(a - 2 * b + c)[known] / b[known] ** 2
    return float(np.median(rough)) / float(_SECOND_DIFFERENCE)


def own_pixels(
    frame: Frame, labels: Labels, movable: Sequence[bool], config: PerceptionConfig
) -> Labels:
    """(H, W) labels without the pixels that are not their thing's own.

    Args:
        frame: depth and camera.
        labels: (H, W) index of the detection at each pixel, -1 for none.
        movable: for each detection, whether it is of a thing that can be moved.
        config: thresholds.
    """
    count, moves = len(movable), np.asarray(movable, dtype=np.bool_)
    pixels = np.bincount(labels.ravel() + 1, minlength=count + 1)[1:]
    every = np.where(moves, np.minimum(strides(pixels, config), 2), strides(pixels, config))
    noise = noise_share(frame.depth_m)
    kept = labels
    for step in np.unique(every[pixels > 0]).tolist():
        rim = _Rim.of(frame, labels, every == step, moves, step, config)
        gone = None if rim is None else rim.foreign(noise)
        if rim is None or gone is None:
            continue
        if kept is labels:
            kept = labels.copy()
        rows, columns = np.nonzero(gone)
        near = np.arange(1 - step, step)
        y = np.clip((rows + rim.top)[:, None, None] * step + near[:, None], 0, len(labels) - 1)
        x = np.clip((columns + rim.left)[:, None, None] * step + near, 0, labels.shape[1] - 1)
        at = (y * labels.shape[1] + x).ravel()
        same = labels.take(at) == np.repeat(rim.labels[rows, columns], near.size**2)
        np.put(kept, at[same], -1)
    return kept


@dataclass(frozen=True, slots=True, eq=False)
class _Rim:
    """Some masks of a frame on a lattice, cut to the window that shows them.

    Args:
        frame: depth and camera.
        labels: (h, w) of all masks in the window.
        depth: (h, w).
        top: first row of the window on the lattice.
        left: first column.
        step: pixels between two of the lattice.
        movable: whether each mask is of a thing that can be moved.
        rim: (h, w) pixels of these masks near their outline.
        core: (h, w) pixels of these masks well inside.
        blind: (h, w) pixels near the outline without depth, which stand for others.
        config: thresholds.
    """

    frame: Frame
    labels: Labels
    depth: Depth
    top: int
    left: int
    step: int
    movable: Flags
    rim: Flags
    core: Flags
    blind: Flags
    config: PerceptionConfig

    @classmethod
    def of(
        cls,
        frame: Frame,
        labels: Labels,
        meant: Flags,
        movable: Flags,
        step: int,
        config: PerceptionConfig,
    ) -> _Rim | None:
        """Those masks for which `meant` is true; None where none is there."""
        thin = labels[::step, ::step]
        mine = np.append(meant, False).take(thin)
        rows, columns = np.flatnonzero(mine.any(axis=1)), np.flatnonzero(mine.any(axis=0))
        if len(rows) == 0:
            return None
        around = -(-2 * config.rim_px // step)
        top, left = max(0, int(rows[0]) - around), max(0, int(columns[0]) - around)
        window = np.s_[top : int(rows[-1]) + around + 1, left : int(columns[-1]) + around + 1]
        thin, mine = thin[window], mine[window]
        depth = frame.depth_m[::step, ::step][window]
        wide = min(-(-config.rim_px // step), np.iinfo(np.uint8).max)
        deep = _depths(thin, wide)
        inside = mine & (depth > 0)
        level = _levels(thin, deep, inside, len(meant), wide, config)
        core: Flags = inside & (deep >= np.append(level, 0).astype(np.uint8).take(thin))
        blind = mine & (depth <= 0) & (deep < wide) & (step > 1)
        rim = inside & ~core
        return cls(frame, thin, depth, top, left, step, movable, rim, core, blind, config)

    def foreign(self, noise: float) -> Flags | None:
        """(h, w) pixels of the rim that are not their thing's own, None for none."""
        index = np.flatnonzero(self.rim)
        if len(index) == 0:
            return None
        from_core, from_outside, from_thing = self._reached(index, noise)
        gone = self.blind.copy()
        flat = gone.ravel()
        apart = ~from_core
        flat[index[apart & from_thing]] = True
        self._astray(index[apart & from_outside & ~from_thing], self.config.behind_m, flat)
        self._astray(index[apart & ~from_outside], None, flat)
        self._level(index[from_outside & ~flat[index]], noise, flat)
        return gone

    def _reached(self, index: Index, noise: float) -> tuple[Flags, Flags, Flags]:
        """Of each pixel of the rim, whether its piece is joined to the core, or to what is around.

        The last says whether what is around is another movable thing's mask. Neighbours are joined
        if no surface but a very steep one has the step between them, noise allowed for.
        """
        labels, depth = self.labels.ravel(), self.depth.ravel()
        core = self.core.ravel()
        height, width = self.labels.shape
        node = np.full(labels.size, -1, dtype=np.int32)
        node[index] = np.arange(len(index), dtype=np.int32)
        column, row = index % width, index // width
        z, own = depth[index], labels[index]
        pitch = self.config.steep * self.step / self.frame.intrinsics.fx
        least = np.float32(self.config.edge_m) + z * (np.float32(pitch) + z * np.float32(4 * noise))
        entered = np.zeros(len(index), dtype=np.bool_)
        by_thing = np.zeros(len(index), dtype=np.bool_)
        movable = np.append(self.movable, False)
        seeded = np.zeros(len(index), dtype=np.bool_)
        linked = []
        for within, offset in (
            (column + 1 < width, 1),
            (column > 0, -1),
            (row + 1 < height, width),
            (row > 0, -width),
        ):
            beside = np.where(within, index + offset, index)
            far = depth[beside]
            joined = within & (np.abs(far - z) <= least) & (far > 0)
            same = labels[beside] == own
            other = np.flatnonzero(joined & ~same)
            entered[other] = True
            by_thing[other] |= movable[labels[beside[other]]]
            joined &= same
            seeded |= joined & core[beside]
            if offset > 0:
                pair = np.flatnonzero(joined & (node[beside] >= 0))
                linked.append((pair, node[beside[pair]]))
        pieces, piece = _pieces(len(index), *linked)
        has = np.zeros((3, pieces), dtype=np.bool_)
        for which, flags in enumerate((seeded, entered, by_thing)):
            has[which, piece[flags]] = True
        return has[0, piece], has[1, piece], has[2, piece]

    def _level(self, contested: Index, noise: float, gone: Flags) -> None:
        """Mark contested pixels that lie in the level surface around their thing."""
        if len(contested) == 0:
            return
        labels, depth = self.labels.ravel(), self.depth.ravel()
        order = contested[np.argsort(labels[contested], kind="stable")]
        owner = labels[order]
        starts = np.flatnonzero(np.diff(owner, prepend=-1))
        ends = np.append(starts[1:], len(order))
        high = self._heights()
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
            some = order[start:end]
            around, rough_m, middle_m = self._around(int(owner[start]), some, high)
            if around is None:
                continue
            far = _median(depth[some])
            slack = max(self.config.level_m, 2.5 * noise * far * far, 2.5 * rough_m)
            if middle_m - around > slack + self.config.flat_m:
                gone[some[np.abs(high.ravel()[some] - around) <= slack]] = True

    def _heights(self) -> Floats:
        """(h, w) height in the world."""
        height, width = self.labels.shape
        every = self.step
        x, y = rays(self.frame.intrinsics)
        x, y = x[::every][self.left :][:width], y[::every][self.top :][:height]
        return heights(self.depth, x, y, self.frame.camera_to_world)

    def _around(self, label: int, some: Index, high: Floats) -> tuple[float | None, float, float]:
        """Height of the level surface around a mask, None where there is none, and its roughness.

        The last is the height of the middle of the mask.
        """
        config = self.config
        rows, columns = np.divmod(some, self.labels.shape[1])
        reach = -(-2 * config.rim_px // self.step)
        box = np.s_[
            max(0, int(rows.min()) - reach) : int(rows.max()) + reach + 1,
            max(0, int(columns.min()) - reach) : int(columns.max()) + reach + 1,
        ]
        beside = (self.labels[box] != label) & (self.depth[box] > 0)
        mine = (self.labels[box] == label) & self.core[box]
        if not mine.any():
            return None, 0.0, 0.0
        own = high[box][mine]
        low, middle = float(own.min()), _median(own)
        near = high[box][beside]
        near = near[np.abs(near - low) < config.ring_m]
        if len(near) < config.ring_pixels:
            return None, 0.0, middle
        cells = np.floor((near - low) / _MODE_M).astype(np.int64)
        cells -= cells.min()
        held = np.bincount(cells)
        best = int(held.argmax())
        level = near[np.abs(cells - best) <= 2]
        if len(level) < config.level_share * len(near):
            return None, 0.0, middle
        return _median(level), float(level.std()), middle

    def _astray(self, strays: Index, behind_m: float | None, gone: Flags) -> None:
        """Mark what is farther from the core, along the line of sight, than the thing is wide.

        What is behind it, farther than `behind_m`.
        """
        if len(strays) == 0:
            return
        labels, depth = self.labels.ravel(), self.depth.ravel()
        width = self.labels.shape[1]
        for label in np.unique(labels[strays]).tolist():
            mine = strays[labels[strays] == label]
            core = np.flatnonzero(self.core.ravel() & (labels == label))
            if len(core) == 0:
                continue
            z = depth[core]
            rows, columns = np.divmod(core, width)
            pixels = max(int(np.ptp(rows)), int(np.ptp(columns))) * self.step
            wide = pixels * float(z.max()) / self.frame.intrinsics.fx
            before, behind = z.min() - depth[mine], depth[mine] - z.max()
            gone[mine[(before > wide) | (behind > (wide if behind_m is None else behind_m))]] = True


def _median(values: Floats) -> float:
    """As numpy has it, for some of which none is nan and that are few: its checks take longer."""
    half = len(values) // 2
    first = half - 1 + len(values) % 2
    return float(np.partition(values, (first, half))[first : half + 1].mean())


def _pieces(count: int, across: Pairs, down: Pairs) -> tuple[int, npt.NDArray[np.int32]]:
    """How many connected pieces some pixels make, and of which one each of them is.

    Args:
        count: of the pixels, row by row.
        across: which of them are linked with the next one.
        down: which are linked with one of the next row.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    begins = np.ones(count, dtype=np.int32)
    begins[across[1]] = 0
    run = np.cumsum(begins, dtype=np.int32) - 1  # pieces of one row, of which there are few
    one, other = run[down[0]], run[down[1]]
    fresh = np.flatnonzero((np.diff(one, prepend=-1) != 0) | (np.diff(other, prepend=-1) != 0))
    runs = int(run[-1]) + 1
    ends = np.searchsorted(one[fresh], np.arange(runs + 1, dtype=np.int32))  # in order of runs
    links = csr_array((np.ones(len(fresh)), other[fresh], ends), shape=(runs, runs))
    pieces, piece = connected_components(links, directed=False)
    return int(pieces), piece[run]


def _depths(labels: Labels, most: int) -> Depths:
    """(h, w) pixels from each one to the outline of its mask, 0 on it, `most` at most."""
    inner = np.ones(labels.shape, dtype=np.bool_)
    across = labels[:, 1:] == labels[:, :-1]
    down = labels[1:] == labels[:-1]
    inner[:, 1:] &= across
    inner[:, :-1] &= across
    inner[1:] &= down
    inner[:-1] &= down
    deep: Depths = np.zeros(labels.shape, dtype=np.uint8)
    for _ in range(most):
        deep += inner.view(np.uint8)
        rows = inner.copy()
        rows[1:] &= inner[:-1]
        rows[:-1] &= inner[1:]
        inner = rows.copy()
        inner[:, 1:] &= rows[:, :-1]
        inner[:, :-1] &= rows[:, 1:]
    return deep


def _levels(
    labels: Labels,
    deep: Depths,
    inside: Flags,
    count: int,
    wide: int,
    config: PerceptionConfig,
) -> Index:
    """For each mask, how deep its core begins: as deep as leaves a share of it."""
    steps = wide + 1
    key = labels[inside].astype(np.int64) * steps + deep[inside]
    held = np.bincount(key, minlength=count * steps).reshape(count, steps)
    held = held[:, ::-1].cumsum(axis=1)[:, ::-1]
    enough = held >= config.core_share * held[:, :1]
    level: Index = wide - enough[:, ::-1].argmax(axis=1)
    return level
