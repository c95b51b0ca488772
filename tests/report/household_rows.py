"""Seeded rows of two households, with every judge, model and number of demonstrations.

What judges say is drawn: those with better models or more demonstrations see more. Nothing in here
is a result of anything.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from forestall.statistics.rows import HONEST, KIND, EpisodeRow, Judged

TASKS = ("boil-water", "make-coffee", "make-salad", "heat-potato")
STEPS = 9
SETS = {
    KIND: ("robofail", "irreversible", "undisturbed", "harmless"),
    HONEST: ("robofail", "irreversible", "undisturbed", "harmless", "everyday", "composed"),
}
CALM = ("undisturbed", "harmless", "everyday")

GRADED = {
    "scene-graph": 0.8,
    "scene-graph without nodes": 0.6,
    "scene-graph without edges": 0.6,
    "scene-graph without structure": 0.7,
    "scene-graph without subtask node": 0.7,
    "scene-graph, whole scene": 0.4,
    "objects": 0.3,
    "caption": 0.2,
    "image": 0.05,
    "scene-graph, 1 demonstration": 0.5,
    "scene-graph, 2 demonstrations": 0.6,
    "scene-graph, 8 demonstrations": 0.85,
    "scene-graph, 16 varied demonstrations": 0.9,
}
"""Judge → how likely it is to see what is wrong."""

YES_NO = {
    "preconditions": 0.7,
    "preconditions, 1 demonstration": 0.4,
    "preconditions, 8 demonstrations": 0.8,
    "plan-check": 0.95,
    "plan-check, coarse": 0.75,
    "plan-check, wrong": 0.65,
}

STRATEGIES = {
    "none": (0.0, 0),
    "retry-once": (0.15, 0),
    "post-hoc": (0.25, 8),
    "online": (0.4, 4),
    "online-scene": (0.5, 3),
    "proactive": (0.7, 1),
    "plan-check": (0.75, 1),
}
"""Strategy → share of the failing runs that it saves, and after how many steps it steps in."""


def household(
    profile: str, rng: np.random.Generator, scenarios: int = 6, rooms: int = 2, acted: int = 4
) -> list[EpisodeRow]:
    """Rows of one household.

    Args:
        profile: `KIND` or `HONEST`.
        rng: draws.
        scenarios: of each set and task.
        rooms: of each scenario.
        acted: scenarios of each set and task with strategies beyond none and retry-once.
    """
    rows: list[EpisodeRow] = []
    for of in SETS[profile]:
        for task in TASKS:
            for k in range(scenarios):
                name = None if of == "undisturbed" else f"{task}-{of}-{k}"
                hard = float(rng.beta(2, 1))
                for room in range(rooms):
                    seed = 20_000 + 100 * room + k
                    base = _watched(profile, of, task, name, seed, hard, rng)
                    rows += [base, *_acted(base, rng, k < acted)]
    return rows


def _watched(
    profile: str,
    of: str,
    task: str,
    scenario: str | None,
    seed: int,
    hard: float,
    rng: np.random.Generator,
) -> EpisodeRow:
    failing = of not in CALM
    if profile == HONEST:
        failing = bool(rng.random() < (0.92 if failing else 0.15))
    known = int(rng.integers(1, 6)) if failing else None
    effect = None if known is None else min(STEPS, known + int(rng.integers(-1, 4)))
    causes = (f"filled(Bowl-{seed % 3}) = wine",) if failing and rng.random() < 0.9 else ()
    noise = 0.03 if profile == HONEST else 0.0
    judged = tuple(
        _judged(i, known is not None and i >= known, hard, noise, causes, rng) for i in range(STEPS)
    )
    harmed = failing and of == "irreversible"
    return EpisodeRow(
        set=of,
        task=task,
        scenario=scenario,
        kind=("drop", "occupied", "missing_step")[seed % 3] if failing else None,
        knowable=("scene", "plan", "after")[seed % 3] if failing else None,
        seed=seed,
        strategy="watch",
        detector="scene-graph",
        threshold=0.9,
        without=None,
        known=known,
        effect=effect,
        success=not failing,
        weak_success=not failing,
        failures=("the bowl is not empty",) if failing else (),
        harmed=("wine in the salad",) if harmed else (),
        harmed_s=12.0 * (effect or 0) + 6 if harmed else None,
        end="plan finished",
        error="",
        steps=STEPS,
        executed=STEPS,
        refused=0,
        judged=judged,
        replans=0,
        planner_calls=0,
        model_calls=0,
        simulated_s=110.0 + float(rng.normal(0, 4)),
        compute_s={"perceive": 2.0},
        profile=profile,
        causes=causes,
    )


def _judged(
    index: int,
    bad: bool,
    hard: float,
    noise: float,
    causes: tuple[str, ...],
    rng: np.random.Generator,
) -> Judged:
    scores: dict[str, float | None] = {}
    named: dict[str, tuple[str, ...]] = {}
    for judge, sees in GRADED.items():
        drop = 0.25 * float(rng.random()) if bad and rng.random() < sees * hard else 0.0
        jitter = abs(float(rng.normal(0, noise))) if rng.random() < 0.8 else 0.0
        scores[judge] = None if rng.random() < 0.02 else round(max(0.0, 1 - drop - jitter), 4)
    for judge, sees in YES_NO.items():
        wrong = rng.random() < (sees * hard if bad else noise)
        scores[judge] = 0.0 if wrong else 1.0
    for judge, score in scores.items():
        if score is not None and score < (0.5 if judge in YES_NO else 0.9):
            right = bad and causes and rng.random() < 0.6
            wanted = tuple(c.replace("wine", "water") for c in causes)
            named[judge] = wanted if right else ("open(Fridge-1)",)
    return Judged(
        index=index,
        when="before",
        subtask=f"pick_up_obj Thing-{index}",
        time_s=12.0 * index,
        score=scores["scene-graph"],
        decision="proceed",
        scores=scores,
        named=named,
        possible=True,
        reachable=not bad,
    )


def _acted(base: EpisodeRow, rng: np.random.Generator, every: bool) -> list[EpisodeRow]:
    honest = base.profile == HONEST
    chosen = [
        (strategy, model)
        for strategy in STRATEGIES
        for model in ("exact", "coarse", "wrong")
        if (every or strategy in ("none", "retry-once"))
        and (model == "exact" or (honest and strategy in ("proactive", "plan-check")))
    ]
    rows = []
    for strategy, model in chosen:
        saves, late = STRATEGIES[strategy]
        saves *= {"exact": 1.0, "coarse": 0.85, "wrong": 0.7}[model]
        alarmed = strategy not in ("none", "retry-once") and rng.random() < (
            saves if base.failing else 0.1
        )
        success = rng.random() < (saves if base.failing else 0.97)
        start = (base.known or 0) + late if base.failing else 3
        judged = tuple(
            replace(
                j,
                scores={},
                named={},
                decision="replan" if alarmed and j.index == start else "proceed",
                replanned=bool(alarmed and j.index == start),
            )
            for j in base.judged
        )
        harmed = bool(base.harmed) and not (success and rng.random() < 0.9)
        rows.append(
            replace(
                base,
                strategy=strategy,
                model=model,
                judged=judged,
                success=bool(success),
                weak_success=bool(success),
                harmed=base.harmed if harmed else (),
                harmed_s=base.harmed_s if harmed else None,
                replans=int(alarmed),
                simulated_s=base.simulated_s + 25.0 * alarmed + 8.0 * (strategy == "retry-once"),
                reasoning_s=0.0 if strategy == "none" else 3.0,
            )
        )
    return rows


def both(seed: int = 11, scenarios: int = 4, rooms: int = 2, acted: int = 2) -> list[EpisodeRow]:
    """Rows of both households."""
    rng = np.random.default_rng(seed)
    return household(KIND, rng, scenarios, 1, scenarios) + household(
        HONEST, rng, scenarios, rooms, acted
    )
