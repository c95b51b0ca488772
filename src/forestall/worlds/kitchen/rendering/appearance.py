"""How the geoms of a scene look and which instance each belongs to; imports no simulator.

The scene builder fills it in, the renderers read it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError

TEXTURES = ("wood", "tiles", "stone", "plaster", "metal", "fabric", "food", "ceramic")
"""Every procedural texture that a geom may carry."""


@dataclass(frozen=True, eq=False)
class Appearance:
    """Per-geom appearance of one compiled model.

    Attributes:
        instance_names: names of the instances, indexed by instance id.
        geom_instance: (ngeom,) int32, the instance id of each geom, -1 for none.
        texture: one of TEXTURES or None for each geom.
    """

    instance_names: tuple[str, ...]
    geom_instance: npt.NDArray[np.int32]
    texture: tuple[str | None, ...]

    def __post_init__(self) -> None:
        count = len(self.texture)
        if self.geom_instance.shape != (count,):
            raise InputError(
                f"geom_instance has shape {self.geom_instance.shape}, texture has {count} entries"
            )
        unknown = sorted({name for name in self.texture if name is not None} - set(TEXTURES))
        if unknown:
            raise InputError(f"unknown texture {unknown[0]!r}: known: {', '.join(TEXTURES)}")
        if count and int(self.geom_instance.max()) >= len(self.instance_names):
            raise InputError("geom_instance names an instance beyond instance_names")
