"""Where frames are in the world: a tree of transforms over time. Called by `mcap_in`.

As tf2 does it: between two samples of a moving frame its place is interpolated linearly and its
turn on the sphere; before the first and after the last one it is where it was then.
"""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError
from forestall.types.observation import Pose

MOST_SAMPLES = 2_000_000
_NUMBERS = 7
_WORLDS = ("map", "world", "odom")


@dataclass(slots=True)
class _Link:
    """One frame under its parent: samples in the order of time, x y z and a quaternion."""

    parent: str
    stamps_ns: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))

    def at(self, stamp_ns: int) -> Pose:
        """(4, 4) of the frame in its parent."""
        after = bisect_right(self.stamps_ns, stamp_ns)
        one = self._sample(max(0, after - 1))
        two = self._sample(min(after, len(self.stamps_ns) - 1))
        first_ns = self.stamps_ns[max(0, after - 1)]
        last_ns = self.stamps_ns[min(after, len(self.stamps_ns) - 1)]
        share = 0.0
        if last_ns > first_ns:
            share = min(1.0, max(0.0, (stamp_ns - first_ns) / (last_ns - first_ns)))
        return _matrix(one[:3] + share * (two[:3] - one[:3]), _between(one[3:], two[3:], share))

    def sort(self) -> None:
        """Into the order of time."""
        order = np.argsort(np.frombuffer(self.stamps_ns, np.int64), kind="stable")
        if bool((np.diff(order) == 1).all()):
            return
        stamps = np.array(self.stamps_ns)[order]
        values = np.array(self.values).reshape(-1, _NUMBERS)[order]
        self.stamps_ns, self.values = array("q", stamps.tolist()), array("d", values.ravel())

    def _sample(self, index: int) -> npt.NDArray[np.float64]:
        return np.array(self.values[index * _NUMBERS : (index + 1) * _NUMBERS])


class Transforms:
    """The tree of a log."""

    def __init__(self) -> None:
        self._links: dict[str, _Link] = {}
        self._count = 0
        self._sorted = True

    def add(
        self,
        parent: str,
        child: str,
        stamp_ns: int,
        at_m: Iterable[float],
        turned: Iterable[float],
    ) -> None:
        """A sample: where a frame is in its parent, as x y z and a quaternion x y z w.

        Raises:
            InputError: numbers that are none, a frame with two parents, or too many samples.
        """
        child, parent = child.lstrip("/"), parent.lstrip("/")
        values = np.array([*at_m, *turned], np.float64)
        norm = float(np.linalg.norm(values[3:]))
        if not np.isfinite(values).all() or not 0.5 < norm < 2:
            raise InputError(f"the transform of {child!r} in {parent!r} is not one")
        values[3:] /= norm
        link = self._links.setdefault(child, _Link(parent))
        if link.parent != parent:
            raise InputError(f"frame {child!r} is in {link.parent!r} and in {parent!r}")
        self._count += 1
        if self._count > MOST_SAMPLES:
            raise InputError(f"more than {MOST_SAMPLES} transforms")
        self._sorted = self._sorted and (not link.stamps_ns or link.stamps_ns[-1] <= stamp_ns)
        link.stamps_ns.append(stamp_ns)
        link.values.extend(values.tolist())

    def world(self) -> str | None:
        """The frame that usually is the world, None where none of these is there."""
        known = {*self._links, *(link.parent for link in self._links.values())}
        return next((name for name in _WORLDS if name in known), None)

    def __contains__(self, frame: str) -> bool:
        return frame.lstrip("/") in self._links

    def pose(self, frame: str, world: str, stamp_ns: int) -> Pose:
        """(4, 4) of a frame in the world at a time.

        Raises:
            InputError: they are not connected.
        """
        if not self._sorted:
            for link in self._links.values():
                link.sort()
            self._sorted = True
        pose, at = np.eye(4), frame.lstrip("/")
        seen = [at]
        while at != world.lstrip("/"):
            found = self._links.get(at)
            if found is None or len(seen) > len(self._links):
                known = ", ".join(sorted({*self._links})[:12]) or "none"
                raise InputError(
                    f"frame {frame!r} is not under {world!r} but ends at {at!r}; frames with a "
                    f"parent: {known}"
                )
            pose = found.at(stamp_ns) @ pose
            at = found.parent
            seen.append(at)
        return pose


def _between(
    one: npt.NDArray[np.float64], two: npt.NDArray[np.float64], share: float
) -> npt.NDArray[np.float64]:
    """A share of the way from one unit quaternion to another, the shorter way round."""
    cosine = float(one @ two)
    if cosine < 0:
        two, cosine = -two, -cosine
    if share == 0 or cosine > 1 - 1e-12:
        return one
    angle = float(np.arccos(min(1.0, cosine)))
    mixed: npt.NDArray[np.float64] = (
        np.sin((1 - share) * angle) * one + np.sin(share * angle) * two
    ) / np.sin(angle)
    return mixed


def _matrix(at_m: npt.NDArray[np.float64], turned: npt.NDArray[np.float64]) -> Pose:
    from scipy.spatial.transform import Rotation

    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(turned).as_matrix()
    pose[:3, 3] = at_m
    return pose
