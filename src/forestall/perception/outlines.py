"""Masks of boxes by depth alone, where no model outlines things. Called by `finder.py`."""

from __future__ import annotations

from collections.abc import Sequence

from forestall.perception.boxes import box_mask
from forestall.types.grounding import Corners
from forestall.types.observation import Frame, Mask


class DepthOutliner:
    """What in a box lies as far away as its middle (implements `Outliner`); see `boxes.py`."""

    name = "depth"
    exact = False

    def outline(self, frame: Frame, boxes: Sequence[Corners]) -> list[Mask]:
        """See the Protocol; without depth a mask is the whole box."""
        depth = None if frame.colour_only else frame.depth_m
        shape = (frame.intrinsics.height, frame.intrinsics.width)
        return [box_mask(box, shape, depth, frame.intrinsics) for box in boxes]
