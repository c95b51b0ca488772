"""Renderers of the embedded household: RGB, metric z-depth and instance ids.

`make_renderer` is all that others need. Two ray casters (`embree`, `rays`) share one picture
(`picture` → `lighting`, `shading`, `textures`); `gl` wraps MuJoCo's own renderer.
"""

from forestall.worlds.kitchen.rendering.appearance import TEXTURES, Appearance
from forestall.worlds.kitchen.rendering.factory import RENDERERS, make_remembering, make_renderer
from forestall.worlds.kitchen.rendering.memory import FrameMemory

__all__ = [
    "RENDERERS",
    "TEXTURES",
    "Appearance",
    "FrameMemory",
    "make_remembering",
    "make_renderer",
]
