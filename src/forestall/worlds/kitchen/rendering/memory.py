"""The memory of drawn frames; imports no simulator. `remembered` keys and fills it."""

from __future__ import annotations

from collections import OrderedDict

from forestall.types.observation import Frame


class FrameMemory:
    """The frames drawn last, up to a number of bytes; one for each process.

    Args:
        most_bytes: of pictures, depths and ids together.
    """

    def __init__(self, most_bytes: int = 600_000_000) -> None:
        self._most = most_bytes
        self._bytes = 0
        self._frames: OrderedDict[bytes, Frame] = OrderedDict()
        self.hits = 0
        self.misses = 0

    def get(self, key: bytes) -> Frame | None:
        """The frame of a key, None when it is not remembered."""
        frame = self._frames.get(key)
        if frame is None:
            self.misses += 1
            return None
        self.hits += 1
        self._frames.move_to_end(key)
        return frame

    def keep(self, key: bytes, frame: Frame) -> None:
        """Remember a frame, forgetting those that were not asked for the longest time."""
        self._frames[key] = frame
        self._bytes += _size(frame)
        while self._bytes > self._most and len(self._frames) > 1:
            self._bytes -= _size(self._frames.popitem(last=False)[1])


def _size(frame: Frame) -> int:
    ids = 0 if frame.instance_ids is None else frame.instance_ids.nbytes
    return frame.rgb.nbytes + frame.depth_m.nbytes + ids
