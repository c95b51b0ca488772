"""Where files live, and the frozen numbers that more than one layer needs."""

from __future__ import annotations

import os
from pathlib import Path

from forestall.errors import ForestallError

DEFAULT_DOMAIN = "household"
"""The domain of files and commands that name none."""

FRAME_WIDTH = 640
FRAME_HEIGHT = 480
VERTICAL_FOV_DEG = 60.0

DEMONSTRATION_SEEDS = 1_000_000
"""First seed of demonstration scenes; runs and experiments take seeds below."""

PICTURE_SEEDS = {
    "train": 2_000_000,
    "development": 3_000_000,
    "test": 4_000_000,
    "unseen": 5_000_000,
}
"""First seed of the encoder's pictures of each split; no run and no demonstration reaches them."""


def cache_dir() -> Path:
    """The folder for what can be made again (FORESTALL_CACHE overrides it).

    Raises:
        ForestallError: this user has no home folder.
    """
    override = os.environ.get("FORESTALL_CACHE")
    if override:
        return Path(override)
    from platformdirs import user_cache_path

    try:
        path = user_cache_path("forestall", appauthor=False)
    except RuntimeError:  # so say some versions
        path = Path()
    if not path.is_absolute():
        raise ForestallError("there is no home folder for the cache: set FORESTALL_CACHE to one")
    return path
