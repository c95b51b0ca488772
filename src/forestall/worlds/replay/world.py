"""A recorded run as an environment: it answers `observe`, and refuses to act.

Called by `assembly.replaying`, which moves it on from look to look; knows no log, only its looks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from forestall.errors import InputError
from forestall.types.episode import SkillOutcome
from forestall.types.observation import Observation, Vec3
from forestall.types.plan import Subtask
from forestall.types.recorded import Look


class ReplayWorld:
    """Implements `Environment`: what was seen once is what is seen.

    Args:
        name: of the run, for errors.
        looks: opens the run anew and gives its looks one after the other.
    """

    def __init__(self, name: str, looks: Callable[[], Iterator[Look]]) -> None:
        self._name, self._looks = name, looks
        self._following: Iterator[Look] = iter(())
        self._now: Look | None = None
        self._next: Look | None = None

    def reset(self, seed: int) -> None:
        """To the first look; a recording has no seeds, and any is the same.

        Raises:
            InputError: nothing was seen in the run.
        """
        self._following = self._looks()
        self._now = next(self._following, None)
        if self._now is None or self._now.observation is None:
            raise InputError(f"{self._name}: nothing was recorded of what was seen")
        self._next = next(self._following, None)

    def follow(self) -> bool:
        """To the next look; False where there is none."""
        if self._next is None or self._next.observation is None:
            return False
        self._now, self._next = self._next, next(self._following, None)
        return True

    @property
    def next(self) -> Look | None:
        """The next look, which says what was carried out until then; None at the end."""
        return self._next

    def scan(self, thorough: bool = False) -> Observation:
        """What was seen: nobody can look around any more."""
        return self.observe()

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """What was seen, wherever one wants to look.

        Raises:
            InputError: the run was not begun.
        """
        if self._now is None or self._now.observation is None:
            raise InputError(f"{self._name} was not begun: call reset first")
        return self._now.observation

    def approach(self, name: str) -> float:
        """Nobody drives in a recording.

        Raises:
            InputError: always.
        """
        raise self._refusal(f"drive to {name}")

    def execute(self, subtask: Subtask) -> SkillOutcome:
        """Nobody acts in a recording.

        Raises:
            InputError: always.
        """
        raise self._refusal(str(subtask))

    def hold(self) -> None:
        """Nothing moves."""

    @property
    def time_s(self) -> float:
        """When the present look was."""
        return self.observe().time_s

    def close(self) -> None:
        """Nothing is held."""
        self._following, self._now, self._next = iter(()), None, None

    def _refusal(self, what: str) -> InputError:
        return InputError(
            f"{self._name} is a recording, in which nothing can be done ({what}): 'forestall "
            "replay' lets a monitor judge it step by step"
        )
