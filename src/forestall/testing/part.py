"""Symbolic worlds as the world part of a run (`seams.WorldPart`), for every domain.

Built by `assembly`; calls `symbolic_world`. Its observations are scene graphs: the perceiver that
goes with it is "given-graph".
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from forestall.domain.model import Domain
from forestall.testing.symbolic_world import SymbolicWorld
from forestall.types.scene import SceneNeeds
from forestall.types.world import Working


@dataclass(frozen=True, slots=True)
class OpenSymbolicWorld:
    """Implements `OpenWorld`: one object is seen from all three sides."""

    environment: SymbolicWorld

    @property
    def oracle(self) -> SymbolicWorld:
        """The truth."""
        return self.environment

    @property
    def disturbance(self) -> SymbolicWorld:
        """What can let fall what the robot holds."""
        return self.environment


class SymbolicWorlds:
    """Implements `WorldPart`."""

    name = "symbolic"

    @contextmanager
    def open(
        self, needs: SceneNeeds, domain: Domain, remember: bool = False
    ) -> Iterator[OpenSymbolicWorld]:
        """See the Protocol; there is nothing to remember."""
        yield OpenSymbolicWorld(SymbolicWorld(domain, needs))

    def check(self) -> Sequence[Working]:
        """It needs nothing of the machine."""
        return ()
