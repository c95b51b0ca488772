"""An environment around another: whatever is not changed is passed on.

What lies around a world (a sensor, faults, its edge) inherits from it and overrides what differs.
"""

from __future__ import annotations

from collections.abc import Sequence

from forestall.seams.acting import Environment, Vantages
from forestall.types.episode import SkillOutcome
from forestall.types.observation import Observation, Vec3
from forestall.types.plan import Subtask


class Around:
    """Implements `Environment` and `Vantages` by another one.

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

    def vantages(self, point: Vec3) -> Sequence[Vec3]:
        """See `Vantages`; nowhere where the other one has none."""
        return self._inner.vantages(point) if isinstance(self._inner, Vantages) else ()

    def look_from(self, place: Vec3, point: Vec3) -> float:
        """See `Vantages`."""
        return self._inner.look_from(place, point) if isinstance(self._inner, Vantages) else 0.0

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
