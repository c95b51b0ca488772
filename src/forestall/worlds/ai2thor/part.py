"""AI2-THOR as the world part of a run (`seams.WorldPart`).

Built by `assembly`; makes worlds over the package `ai2thor`, which is an extra.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from forestall.domain.model import Domain
from forestall.errors import InputError
from forestall.types.scene import SceneNeeds
from forestall.types.world import Working
from forestall.worlds.ai2thor.link import Build, Server, load_package
from forestall.worlds.ai2thor.rooms import checked_scene
from forestall.worlds.ai2thor.world import ThorOracle, ThorWorld


@dataclass(frozen=True, slots=True)
class OpenThor:
    """Implements `OpenWorld`."""

    environment: ThorWorld
    shares_names: bool = True

    @property
    def oracle(self) -> ThorOracle:
        """The truth of the scene."""
        return self.environment.oracle

    @property
    def disturbance(self) -> ThorWorld:
        """The scene itself."""
        return self.environment


class Thor:
    """Implements `WorldPart`.

    Args:
        scene: "FloorPlan1" and so on; where nothing is said the seed draws one that has what the
            task needs.
        executable: a build on this machine; the package downloads its own where nothing is said.
        display: X display of the build; what the environment says where nothing is said.
        server: how the package talks with the build, "fifo" or "wsgi".
        width: of a picture, in pixels.
        height: of a picture, in pixels.
        fov_deg: vertical field of view.
        start_s: how long the build may take to start.
        answer_s: how long one action may take.

    Raises:
        InputError: a size, an angle or a time that cannot be; a name that is no scene's.
    """

    name = "ai2thor"

    def __init__(
        self,
        scene: str = "",
        executable: str = "",
        display: str = "",
        server: Server = Server.FIFO,
        width: int = 640,
        height: int = 480,
        fov_deg: float = 60.0,
        start_s: float = 300.0,
        answer_s: float = 60.0,
    ) -> None:
        if min(width, height) < 64 or not 10 <= fov_deg <= 150 or min(start_s, answer_s) <= 0:
            raise InputError(
                f"ai2thor: pictures of {width} by {height} pixels with {fov_deg:g}°, limits of "
                f"{start_s:g} s and {answer_s:g} s: 64 pixels, 10 to 150°, times above 0 are needed"
            )
        self._scene = checked_scene(scene)
        self._build = Build(
            Path(executable) if executable else None,
            display or None,
            server,
            width,
            height,
            fov_deg,
            start_s,
            answer_s,
        )

    @contextmanager
    def open(self, needs: SceneNeeds, domain: Domain, remember: bool = False) -> Iterator[OpenThor]:
        """See the Protocol; a build draws too fast for anything to be remembered."""
        world = ThorWorld(self._build, needs, domain, self._scene)
        try:
            yield OpenThor(world)
        finally:
            world.close()

    def check(self) -> Sequence[Working]:
        """The package is needed; whether a build starts shows when one is started."""
        try:
            load_package()
        except InputError as error:
            return (
                Working(
                    "the package ai2thor",
                    False,
                    True,
                    str(error),
                    "pip install 'forestall[ai2thor]'",
                ),
            )
        return (Working("the package ai2thor", True, True, "installed"),)
