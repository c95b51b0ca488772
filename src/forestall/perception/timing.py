"""How long perception takes for one observation; called by the speed benchmark."""

from __future__ import annotations

import time

from forestall.seams.perceiving import Perceiver
from forestall.types.observation import Observation


def perception_times(perceiver: Perceiver, observation: Observation, n: int) -> list[float]:
    """Seconds of n perceptions of the same observation, each fused into what was there."""
    perceiver.reset()
    perceiver.perceive(observation)
    times = []
    for _ in range(n):
        start = time.perf_counter()
        perceiver.perceive(observation)
        times.append(time.perf_counter() - start)
    return times
