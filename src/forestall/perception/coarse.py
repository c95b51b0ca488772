"""One picture on a coarse lattice: what the input gate looks at. Called by `gate.py`.

Every n-th pixel of depth and masks, their points in the world, and the direction of the surface at
each of them. Everything is worked out once, when it is first asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from forestall.perception.unproject import Labels, Points, label_image
from forestall.types.facts import category_of, is_instance
from forestall.types.observation import Detection, Frame

Flags = npt.NDArray[np.bool_]

_STEEP = 0.08  # step to a neighbour, as a share of the distance, over which there is no surface

_NEIGHBOURS = (
    (np.s_[1:], np.s_[:-1]),
    (np.s_[:-1], np.s_[1:]),
    (np.s_[:, 1:], np.s_[:, :-1]),
    (np.s_[:, :-1], np.s_[:, 1:]),
)


@dataclass(frozen=True, slots=True, eq=False)
class Masks:
    """What a segmenter found in a frame, and the image of it: (H, W) index, -1 for none."""

    detections: Sequence[Detection]
    labels: Labels

    @classmethod
    def of(cls, detections: Sequence[Detection], step: int, shape: tuple[int, ...]) -> Masks:
        """Every `step`-th pixel of some masks."""
        thin = [Detection(d.category, d.mask[::step, ::step], d.instance) for d in detections]
        height, width = (-(-n // step) for n in shape)
        return cls(detections, label_image(thin, (height, width)))


@dataclass(frozen=True, eq=False)
class Coarse:
    """A frame thinned to about `rows` rows.

    Args:
        frame: the picture.
        step: every so many pixels.
        labels: (h, w) index into the names, -1 for none.
        categories: of each label.
        instances: name of each label, None where the segmenter does not track.
        outlined: whether every mask ends where its thing ends.
    """

    frame: Frame
    step: int
    labels: Labels
    categories: tuple[str, ...]
    instances: tuple[str | None, ...]
    outlined: bool = True

    @classmethod
    def of(cls, frame: Frame, masks: Masks | None, rows: int) -> Coarse:
        """Thin a frame; with its own masks where none are given."""
        step = max(1, frame.intrinsics.height // rows)
        if masks is None and frame.detections is None and frame.instance_ids is not None:
            labels = frame.instance_ids[::step, ::step].astype(np.int16)
            names = frame.instance_names
            instances = tuple(n if is_instance(n) else None for n in names)
            return cls(frame, step, labels, tuple(category_of(n) for n in names), instances)
        if masks is None:
            masks = Masks.of(frame.detections or (), step, frame.depth_m.shape)
            labels = masks.labels
        else:
            labels = masks.labels[::step, ::step]
        found = masks.detections
        return cls(
            frame,
            step,
            labels,
            tuple(d.category for d in found),
            tuple(d.instance for d in found),
            all(d.outlined for d in found),
        )

    @cached_property
    def depth_m(self) -> npt.NDArray[np.float32]:
        """(h, w) z-depth, 0 where nothing returned."""
        return np.ascontiguousarray(self.frame.depth_m[:: self.step, :: self.step])

    @cached_property
    def known(self) -> Flags:
        """(h, w) where depth returned."""
        return self.depth_m > 0

    @cached_property
    def points_world_m(self) -> Points:
        """(h, w, 3) in the world; without meaning where nothing returned."""
        k, z = self.frame.intrinsics, self.depth_m.astype(np.float64)
        height, width = z.shape
        x = (np.arange(width) * self.step - k.cx) / k.fx
        y = (np.arange(height) * self.step - k.cy) / k.fy
        local = np.stack([x[None, :] * z, y[:, None] * z, z], axis=-1)
        turned: Points = local @ self.frame.camera_to_world[:3, :3].T
        return turned + self.frame.camera_to_world[:3, 3]

    @cached_property
    def _surface(self) -> tuple[Points, Flags]:
        p, z = np.ascontiguousarray(np.moveaxis(self.points_world_m, -1, 0)), self.depth_m
        ax, ay, az = p[:, 1:-1, 2:] - p[:, 1:-1, :-2]
        bx, by, bz = p[:, 2:, 1:-1] - p[:, :-2, 1:-1]
        normal = np.stack([by * az - bz * ay, bz * ax - bx * az, bx * ay - by * ax])
        length = np.sqrt((normal * normal).sum(axis=0))
        here = z[1:-1, 1:-1]
        sides = (z[1:-1, 2:], z[1:-1, :-2], z[2:, 1:-1], z[:-2, 1:-1])
        smooth = (here > 0) & (length > 0)
        for side in sides:
            smooth &= (side > 0) & (np.abs(side - here) < _STEEP * here)
        normal /= np.maximum(length, 1e-300)
        eye = self.frame.camera_to_world[:3, 3]
        away = ((eye[:, None, None] - p[:, 1:-1, 1:-1]) * normal).sum(axis=0) < 0
        normal *= np.where(away, -1.0, 1.0)
        return np.ascontiguousarray(np.moveaxis(normal, 0, -1)), smooth

    def normals(self, most: int, labels: Sequence[int] | None = None) -> Points:
        """(n, 3) unit directions of the surfaces, towards the camera.

        Args:
            most: about so many, evenly over the picture; fewer than twice as many are all given.
            labels: only of these; None for the whole picture.
        """
        normal, smooth = self._surface
        if labels is not None:
            asked = np.zeros(len(self.categories) + 1, dtype=np.bool_)
            asked[list(labels)] = True
            smooth = smooth & asked.take(self.labels[1:-1, 1:-1])
        at = np.flatnonzero(smooth)
        found: Points = normal.reshape(-1, 3)[at[:: max(1, len(at) // most)]]
        return found

    def cells(self, label: int) -> Flags:
        """(h, w) where one mask has depth."""
        cells: Flags = (self.labels == label) & self.known
        return cells

    def lying(self, label: int, level: float) -> Points:
        """(n, 3) points of one mask where its surface lies level and is seen from above.

        Args:
            label: of the mask.
            level: least cosine of its direction to the vertical.
        """
        normal, smooth = self._surface
        mine = smooth & (self.labels[1:-1, 1:-1] == label) & (normal[..., 2] > level)
        found: Points = self.points_world_m[1:-1, 1:-1][mine]
        return found

    def covered(self, label: int, step: float) -> float:
        """Share of the outline of one mask that borders on something before it.

        Args:
            label: of the mask.
            step: how much nearer that is, as a share of the distance.
        """
        mask, z = self.labels == label, self.depth_m
        outline = hidden = 0
        for here, beside in _NEIGHBOURS:
            edge = mask[here] & ~mask[beside]
            both = edge & self.known[here] & self.known[beside]
            outline += int(edge.sum())
            hidden += int((both & (z[here] - z[beside] > step * z[here])).sum())
        return hidden / outline if outline else 0.0

    def cut(self, label: int) -> bool:
        """Whether a mask reaches the border of the picture."""
        mask = self.labels == label
        return bool(mask[0].any() or mask[-1].any() or mask[:, 0].any() or mask[:, -1].any())
