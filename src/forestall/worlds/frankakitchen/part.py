"""FrankaKitchen as the world part of a run (`seams.WorldPart`).

Built by `assembly`; finds the assets and makes kitchens.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from forestall.domain.model import Domain
from forestall.errors import InputError
from forestall.types.scene import SceneNeeds
from forestall.types.world import Working
from forestall.worlds.frankakitchen.assets import INSTALL, model_file
from forestall.worlds.frankakitchen.world import FrankaKitchen


@dataclass(frozen=True, slots=True)
class OpenFrankaKitchen:
    """Implements `OpenWorld`: one object is seen from all three sides."""

    environment: FrankaKitchen

    @property
    def oracle(self) -> FrankaKitchen:
        """The truth."""
        return self.environment

    @property
    def disturbance(self) -> FrankaKitchen:
        """The kitchen itself."""
        return self.environment


class FrankaKitchens:
    """Implements `WorldPart`.

    Args:
        assets: folder of the assets; "" for those of an installed gymnasium-robotics.
    """

    name = "frankakitchen"

    def __init__(self, assets: str = "") -> None:
        self._assets = assets

    @contextmanager
    def open(
        self, needs: SceneNeeds, domain: Domain, remember: bool = False
    ) -> Iterator[OpenFrankaKitchen]:
        """See the Protocol; nothing is drawn that could be remembered."""
        yield OpenFrankaKitchen(FrankaKitchen(model_file(self._assets), needs))

    def check(self) -> Sequence[Working]:
        """Its assets."""
        try:
            return (Working("assets", True, True, str(model_file(self._assets))),)
        except InputError as error:
            return (Working("assets", False, True, str(error), INSTALL),)
