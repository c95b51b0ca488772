"""How alike two nodes look: the cosine of their image features (Eq. 1, feature "image").

Called by prepare, matching and batch; calls nothing. Features are rows of whole numbers, so their
products are exact in whatever order they are summed, and one pair at a time gives the same cosine
as thousands at once, to the last bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError
from forestall.types.feature import LARGEST, whole_numbers

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

QUANTUM = 2.0**-24
"""Step to which similarities are rounded."""

NEVER = -1.0
"""Stands in a table of similarities where two nodes may not match, however alike they look."""

_EXACT = 2**24 // (LARGEST + 1) ** 2
"""So many numbers a row may have for its products to be exact in float32."""


@dataclass(frozen=True, slots=True, eq=False)
class Looks:
    """The nodes of a graph, or of a row of graphs, that have an image feature.

    Args:
        at: (k) rising positions of those nodes.
        rows: (k, d) int8; (0, 0) where there is none.
        lengths: (k) Euclidean length of each row.
    """

    at: Ints
    rows: npt.NDArray[np.int8]
    lengths: Floats


NOTHING = Looks(np.zeros(0, np.int64), np.zeros((0, 0), np.int8), np.zeros(0))
"""No node has a feature."""


def looks_of(features: Sequence[bytes | None]) -> Looks:
    """The features of n nodes, None where a node has none.

    Raises:
        InputError: features of different lengths.
    """
    at = [i for i, f in enumerate(features) if f is not None]
    if not at:
        return NOTHING
    known = [f for f in features if f is not None]
    _same_size({len(f) for f in known})
    rows = np.stack([whole_numbers(f) for f in known])
    lengths = np.sqrt((rows.astype(np.int64) ** 2).sum(axis=1))
    return Looks(np.array(at, dtype=np.int64), rows, lengths)


def joined(looks: Sequence[Looks], stride: int) -> Looks:
    """Several graphs in one row, the nodes of the r-th from position r * stride on.

    Raises:
        InputError: features of different lengths.
    """
    there = [(r, x) for r, x in enumerate(looks) if x.at.size]
    if not there:
        return NOTHING
    _same_size({x.rows.shape[1] for _, x in there})
    return Looks(
        np.concatenate([r * stride + x.at for r, x in there]),
        np.concatenate([x.rows for _, x in there]),
        np.concatenate([x.lengths for _, x in there]),
    )


def seen(otherwise: Floats, ours: Looks, theirs: Looks, floor: float) -> Floats:
    """(n, m) similarities: by looks where both nodes have a feature, as given where one has none.

    Args:
        otherwise: (n, m) similarities of the texts, `NEVER` where two nodes may not match.
        ours: of the n nodes.
        theirs: of the m nodes.
        floor: cosines below it count as 0.

    Raises:
        InputError: features of different lengths.
    """
    result = np.maximum(otherwise, 0.0)
    if not (ours.at.size and theirs.at.size):
        return result
    size = _same_size({ours.rows.shape[1], theirs.rows.shape[1]})
    products: npt.NDArray[np.floating]
    if size <= _EXACT:
        products = ours.rows.astype(np.float32) @ theirs.rows.astype(np.float32).T
    else:
        products = ours.rows.astype(np.float64) @ theirs.rows.astype(np.float64).T
    cosines: Floats = products / (ours.lengths[:, None] * theirs.lengths)
    cosines = np.minimum(np.rint(cosines / QUANTUM) * QUANTUM, 1.0)
    both = np.ix_(ours.at, theirs.at)
    result[both] = np.where((cosines >= floor) & (otherwise[both] >= 0), cosines, 0.0)
    return result


def _same_size(sizes: set[int]) -> int:
    if len(sizes) > 1:
        raise InputError(
            f"image features of {' and '.join(map(str, sorted(sizes)))} numbers do not compare: "
            "record the demonstrations with the image encoder that is in use"
        )
    return sizes.pop()
