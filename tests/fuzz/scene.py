"""One small scene of the household, drawn by the analytic ray caster, and who judges it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from forestall.domain.load import shipped
from forestall.domain.model import Domain
from forestall.memory.store import SqliteStore
from forestall.monitor import Monitor
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import GivenMasks, InstanceSegmenter
from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.observation import Intrinsics, Observation
from forestall.types.plan import Plan, Subtask
from perception.synthetic import Solid, at, looking, observed

ROWS, COLUMNS = 90, 120
CAMERA = Intrinsics.from_vertical_fov(COLUMNS, ROWS, 60.0)
EYE = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
GRASP = Subtask.parse("pick_up(Plate)")
ARGUMENT = "Plate-1"


def observation(shift: float = 0.0) -> Observation:
    """A counter with a plate among other things."""
    things: dict[str, tuple[float, float, tuple[float, float, float]]] = {
        ARGUMENT: (0.1, 0.3, (0.22, 0.22, 0.02)),
        "Mug-1": (-0.3, 0.3, (0.085, 0.085, 0.10)),
        "Pot-1": (0.4, 0.4, (0.2, 0.2, 0.13)),
        "WineBottle-1": (-0.5, 0.45, (0.08, 0.08, 0.29)),
        "Bread-1": (-0.1, 0.15, (0.24, 0.11, 0.11)),
        "Bowl-1": (0.55, 0.12, (0.18, 0.18, 0.08)),
    }
    solids = [Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))]
    solids += [at(n, x + shift, y, 0.9, size, True) for n, (x, y, size) in things.items()]
    return observed(solids, EYE, camera=CAMERA)


def with_masks(seen: Observation) -> Observation:
    """The same with a mask for each thing in place of instance ids."""
    frames = [
        replace(f, instance_ids=None, detections=tuple(InstanceSegmenter().segment(f)))
        for f in seen.frames
    ]
    return replace(seen, frames=tuple(frames))


def perceiver() -> GraphPerceiver:
    """Reads masks as they are given; every state is unobserved."""
    return GraphPerceiver(GivenMasks(), GivenStateEstimator({}), domain())


@cache
def domain() -> Domain:
    """The household."""
    return shipped("household")


@cache
def demonstrations() -> tuple[Demonstration, ...]:
    """Two runs of one step."""
    return tuple(_demonstration(seed, 0.05 * seed) for seed in (0, 1))


def _demonstration(seed: int, shift: float) -> Demonstration:
    seer = perceiver()
    whole = seer.perceive(with_masks(observation(shift)))
    step = Subtask(GRASP.skill, (ARGUMENT,))
    scoped = replace(seer.scope(whole, step), subtask=step)
    return Demonstration(
        task="fetch-plate",
        scene=f"table-{seed}",
        seed=seed,
        steps=(DemonstrationStep(0, step, scoped, whole),),
        perception=(("segmenter", "given-masks"), ("state_estimator", "given")),
        version="0.1.0",
        final=whole,
    )


def monitor() -> Monitor:
    """One that looks at observations and has seen the two runs."""
    from forestall.assembly.configuration import Given, choices
    from forestall.assembly.parts import Assembly
    from forestall.kinds import STRATEGY

    parts = Assembly(choices(Given()), domain(), list(demonstrations()))
    found = Monitor(parts.part(STRATEGY), domain(), perceiver())
    found.start(Plan((GRASP,), "the plate is held"))
    return found


def memory(store: SqliteStore) -> None:
    """Put the two runs into a memory."""
    for demonstration in demonstrations():
        store.add(demonstration)
