from collections.abc import Sequence
from typing import Any

import numpy as np

from forestall.domain.load import shipped
from forestall.testing.conformance import check_environment
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.observation import Observation, Vec3
from forestall.types.plan import Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.flat_world import flat_environment

HOUSEHOLD = shipped("household")
STEPS = [Subtask.parse(s) for s in ("pick_up(Mug)", "put_in(Mug, Sink)", "pick_up(Pot)")]


def _make() -> KitchenEnvironment:
    return flat_environment(SceneNeeds(objects=(ObjectNeed("Mug-1", "Mug"),)), shipped("household"))


class _Broken:
    """Hands everything on to a good environment, and does one thing wrong."""

    def __init__(self) -> None:
        self._inner = _make()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)


def test_the_household_conforms() -> None:
    assert check_environment(_make, 3, STEPS, HOUSEHOLD) == []


def test_a_seed_that_does_not_repeat_is_found() -> None:
    count = iter(range(100))

    class Drifting(_Broken):
        def reset(self, seed: int) -> None:
            self._inner.reset(seed + next(count))

    complaints = check_environment(Drifting, 0, STEPS, HOUSEHOLD)
    assert any("with seed 0" in c for c in complaints)


def test_a_picture_that_does_not_repeat_is_found() -> None:
    rng = np.random.default_rng(0)

    class Noisy(_Broken):
        def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
            observation = self._inner.observe(focus)
            observation.frames[0].rgb[0, 0, 0] = rng.integers(256)
            return observation

    assert any("rgb differs" in c for c in check_environment(Noisy, 0, STEPS, HOUSEHOLD))


def test_an_exception_on_an_unknown_name_is_found() -> None:
    class Raising(_Broken):
        def execute(self, subtask: Subtask) -> SkillOutcome:
            if "NoSuchThing" in subtask.args:
                raise KeyError(subtask.args[0])
            return self._inner.execute(subtask)

    assert any("raises KeyError" in c for c in check_environment(Raising, 0, STEPS, HOUSEHOLD))


def test_nonsense_that_succeeds_is_found() -> None:
    class Agreeable(_Broken):
        def execute(self, subtask: Subtask) -> SkillOutcome:
            return SkillOutcome(SkillStatus.SUCCEEDED, 0.0)

    assert any("must be refused" in c for c in check_environment(Agreeable, 0, STEPS, HOUSEHOLD))


def test_a_duration_that_did_not_pass_is_found() -> None:
    class Boasting(_Broken):
        def execute(self, subtask: Subtask) -> SkillOutcome:
            outcome = self._inner.execute(subtask)
            return SkillOutcome(outcome.status, outcome.duration_s + 1.0, outcome.reason)

    assert any("reports" in c for c in check_environment(Boasting, 0, STEPS, HOUSEHOLD))


def test_a_refusal_without_a_reason_is_found() -> None:
    class Silent(_Broken):
        def execute(self, subtask: Subtask) -> SkillOutcome:
            outcome = self._inner.execute(subtask)
            return SkillOutcome(outcome.status, outcome.duration_s)

    assert any("without a reason" in c for c in check_environment(Silent, 0, STEPS, HOUSEHOLD))


def test_an_arm_that_lets_go_or_goes_on_after_hold_is_found() -> None:
    class LettingGo(_Broken):
        def hold(self) -> None:
            self._inner.drop_held()
            self._inner.hold()

    class Deaf(_Broken):
        def hold(self) -> None:
            pass

    class Failing(_Broken):
        def hold(self) -> None:
            raise RuntimeError("no brake")

    found = check_environment(LettingGo, 3, STEPS, HOUSEHOLD)
    assert "hold lets go of Mug-1" in found
    deaf = check_environment(Deaf, 3, STEPS, HOUSEHOLD)
    assert any("is not refused with a reason" in c for c in deaf)
    assert any("after hold the robot" in c for c in deaf)
    assert any("hold raises" in c for c in check_environment(Failing, 3, STEPS, HOUSEHOLD))
