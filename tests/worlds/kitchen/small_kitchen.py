"""A flat kitchen written down in a few words, and a robot to command in it."""

from collections.abc import Mapping, Sequence

from forestall.domain.load import shipped
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.facts import category_of
from forestall.types.observation import Intrinsics
from forestall.types.plan import Subtask
from forestall.types.scene import SceneNeeds
from forestall.worlds.kitchen.effects import EffectConfig
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.flat_world import FlatInstance, FlatRenderer, FlatScene, FlatWorld
from forestall.worlds.kitchen.imperfection import Rates
from forestall.worlds.kitchen.law import Way

CONTAINING = shipped("household").containing
FIXTURES = {
    "CounterTop": 2, "DiningTable": 1, "Sink": 1, "Faucet": 1, "Fridge": 1, "Microwave": 1,
    "CoffeeMachine": 1, "Toaster": 1, "StoveBurner": 2, "StoveKnob": 2, "Cabinet": 1,
    "TVStand": 1, "Television": 1, "FloorLamp": 1, "Floor": 1,
}  # fmt: skip
PREPARED = {
    "PotatoSliced": 3, "TomatoSliced": 3, "LettuceSliced": 3, "AppleSliced": 3, "BreadSliced": 3,
    "EggCracked": 2,
}  # fmt: skip


class SmallKitchen:
    """`things` read "Mug-1@CounterTop-1 dirty=dirty"; fixtures only state what differs."""

    def __init__(
        self,
        *things: str,
        blocked: Mapping[str, str] | None = None,
        spots: Mapping[str, int] | None = None,
        crowded: tuple[str, ...] = (),
        cool_down_s: float = 300.0,
        rates: Rates | None = None,
        ways: Sequence[Way] = (),
        seed: int = 0,
    ) -> None:
        written = [self._parse(t) for t in things]
        names = {i.name for i in written}
        fixtures = [
            FlatInstance(f"{c}-{k}", c)
            for c, count in FIXTURES.items()
            for k in range(1, count + 1)
            if f"{c}-{k}" not in names
        ]
        prepared = [
            FlatInstance(f"{c}-{k}", c, prepared=True)
            for c, count in PREPARED.items()
            for k in range(1, count + 1)
            if f"{c}-{k}" not in names
        ]
        scene = FlatScene(
            (*fixtures, *written, *prepared), blocked or {}, spots or {}, frozenset(crowded)
        )
        self.world = FlatWorld(scene)
        self.env = KitchenEnvironment(
            SceneNeeds(),
            shipped("household"),
            intrinsics=Intrinsics.from_vertical_fov(64, 48, 60.0),
            effect_config=EffectConfig(cool_down_s=cool_down_s),
            build=lambda needs, seed, catalogue: self.world,
            make=lambda world, intrinsics: FlatRenderer(intrinsics),
            rates=rates,
            ways=ways,
        )
        self.env.reset(seed)

    @staticmethod
    def _parse(text: str) -> FlatInstance:
        head, *pairs = text.split()
        name, _, parent = head.partition("@")
        states = tuple((a, v) for a, _, v in (p.partition("=") for p in pairs))
        return FlatInstance(name, category_of(name), parent or None, states)

    def do(self, *steps: str) -> SkillOutcome:
        """Run steps that must all succeed; the last outcome."""
        for step in steps:
            outcome = self.env.execute(Subtask.parse(step))
            assert outcome.status is SkillStatus.SUCCEEDED, f"{step}: {outcome.reason}"
        return outcome

    def tried(self, step: str) -> SkillOutcome:
        """Run one step, however it ends."""
        return self.env.execute(Subtask.parse(step))

    def refused(self, step: str) -> str:
        """Run a step that must be refused without any change of the truth; its reason."""
        before = self.env.oracle.truth().text(), self.env.oracle.history()
        outcome = self.env.execute(Subtask.parse(step))
        assert outcome.status is SkillStatus.REFUSED, step
        assert (self.env.oracle.truth().text(), self.env.oracle.history()) == before
        return outcome.reason

    def state(self, name: str, attribute: str) -> str | None:
        return self.env.oracle.states(name).get(attribute)

    def parent(self, name: str) -> str | None:
        return next(iter(self.env.oracle.truth().parents(name, CONTAINING)), None)

    def told(self, kind: str) -> list[str]:
        """The words of every event of a kind."""
        return [e.text for e in self.env.oracle.events() if e.kind == kind]

    @property
    def held(self) -> str | None:
        return next(iter(self.env.oracle.truth().in_hands(("gripper",))), None)

    @property
    def spoiled(self) -> set[str]:
        return {x.args[0] for x in self.env.oracle.history() if x.predicate == "spoiled"}

    def kinds(self) -> list[str]:
        return [e.kind for e in self.env.oracle.events()]
