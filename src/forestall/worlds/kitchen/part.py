"""The embedded household as the world part of a run (`seams.WorldPart`).

Built by `assembly`; makes kitchens, and remembers what was drawn where many runs follow.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.extras import need
from forestall.types.scene import SceneNeeds
from forestall.types.world import Working
from forestall.worlds.kitchen.catalogue import lacking
from forestall.worlds.kitchen.imperfection import Rates
from forestall.worlds.kitchen.ithor import draws
from forestall.worlds.kitchen.law import WAYS
from forestall.worlds.kitchen.rendering import RENDERERS, FrameMemory

if TYPE_CHECKING:
    from forestall.worlds.kitchen.environment import KitchenEnvironment, KitchenOracle


@dataclass(frozen=True, slots=True)
class OpenKitchen:
    """Implements `OpenWorld`."""

    environment: KitchenEnvironment
    shares_names: bool = True

    @property
    def oracle(self) -> KitchenOracle:
        """The truth of the kitchen."""
        return self.environment.oracle

    @property
    def disturbance(self) -> KitchenEnvironment:
        """The kitchen itself: it can let fall what the robot holds."""
        return self.environment


class Profile(Enum):
    """How kind the household is."""

    KIND = "kind"
    HONEST = "honest"


class LawOption(Enum):
    """Whether the household differs from what the domain file says."""

    PROFILE = "profile"
    KNOWN = "known"
    DRAWN = "drawn"


class Rooms(Enum):
    """Which generator draws the rooms."""

    OWN = "own"
    ITHOR = "ithor"


class NamesOption(Enum):
    """Whether perception is given the simulator's names of things."""

    PROFILE = "profile"
    SHARED = "shared"
    OWN = "own"


class Kitchens:
    """Implements `WorldPart`.

    Args:
        renderer: "auto", "embree", "rays" or "gl".
        profile: "kind": every skill does what was meant, and the household is as its domain file
            says; "honest": skills go wrong now and then, and the household differs in drawn ways.
        law: whether the household differs from the domain file: "known" (never), "drawn", or as
            the profile has it.
        rates: how often skills go wrong, for the profile "honest".
        rooms: "own" (drawn from the seed), or "ithor" (after seven rooms of AI2-THOR).
        names: whose names the robot has of things: "shared" with the simulator, its "own", or as
            the profile has it: shared in the kind one, its own in the honest one.
        roves: whether the robot goes where it sees more, where something has to be looked at again.

    Raises:
        UnknownNameError: no such renderer.
        InputError: rates for a profile in which nothing goes wrong, or MuJoCo is not installed.
    """

    name = "kitchen"

    def __init__(
        self,
        renderer: str = "auto",
        profile: Profile = Profile.KIND,
        law: LawOption = LawOption.PROFILE,
        rates: Rates | None = None,
        rooms: Rooms = Rooms.OWN,
        names: NamesOption = NamesOption.PROFILE,
        roves: bool = False,
    ) -> None:
        need(f"the world {self.name}", "kitchen", "mujoco")
        if renderer not in RENDERERS:
            raise UnknownNameError("renderer", renderer, RENDERERS)
        honest = profile is Profile.HONEST
        if rates is not None and not honest:
            raise InputError("rates of failing skills belong to the profile honest")
        self._renderer = renderer
        self._rates = (rates or Rates()) if honest else None
        drawn = honest if law is LawOption.PROFILE else law is LawOption.DRAWN
        self._ways = WAYS if drawn else ()
        self._draws = draws() if rooms is Rooms.ITHOR else None
        own = honest if names is NamesOption.PROFILE else names is NamesOption.OWN
        self._shares_names = not own
        self._roves = roves
        self._frames = FrameMemory()

    @staticmethod
    def simulates(domain: Domain) -> bool:
        """Whether the kitchen's things can be told in the words of a domain."""
        return not lacking(domain)

    @contextmanager
    def open(
        self, needs: SceneNeeds, domain: Domain, remember: bool = False
    ) -> Iterator[OpenKitchen]:
        """See the Protocol.

        Raises:
            InputError: a domain that it does not simulate.
        """
        from forestall.worlds.kitchen.environment import KitchenEnvironment

        frames = self._frames if remember else None
        kitchen = KitchenEnvironment(
            needs,
            domain,
            self._renderer,
            frames=frames,
            rates=self._rates,
            ways=self._ways,
            draws=self._draws,
            roves=self._roves,
        )
        try:
            yield OpenKitchen(kitchen, self._shares_names)
        finally:
            kitchen.close()

    def check(self) -> Sequence[Working]:
        """A picture without a graphics library is needed; one renderer suffices."""
        from forestall.worlds.kitchen.rendering.probe import probe_renderers

        probes = {p.name: p for p in probe_renderers()}
        working = [p for n, p in probes.items() if n != "gl" and p.works]
        picture = Working(
            "picture without a graphics library",
            bool(working),
            True,
            ", ".join(f"{p.name} ({p.detail})" for p in working) or "no software renderer works",
            "pip install --force-reinstall embreex mujoco-core",
        )
        single = [
            Working(f"renderer {p.name}", p.works, False, p.detail, p.hint)
            for p in (probes[n] for n in ("embree", "rays", "gl") if n in probes)
        ]
        return (picture, *single)
