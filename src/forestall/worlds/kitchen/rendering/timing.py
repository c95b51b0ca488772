"""Times frames, for `forestall bench speed`."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.seams.acting import Renderer


def frame_times(
    renderer: Renderer, data: Any, pose: npt.NDArray[np.float64], n: int
) -> list[float]:
    """Seconds for each of `n` frames from one pose, after one frame that is not counted."""
    renderer.render(data, pose)
    times = []
    for _ in range(n):
        start = time.perf_counter()
        renderer.render(data, pose)
        times.append(time.perf_counter() - start)
    return times
