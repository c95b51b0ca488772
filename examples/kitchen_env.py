"""The household for Gymnasium, gymnasium.make("forestall/Kitchen-v0"); it needs no OpenGL."""

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.spaces import MultiDiscrete

from forestall import SceneGraph, Subtask, open_task

Numbers = npt.NDArray[np.int64]


class Kitchen(gymnasium.Env[Numbers, Numbers]):
    """A task: an action is a skill and two things, of which a skill of one thing takes the first.

    An observation says of each thing where it is (0 not there or fixed, 1 elsewhere, 2 in the hand,
    3 at the first thing, ...), then its states (0 none). The world "kitchen" has bodies, too.
    """

    def __init__(self, task: str = "heat-potato", world: str = "symbolic", **options: Any) -> None:
        self.opened = open_task(task, world=world, **options)
        self.domain, given = self.opened.domain, self.opened.task
        named = {a for step in given.plan.subtasks for a in step.args}
        self.things = sorted(named | {o.category for o in given.scene.objects})
        self.skills = list(self.domain.skills.values())
        self.states = [(k, a) for k, t in enumerate(self.things) for a in self.domain[t].attributes]
        n, values = len(self.things), [len(self.domain.values(a)) + 1 for _, a in self.states]
        self.action_space = MultiDiscrete([len(self.skills), n, n])
        self.observation_space = MultiDiscrete([n + 3] * n + values)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Numbers, Any]:
        super().reset(seed=seed)
        self.opened.environment.reset(int(self.np_random.integers(1_000_000)))
        return self.seen(self.opened.truth()), {}

    def step(self, action: Numbers) -> tuple[Numbers, float, bool, bool, Any]:
        skill, things = self.skills[action[0]], tuple(self.things[i] for i in action[1:])
        subtask = Subtask(skill.name, things[: len(skill.parameters)])
        outcome, unmet = self.opened.environment.execute(subtask), self.opened.unmet()
        info = {"subtask": str(subtask), "refused": outcome.reason, "unmet": list(unmet)}
        over = not unmet or bool(self.opened.spoilt())  # what is spoilt stays so
        return self.seen(self.opened.truth()), float(not unmet), over, False, info

    def seen(self, graph: SceneGraph) -> Numbers:
        names = [next(iter(graph.matches(t)), "") for t in self.things]
        order = ["", "elsewhere", "gripper", *names]
        relations = [*self.domain.containing, self.domain.roles.holding or ""]
        at = [next(iter(graph.parents(n, relations)), "") for n in names]
        nodes = [graph.get(n) for n in names]
        of = [(a, node.state(a) if (node := nodes[k]) else None) for k, a in self.states]
        values = [self.domain.values(a).index(v) + 1 if v else 0 for a, v in of]
        return np.array([order.index(p) if p in order else 1 for p in at] + values, np.int64)

    def close(self) -> None:
        self.opened.close()


gymnasium.register("forestall/Kitchen-v0", "kitchen_env:Kitchen", max_episode_steps=100)
