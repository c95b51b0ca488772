"""Seeded rows that look like those of an experiment: what a detector sees of a run is drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from forestall.statistics.rows import EpisodeRow, Judged

KINDS = {
    "drop": "after",
    "failed_action": "after",
    "missing_step": "plan",
    "wrong_order": "plan",
    "wrong_plan": "plan",
    "ambiguous_plan": "plan",
    "occupied": "scene",
    "blocking": "scene",
    "dirty_preaction": "scene",
    "filled_preaction": "scene",
    "wrong_perception": "after",
    "wrong_execution": "after",
}
TASKS = ("boil-water", "cook-egg", "heat-potato", "make-coffee", "make-salad", "warm-water")
DETECTORS = {
    "scene-graph": (0.95, 0.12),
    "objects": (0.95, 0.06),
    "caption": (0.93, 0.04),
    "image": (0.9, 0.02),
    "scene-graph without nodes": (0.95, 0.09),
    "scene-graph without edges": (0.95, 0.08),
}
SUCCESS = {"none": 0.0, "post-hoc": 0.25, "online": 0.4, "proactive": 0.8}
STEPS = 10


def case_rows(
    rng: np.random.Generator,
    of: str,
    task: str,
    scenario: str | None,
    kind: str | None,
    seed: int,
    strategies: tuple[str, ...] = ("watch", "post-hoc", "online", "proactive"),
) -> list[EpisodeRow]:
    subtle = float(rng.choice([0.1, 0.4, 1.0]))
    strange = float(rng.normal(0, 0.02))
    failing = of in ("robofail", "irreversible")
    known = int(rng.integers(1, 5)) if failing else None
    effect = None if known is None else min(STEPS, known + int(rng.integers(1, 4)))
    rows = []
    for strategy in strategies:
        judged = []
        harmed_s = None if effect is None or of != "irreversible" else 12.0 * effect + 6
        stepped_in = {"online": effect, "proactive": known, "post-hoc": STEPS}.get(strategy)
        for i in range(STEPS):
            bad = known is not None and i >= known
            scores: dict[str, float | None] = {
                name: round(
                    float(np.clip(rng.normal(mean + strange - bad * subtle * drop, 0.012), 0, 1)), 4
                )
                for name, (mean, drop) in DETECTORS.items()
            }
            alarm = failing and stepped_in == i
            judged.append(
                Judged(
                    index=i,
                    when="after" if strategy == "online" else "before",
                    subtask=f"pick_up_obj Thing-{i}",
                    time_s=12.0 * i,
                    score=scores["scene-graph"],
                    decision="replan" if alarm else "proceed",
                    confirmed=alarm,
                    replanned=alarm,
                    cause="the bowl is filled with wine" if alarm else "",
                    scores=scores if strategy == "watch" else {},
                    possible=True,
                    reachable=not bad,
                )
            )
        if strategy == "post-hoc" and failing:
            judged.append(
                Judged(STEPS, "end", "", 120.0, 0.4, "replan", confirmed=True, replanned=True)
            )
        kept = SUCCESS["none" if strategy == "watch" else strategy]
        success = bool(rng.random() < kept) if failing else bool(rng.random() < 0.97)
        if strategy == "proactive" and success:
            harmed_s = None
        rows.append(
            EpisodeRow(
                set=of,
                task=task,
                scenario=scenario,
                kind=kind,
                knowable=None if not failing else KINDS.get(kind or "", "scene"),
                seed=seed,
                strategy=strategy,
                detector="scene-graph",
                threshold=0.9,
                without=None,
                known=known,
                effect=effect,
                success=success,
                weak_success=success,
                failures=() if success else ("the bowl is not empty",),
                harmed=("wine in the salad",) if harmed_s is not None else (),
                harmed_s=harmed_s,
                end="plan finished",
                error="",
                steps=STEPS,
                executed=STEPS,
                refused=0,
                judged=tuple(judged),
                replans=int(stepped_in is not None and failing),
                planner_calls=1,
                model_calls=0,
                simulated_s=120.0 + 30 * (stepped_in or 0) / STEPS + float(rng.normal(0, 4)),
                compute_s={"perceive": 2.0, "compare": 0.4},
                reasoning_s=0.0 if strategy == "watch" else 3.0 + float(rng.random()),
                provenance={"forestall": "0.1.0"},
            )
        )
    return rows


def experiment(seed: int = 7, each: int = 24) -> list[EpisodeRow]:
    rng = np.random.default_rng(seed)
    rows: list[EpisodeRow] = []
    kinds = sorted(KINDS)
    for k in range(2 * each):
        task, kind = TASKS[k % len(TASKS)], kinds[k % len(kinds)]
        rows += case_rows(rng, "robofail", task, f"{task}-{k}", kind, 20_000 + k % 10)
    for k in range(each):
        task, kind = TASKS[k % len(TASKS)], ("filled_preaction", "dirty_preaction")[k % 2]
        rows += case_rows(rng, "irreversible", task, f"{task}-wine-{k}", kind, 20_000 + k % 10)
        rows += case_rows(rng, "undisturbed", task, None, None, 20_000 + k)
        name = f"{task}-cluttered-{k}"
        rows += case_rows(rng, "harmless", task, name, "clutter", 20_000 + k % 10)
    proactive = [r for r in rows if r.strategy == "proactive" and r.set == "robofail"]
    rows += [replace(r, without="reasoning", success=bool(rng.random() < 0.4)) for r in proactive]
    return rows
