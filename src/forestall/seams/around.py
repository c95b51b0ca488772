"""An environment around another: whatever is not changed is passed on.

What lies around a world (a sensor, faults, its edge) inherits from it and overrides what differs.
"""

from __future__ import annotations

from collections.abc import Sequence

from forestall.seams.acting import Environment
from forestall.types.episode import SkillOutcome
from forestall.types.observation import Observation, Vec3
from forestall.types.plan import Subtask


class Around:
    """Implements `Environment` by another one.

    Args:
        environment: to which every call is passed on.
    """

    def __init__(self, environment: Environment) -> None:
        self._inner = environment

    def reset(self, seed: int) -> None:
        """See `Environment`."""
        self._inner.reset(seed)

    def scan(self, thorough: bool = False) -> Observation:
        """See `Environment`."""
        return self._inner.scan(thorough)

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """See `Environment`."""
        return self._inner.observe(focus)

    def approach(self, name: str) -> float:
        """See `Environment`."""
        return self._inner.approach(name)

    def execute(self, subtask: Subtask) -> SkillOutcome:
        """See `Environment`."""
        return self._inner.execute(subtask)

    def hold(self) -> None:
        """See `Environment`."""
        self._inner.hold()

    @property
    def time_s(self) -> float:
        """See `Environment`."""
        return self._inner.time_s

    def close(self) -> None:
        """See `Environment`."""
        self._inner.close()
