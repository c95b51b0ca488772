from collections.abc import Sequence
from typing import Any

import numpy as np

from forestall.domain.load import shipped
from forestall.perception.given_graph import GraphPassthrough
from forestall.testing.conformance import check_environment
from forestall.testing.levels import Level, Tolerance
from forestall.testing.symbolic_world import SymbolicWorld
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


class _Noisy(_Broken):
    """Repeats to within a centimetre and a shade of colour."""

    def __init__(self, far_m: float = 0.005) -> None:
        super().__init__()
        self._rng, self._far_m = np.random.default_rng(0), far_m

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        seen = self._inner.observe(focus)
        frame = seen.frames[0]
        off = self._rng.uniform(0, self._far_m, frame.depth_m.shape).astype(np.float32)
        frame.depth_m[:] = np.where(frame.depth_m > 0, frame.depth_m + off, 0.0)
        frame.rgb[:] = frame.rgb // 2 * 2 + self._rng.integers(0, 2, frame.rgb.shape)
        return seen


def test_what_nearly_repeats_conforms_at_its_level_and_no_other() -> None:
    exact = check_environment(_Noisy, 3, STEPS, HOUSEHOLD)
    assert any("depth_m differs" in c for c in exact) and any("rgb differs" in c for c in exact)
    assert check_environment(_Noisy, 3, STEPS, HOUSEHOLD, Level.TOLERANCE) == []
    fine = Tolerance(length_m=0.001)
    found = check_environment(_Noisy, 3, STEPS, HOUSEHOLD, Level.TOLERANCE, fine)
    assert any("depth_m differs" in c for c in found)


def test_hardware_repeats_nothing_and_is_asked_for_nothing_without_sense() -> None:
    asked: list[Subtask] = []
    made = iter(range(100))

    class Robot(_Broken):
        def reset(self, seed: int) -> None:
            self._inner.reset(seed + next(made))

        def execute(self, subtask: Subtask) -> SkillOutcome:
            asked.append(subtask)
            outcome: SkillOutcome = self._inner.execute(subtask)
            return outcome

    assert check_environment(Robot, 3, STEPS, HOUSEHOLD, Level.HARDWARE) == []
    assert set(asked) <= set(STEPS)

    class Deaf(_Broken):
        def hold(self) -> None:
            pass

    found = check_environment(Deaf, 3, STEPS, HOUSEHOLD, Level.HARDWARE)
    assert any("is not refused with a reason" in c for c in found)


def test_what_is_done_and_not_seen_is_found() -> None:
    needs = SceneNeeds(objects=(ObjectNeed("Mug-1", "Mug", ("CounterTop",)),))
    steps = [Subtask.parse(s) for s in ("pick_up(Mug)", "put_in(Mug, Sink)", "toggle_on(Faucet)")]

    class Boasting(SymbolicWorld):
        def execute(self, subtask: Subtask) -> SkillOutcome:
            if subtask.skill != "put_in":
                return super().execute(subtask)
            return SkillOutcome(SkillStatus.SUCCEEDED, 0.0)

    def found(kind: type[SymbolicWorld]) -> list[str]:
        perceiver = GraphPassthrough(HOUSEHOLD)
        return check_environment(
            lambda: kind(HOUSEHOLD, needs), 3, steps, HOUSEHOLD, perceiver=perceiver
        )

    assert found(SymbolicWorld) == []
    boasted = [c for c in found(Boasting) if c.startswith("after put_in(Mug, Sink) perception")]
    assert boasted[0].endswith("sees otherwise: inside(Mug-1, Sink-1)")
