"""The memory of drawn frames; imports no simulator. `remembered` and `redrawing` fill it."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Iterator

from forestall.worlds.kitchen.rendering.drawn import Drawn

LEAST_BYTES, MOST_BYTES = 600_000_000, 2_500_000_000
"""Of remembered frames: about 110 and 460 of them."""

SHARE = 0.1
"""Of the machine's memory between these: several processes remember at once."""


def share_of_memory() -> int:
    """Bytes of frames that a process may remember on this machine."""
    try:
        there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):  # a system that does not tell
        return LEAST_BYTES
    return min(max(int(SHARE * there), LEAST_BYTES), MOST_BYTES)


class FrameMemory:
    """The frames drawn last, up to a number of bytes; one for each process.

    Args:
        most_bytes: of pictures, depths, ids and what they were made from together; a share of the
            machine's memory by default.
    """

    def __init__(self, most_bytes: int | None = None) -> None:
        self._most = share_of_memory() if most_bytes is None else most_bytes
        self._bytes = 0
        self._frames: OrderedDict[bytes, tuple[Drawn, bytes]] = OrderedDict()
        self._places: dict[bytes, list[bytes]] = {}
        self.hits = 0
        self.misses = 0

    def get(self, key: bytes) -> Drawn | None:
        """The frame of a key, None when it is not remembered."""
        found = self._frames.get(key)
        if found is None:
            self.misses += 1
            return None
        self.hits += 1
        self._frames.move_to_end(key)
        return found[0]

    def near(self, place: bytes) -> Iterator[Drawn]:
        """The frames of the same place, the latest first."""
        return (self._frames[key][0] for key in reversed(self._places.get(place, ())))

    def keep(self, key: bytes, drawn: Drawn, place: bytes = b"") -> Drawn:
        """Remember a frame, forgetting those that were not asked for the longest time.

        Args:
            key: of all that the frame shows.
            drawn: the frame.
            place: of the camera and the lights alone.

        Returns:
            The frame as it is kept: the one to use, so that the given one is not held, too.
        """
        drawn = drawn.packed()
        self._frames[key] = drawn, place
        if place:
            self._places.setdefault(place, []).append(key)
        self._bytes += drawn.nbytes
        while self._bytes > self._most and len(self._frames) > 1:
            old, (forgotten, there) = self._frames.popitem(last=False)
            self._bytes -= forgotten.nbytes
            if there:
                self._places[there].remove(old)
                if not self._places[there]:
                    del self._places[there]
        return drawn
