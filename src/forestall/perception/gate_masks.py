"""Masks against the picture and against depth. Called by `gate.py`.

Where a thing ends depth bends: the outlines of right masks lie on bends of inverse depth (which is
linear over every plane, so that a floor seen at a grazing angle has none). If the outlines lie on
them much better after a shift, or after turning the masks over, masks and depth do not belong
together. Where the ground ends and no mask begins tells nothing: it meets walls in a crease.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from forestall.domain.model import Domain
from forestall.perception.coarse import Coarse
from forestall.perception.gate_config import GateConfig
from forestall.types.finding import Finding

Cells = npt.NDArray[np.float32]


def judge_masks(
    look: Coarse, index: int, domain: Domain | None, limits: GateConfig
) -> Iterator[Finding]:
    """What masks say that cannot be."""
    if not look.categories:
        yield Finding("masks", "nothing was detected in this picture", index, refuses=False)
        return
    yield from _shares(look, index, domain, limits)
    if look.outlined:
        yield from _alignment(look, index, domain, limits)


def _shares(
    look: Coarse, index: int, domain: Domain | None, limits: GateConfig
) -> Iterator[Finding]:
    if domain is None:
        return
    counts = np.bincount(look.labels.ravel() + 1, minlength=len(look.categories) + 1)[1:]
    for label, category in enumerate(look.categories):
        share = float(counts[label]) / look.labels.size
        if share > limits.whole_share and domain.is_a(category, domain.roles.movable):
            yield Finding(
                "masks",
                f"the mask of {look.instances[label] or category} covers {100 * share:.0f} % of "
                "the picture: scores or logits read as a mask, or a mask turned inside out",
                index,
            )


def _alignment(
    look: Coarse, index: int, domain: Domain | None, limits: GateConfig
) -> Iterator[Finding]:
    outline = _outlines(look, domain)
    if int(outline.sum()) < limits.min_edges:
        return
    bends = _bends(look, limits.edge_step)
    near = limits.near_cells
    here = _hit(bends, outline, near, limits.sure_hit)
    if here >= limits.sure_hit:
        return
    turned = {
        "upside down": outline[::-1],
        "mirrored": outline[:, ::-1],
        "turned by half": outline[::-1, ::-1],
    }
    fits = {name: _hit(bends, cells, near, 1.0) for name, cells in turned.items()}
    shift, best = _shifted(bends, outline, limits)
    pixels = f"shifted by ({shift[0] * look.step}, {shift[1] * look.step}) pixels"
    fits[pixels] = best
    name = max(fits, key=lambda k: fits[k])
    if fits[name] >= max(limits.min_hit, limits.hit_ratio * here):
        yield Finding(
            "masks",
            f"masks and depth do not fit each other: outlines lie on edges of depth "
            f"{fits[name] / max(here, 0.01):.1f} times as often when the masks are {name}",
            index,
        )


def _outlines(look: Coarse, domain: Domain | None) -> Cells:
    """(h, w) 1 on both sides of where a mask meets another or, unless the ground has it, none."""
    labels = look.labels
    if domain is not None:
        ground = [domain.is_a(c, domain.roles.ground) for c in look.categories]
        labels = np.where(np.append(ground, False)[labels], -1, labels)
    cells: Cells = np.zeros(labels.shape, dtype=np.float32)
    across = labels[:, 1:] != labels[:, :-1]
    down = labels[1:] != labels[:-1]
    cells[:, 1:][across] = cells[:, :-1][across] = 1.0
    cells[1:][down] = cells[:-1][down] = 1.0
    return cells


def _bends(look: Coarse, step: float) -> Cells:
    """(h, w) 1 where inverse depth bends."""
    z, known = look.depth_m, look.known
    inverse = np.zeros_like(z)
    np.divide(1.0, z, out=inverse, where=known)
    bend = np.zeros_like(z)
    across = np.abs(inverse[:, 2:] + inverse[:, :-2] - 2 * inverse[:, 1:-1])
    down = np.abs(inverse[2:] + inverse[:-2] - 2 * inverse[1:-1])
    across[~(known[:, 2:] & known[:, :-2])] = 0.0
    down[~(known[2:] & known[:-2])] = 0.0
    bend[:, 1:-1] = across
    np.maximum(bend[1:-1], down, out=bend[1:-1])
    found: Cells = ((bend * z > step) & known).astype(np.float32)
    return found


def _hit(bends: Cells, outline: Cells, reach: int, enough: float) -> float:
    """Largest share of an outline on bends over the shifts of at most `reach` cells.

    The first one that is enough will do; the near shifts are looked at first.
    """
    height, width = bends.shape
    inner = outline[reach : height - reach, reach : width - reach]
    total = float(inner.sum())
    if total == 0.0:
        return 0.0
    best = 0.0
    for dy, dx in sorted(np.ndindex(2 * reach + 1, 2 * reach + 1), key=lambda s: _far(s, reach)):
        over = bends[dy : dy + inner.shape[0], dx : dx + inner.shape[1]]
        best = max(best, float(np.vdot(inner, over)) / total)
        if best >= enough:
            break
    return best


def _far(shift: tuple[int, ...], reach: int) -> int:
    return sum(abs(s - reach) for s in shift)


def _shifted(bends: Cells, outline: Cells, limits: GateConfig) -> tuple[tuple[int, int], float]:
    """The best shift (x, y) in cells that is none of the near ones, and its share."""
    from scipy import fft

    height, width = bends.shape
    reach = min(limits.far_cells, height // 3, width // 3)
    size = (
        fft.next_fast_len(height + reach, real=True),
        fft.next_fast_len(width + reach, real=True),
    )
    product = fft.rfft2(bends, size) * np.conj(fft.rfft2(outline, size))
    matches = fft.irfft2(product, size)
    shifts = np.arange(-reach, reach + 1)
    matches = matches[np.ix_(shifts, shifts)]
    sums = np.pad(outline.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    low_y, high_y = np.maximum(-shifts, 0), np.minimum(height - shifts, height)
    low_x, high_x = np.maximum(-shifts, 0), np.minimum(width - shifts, width)
    inside = (
        sums[np.ix_(high_y, high_x)]
        - sums[np.ix_(low_y, high_x)]
        - sums[np.ix_(high_y, low_x)]
        + sums[np.ix_(low_y, low_x)]
    )
    share = matches / np.maximum(inside, 0.5 * float(outline.sum()))
    near = np.abs(shifts) <= 2 * limits.near_cells
    share[np.ix_(near, near)] = 0.0
    row, column = np.unravel_index(int(share.argmax()), share.shape)
    return (int(shifts[column]), int(shifts[row])), float(share[row, column])
