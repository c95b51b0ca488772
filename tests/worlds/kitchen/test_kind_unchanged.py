"""The profile "kind" is the household as it was before there was any other.

The digests were taken from runs of the household before skills could go wrong.
"""

import hashlib

import pytest

from forestall.domain.load import shipped
from forestall.tasks.files import load_task
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.flat_world import flat_environment

DOMAIN = shipped("household")


def _digest(env: KitchenEnvironment, task: str, seed: int) -> str:
    """Everything that a nominal run leaves behind: outcomes, events, truth, places, belief."""
    env.reset(seed)
    lines = []
    for subtask in load_task(task).task.plan:
        outcome = env.execute(subtask)
        hand = tuple(round(x, 6) for x in outcome.hand_world_m or ())
        lines.append(f"{subtask} {outcome.status} {outcome.duration_s:.6f} {outcome.reason} {hand}")
        lines.append(env.oracle.truth().text())
    lines += [f"{e.time_s:.6f} {e.kind} {e.objects} {e.text}" for e in env.oracle.events()]
    for node in env.oracle.truth().nodes:
        lines.append(f"{node.id} {tuple(round(x, 6) for x in node.centroid_m or ())}")
    lines.append(" ".join(map(str, sorted(env.oracle.history(), key=str))))
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:16]


FLAT = {
    ("boil-water", 3): "f6546cbdf57eec19",
    ("boil-water", 10007): "1345ed2c6317c1ed",
    ("cook-egg", 3): "9e619cd166cea728",
    ("cook-egg", 10007): "29ded09ed4e90344",
    ("heat-potato", 3): "6fe9d52122784f8b",
    ("heat-potato", 10007): "4a0b0047ae28a4f5",
    ("make-coffee", 3): "61dce238aa14e3e4",
    ("make-coffee", 10007): "6b5cbb9e3c2aa3ee",
    ("make-salad", 3): "5e133c4ea19a2417",
    ("make-salad", 10007): "dbed4b3f0b15664e",
    ("store-egg", 3): "4eddf5f09feda75c",
    ("store-egg", 10007): "bf0d2a726acb0f4f",
    ("switch-devices", 3): "ed858e313c2a21b8",
    ("switch-devices", 10007): "4af1f6fac4e927bb",
    ("toast-bread", 3): "be30144eb4c1ac5c",
    ("toast-bread", 10007): "6d1795022ad7217f",
    ("warm-water", 3): "13aee46495e784fe",
    ("warm-water", 10007): "d84d34a98f2fb658",
    ("water-plant", 3): "12b4aeb25ca3c90c",
    ("water-plant", 10007): "b4e0fde2a464396d",
}

BUILT = {
    ("boil-water", 10000): "3095d3f0f555625a",
    ("make-salad", 10001): "98d1ee5d6cff5c1a",
    ("heat-potato", 10002): "382668d1d2fce3bd",
    ("switch-devices", 10003): "8085e1ffa1e56633",
    ("cook-egg", 10004): "c16fcc92e77685d4",
}


@pytest.mark.parametrize(("task", "seed"), sorted(FLAT))
def test_a_flat_run_is_what_it_was(task: str, seed: int) -> None:
    env = flat_environment(load_task(task).task.scene, DOMAIN)
    assert _digest(env, task, seed) == FLAT[task, seed]


@pytest.mark.parametrize(("task", "seed"), sorted(BUILT))
def test_a_run_in_the_kitchen_is_what_it_was(task: str, seed: int) -> None:
    env = KitchenEnvironment(load_task(task).task.scene, DOMAIN)
    assert _digest(env, task, seed) == BUILT[task, seed]
