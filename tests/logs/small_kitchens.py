"""Kitchens that are drawn small, so that a run from pixels takes seconds; runs that are logged."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from forestall.assembly.configuration import run_config
from forestall.assembly.logs import logging_to
from forestall.assembly.make import prepare, run_episode
from forestall.domain.model import Domain
from forestall.types.episode import EpisodeRecord
from forestall.types.observation import Intrinsics
from forestall.types.scene import SceneNeeds
from forestall.types.world import Working
from forestall.worlds.kitchen.environment import KitchenEnvironment, KitchenOracle

CAMERA = Intrinsics.from_vertical_fov(256, 192, 60.0)


@dataclass(frozen=True, slots=True)
class OpenSmallKitchen:
    """Implements `OpenWorld`."""

    environment: KitchenEnvironment

    @property
    def oracle(self) -> KitchenOracle:
        return self.environment.oracle

    @property
    def disturbance(self) -> KitchenEnvironment:
        return self.environment


class SmallKitchens:
    """Implements `WorldPart`."""

    name = "small kitchens"

    @contextmanager
    def open(
        self, needs: SceneNeeds, domain: Domain, remember: bool = False
    ) -> Iterator[OpenSmallKitchen]:
        kitchen = KitchenEnvironment(needs, domain, intrinsics=CAMERA)
        try:
            yield OpenSmallKitchen(kitchen)
        finally:
            kitchen.close()

    def check(self) -> Sequence[Working]:
        return ()


def logged(
    folder: Path, kinds: Sequence[str], task: str, scenario: str | None = None, seed: int = 15
) -> tuple[EpisodeRecord, dict[str, Path]]:
    """A run without anybody who steps in, and where each of its logs is."""
    config = run_config(task, scenario, seed=seed, final_look=True, strategy="none")
    places = {kind: folder / f"{kind}-log" for kind in kinds}
    listeners = []
    opened = [logging_to(f"{kind}:{path}") for kind, path in places.items()]
    for one in opened:
        listeners += one.__enter__()
    record = run_episode(prepare(config), None, listeners, world=SmallKitchens())
    for one in opened:
        one.__exit__(None, None, None)
    return record, places
