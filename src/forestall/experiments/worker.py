"""One episode → one row. Called in a worker process by an engine; calls assembly.

Whatever goes wrong in an episode becomes a row that says so: it counts as a failure and is seen.
"""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from forestall.assembly.configuration import Choice, Given, RunConfig, run_config
from forestall.assembly.demonstrations import load_memory
from forestall.assembly.make import Prepared, make_world, needs_memory, prepare, run_episode
from forestall.domain.distort import distorted
from forestall.errors import ForestallError, where
from forestall.experiments.runs import MODELS, Run
from forestall.experiments.settings import Settings
from forestall.kinds import SENSOR, WORLD
from forestall.records.derived import adopted, alarms, reasoning_s, replans
from forestall.records.exchanges import exchanges_of
from forestall.records.record import RunRecorder
from forestall.report.page import write_page
from forestall.seams.acting import WorldPart
from forestall.statistics.rows import (
    EXACT,
    KIND,
    MODEL,
    MODEL_PLANS,
    PERFECT,
    TEMPLATES,
    EpisodeRow,
    Judged,
)
from forestall.statistics.watches import WATCH
from forestall.tasks.causes import causes
from forestall.tasks.faults import knowable
from forestall.tasks.losses import losses
from forestall.tasks.truth import TruthTrace
from forestall.types.decision import Outcome
from forestall.types.demonstration import Demonstration
from forestall.types.episode import (
    SLIP,
    BoundaryRecord,
    EpisodeEnd,
    EpisodeRecord,
    SkillStatus,
    TroubleKind,
)
from forestall.types.runtime import When
from forestall.types.verdict import Decision, ReplanOutcome

UNLIMITED = {
    **{f"max_{what}_in_a_row": 0 for what in ("alarms", "repairs", "failures")},
    "max_unchanged": 0,
}
"""An experiment goes on as the paper does, however often something goes wrong, and counts it."""

_ALONE = {"name": "model", "otherwise": "none"}

REASONING: dict[str, dict[str, Any]] = {
    TEMPLATES: {},
    MODEL: {"reasoner": _ALONE},
    MODEL_PLANS: {"reasoner": _ALONE, "replanner": _ALONE},
}
"""What is said of the parts so that somebody explains; a model has nobody behind it."""

_BROKEN = (TroubleKind.INTERNAL, TroubleKind.FAILED, TroubleKind.WORLD)
"""After these nothing was measured; what was late, not believed or too often was held."""

PAGES = "episodes"
"""Folder of the episodes' own pages, inside that of an experiment."""


@dataclass(frozen=True, slots=True)
class Work:
    """A run with all that a worker must know; `folder` is that of the experiment."""

    run: Run
    settings: Settings
    folder: str | None = None

    @property
    def page_folder(self) -> Path | None:
        """Where the run's own page goes, None where it gets none."""
        run, pages = self.run, self.settings.pages
        shipped = Run(run.case, "proactive", profile=run.profile, demonstrations=run.demonstrations)
        telling = run == shipped
        if self.folder is None or pages == "none" or (pages == "telling" and not telling):
            return None
        return Path(self.folder) / PAGES / run.key


def config_of(run: Run, settings: Settings) -> RunConfig:
    """The run as `assembly` wants it."""
    case = run.case
    strategy: dict[str, Any] = {"name": run.strategy}
    if run.strategy == WATCH:
        strategy |= {"models": MODELS, "model_seed": case.seed, "counts": counts_of(run)}
    return run_config(
        case.task,
        case.scenario,
        seed=case.seed,
        without=run.without,
        keep_observations=False,
        given=Given.named(REASONING[run.reasoning])
        .over(_through(run.sensor))
        .over(_household(run.profile, settings))
        .over(Given.named({"limit": UNLIMITED})),
        strategy=strategy,
        detector={"name": run.detector, "threshold": run.threshold},
    )


def counts_of(run: Run) -> tuple[int, ...]:
    """With how many of the demonstrations judges are watched, where they differ from each other."""
    count = varied(run) if run.shown_in == (run.case.task,) else 0
    return tuple(2**k for k in range(count.bit_length()) if 2**k <= count)


def varied(run: Run) -> int:
    """How many varied demonstrations a run has, 0 where they are plain."""
    return int(run.demonstrations.split()[0]) if "varied" in run.demonstrations else 0


def second_of(profile: str) -> Given | None:
    """What is said of every second demonstration of a household: other rooms than the robot's."""
    return None if profile == KIND else Given.named({"world.rooms": "ithor"})


def _household(profile: str, settings: Settings) -> Given:
    """What was said of the parts, in one profile of the household."""
    if profile == KIND:
        return settings.given
    return Given.named({"world.profile": profile}).over(settings.given)


def _through(sensor: str) -> Given:
    """What a run says of its sensor, over what was said for all: a name, or some errors."""
    if sensor == PERFECT:
        return Given()
    if "=" not in sensor:
        return Given.named({SENSOR.name: sensor})
    return Given.said(f"{SENSOR.name}.{error}" for error in sensor.split(","))


def prepared_run(run: Run, settings: Settings) -> Prepared:
    """The checked run, with the model that its monitor has of the domain.

    Raises:
        InputError: see `prepare`.
    """
    prepared = prepare(config_of(run, settings))
    if run.model == EXACT:
        return prepared
    model = distorted(prepared.loaded.domain, run.model, run.case.seed).domain
    return replace(prepared, model=model)


def run_one(work: Work) -> dict[str, Any]:
    """Run an episode; its row as plain data."""
    run = work.run
    prepared = prepared_run(run, work.settings)
    trace = TruthTrace()
    try:
        return _row(run, prepared, _record(work, prepared, trace), trace).to_json()
    except OSError:
        raise  # a full or broken disk is no failed episode
    except Exception as error:  # noqa: BLE001 - whatever breaks is one failed episode, and is told
        told = f"{type(error).__name__}: {error}{where(error)}"
        return broken_row(run, told, prepared).to_json()


def broken_row(run: Run, error: str, prepared: Prepared) -> EpisodeRow:
    """The row of an episode that did not come to an end."""
    return EpisodeRow(
        **_identity(run, prepared),
        success=False,
        weak_success=False,
        failures=(error,),
        harmed=(),
        harmed_s=None,
        end="error",
        error=error,
        steps=len(prepared.plan),
        executed=0,
        refused=0,
        judged=(),
        replans=0,
        planner_calls=0,
        model_calls=0,
        simulated_s=0.0,
        compute_s={},
    )


def _record(work: Work, prepared: Prepared, trace: TruthTrace) -> EpisodeRecord:
    demonstrations, memory = None, None
    if needs_memory(prepared.config):
        run = work.run
        found = [_memory(t, run.profile, varied(run), work.settings) for t in run.shown_in]
        demonstrations = tuple(d for shown, _ in found for d in shown)
        memory = _name_of([name for _, name in found])
    folder = work.page_folder
    recorder = None if folder is None else RunRecorder(folder, page="index.html")
    listeners = [] if recorder is None else [recorder]
    record = run_episode(prepared, demonstrations, listeners, memory, trace, _world(prepared))
    if recorder is not None and not recorder.complete:
        raise OSError("; ".join(record.notes))
    if folder is not None:
        dull = not work.run.case.failing and record.success and not alarms(record)
        if work.settings.pages == "telling" and dull:
            shutil.rmtree(folder)
        else:
            write_page(record, folder / "index.html")
    return record


def _row(run: Run, prepared: Prepared, record: EpisodeRecord, trace: TruthTrace) -> EpisodeRow:
    judged, last = [], len(record.boundaries) - 1
    if len(trace.moments) <= last:
        raise ForestallError(f"the truth was not traced to the end: {'; '.join(record.notes)}")
    for position, boundary in enumerate(record.boundaries):
        following = record.boundaries[position + 1] if position < last else None
        if following is not None and _same(boundary, following):
            continue  # another look follows, and that one counts
        if boundary.outcome is Outcome.HOLD and boundary.verdict is None:
            continue  # nothing was judged
        moment = trace.moments[position]
        judged.append(_judged(boundary, record, moment.possible, moment.reachable))
    trouble = record.trouble
    broke = trouble is not None and trouble.kind in _BROKEN
    lost = {} if broke or run.strategy != WATCH else _lost(run, prepared, record, trace)
    return EpisodeRow(
        **(_identity(run, prepared) | lost),
        slips=sum(e.kind == SLIP for e in record.events),
        success=bool(record.success),
        weak_success=record.weak_success,
        failures=record.failures,
        harmed=tuple(text for _, text in record.harmed),
        harmed_s=min((at for at, _ in record.harmed), default=None),
        end=EpisodeEnd.ERROR.value if broke else record.end.value,
        error="" if trouble is None else trouble.text,
        steps=len(prepared.plan),
        executed=len(record.executed),
        refused=sum(e.outcome.status is not SkillStatus.SUCCEEDED for e in record.executed),
        judged=tuple(judged),
        replans=replans(record),
        not_judged=sum(
            b.outcome is Outcome.NOT_JUDGED and b.when is When.BEFORE for b in record.boundaries
        ),
        planner_calls=sum(
            b.replan is not None and b.replan.outcome is not ReplanOutcome.NOTHING_TO_CHANGE
            for b in record.boundaries
        ),
        model_calls=sum(len(exchanges_of(b)) for b in record.boundaries),
        simulated_s=record.simulated_s,
        compute_s=dict(record.compute_s),
        reasoning_s=reasoning_s(record.compute_s),
        provenance={
            **{
                k: v
                for k, v in record.provenance
                if k in ("demonstrations", "memory", "perception", "versions")
            },
            "config": prepared.config.to_json(defaulted=False),
        },
    )


def _lost(run: Run, prepared: Prepared, record: EpisodeRecord, trace: TruthTrace) -> dict[str, Any]:
    """When the run that nobody interrupts was lost, and why, as the truth has it.

    When it can be known that a failing scenario fails is said by the scenario; in the honest
    household any run can fail, and the truth says when.
    """
    scenario, failing = prepared.scenario, run.case.failing
    faults = prepared.faults if failing else ()
    said = scenario.moments(prepared.plan) if failing and scenario else (None, None)
    loss = losses(trace, record, faults, said)
    if loss is None:
        return {} if run.profile == KIND else {"known": None, "effect": None}
    facts = causes(trace, faults, prepared.loaded.domain, loss.at)
    found: dict[str, Any] = {"causes": tuple(map(str, facts))}
    if run.profile != KIND:
        found |= {"known": loss.known, "effect": loss.effect}
    return found


def _identity(run: Run, prepared: Prepared) -> dict[str, Any]:
    scenario = prepared.scenario
    moments = (None, None) if scenario is None else scenario.moments(prepared.plan)
    failing = run.case.failing
    told = failing and run.profile == KIND
    return {
        "set": run.case.set,
        "task": run.case.task,
        "scenario": run.case.scenario,
        "kind": None if scenario is None else scenario.kind,
        "knowable": knowable(prepared.faults) if failing else None,
        "seed": run.case.seed,
        "strategy": run.strategy,
        "detector": run.detector,
        "threshold": run.threshold,
        "without": run.without,
        "profile": run.profile,
        "model": run.model,
        "demonstrations": run.demonstrations,
        "reasoning": run.reasoning,
        "sensor": run.sensor,
        "known": moments[0] if told else None,
        "effect": moments[1] if told else None,
    }


def _same(a: BoundaryRecord, b: BoundaryRecord) -> bool:
    """Whether two entries are looks of one moment."""
    return (a.index, a.when, b.looks) == (b.index, b.when, a.looks + 1)


def _judged(
    boundary: BoundaryRecord, record: EpisodeRecord, possible: bool, reachable: bool
) -> Judged:
    verdict, diagnosis = boundary.verdict, boundary.diagnosis
    decision = Decision.PROCEED if verdict is None else verdict.decision
    if decision is Decision.LOOK_AGAIN:
        decision = Decision.REPLAN  # the last look, and it still does not fit
    return Judged(
        index=boundary.index,
        when=boundary.when.value,
        subtask=str(boundary.subtask),
        time_s=boundary.time_s,
        score=None if verdict is None else verdict.score,
        decision=decision.value,
        confirmed=diagnosis is not None and bool(diagnosis.must_change),
        replanned=adopted(boundary, record.executed) is not None,
        cause="" if diagnosis is None else diagnosis.cause,
        looks=boundary.looks,
        scores={v.detector: v.score for v in boundary.watched},
        named=_named(boundary),
        possible=possible,
        reachable=reachable,
    )


def _named(boundary: BoundaryRecord) -> dict[str, tuple[str, ...]]:
    """The facts that each judge with an alarm says must change."""
    found = {
        v.detector: tuple(map(str, v.lacking))
        for v in boundary.watched
        if v.lacking and v.score is not None and v.score < v.threshold
    }
    verdict, diagnosis = boundary.verdict, boundary.diagnosis
    if verdict is not None and diagnosis is not None and diagnosis.must_change:
        found[verdict.detector] = tuple(map(str, diagnosis.must_change))
    return found


_worlds: dict[Choice, WorldPart] = {}
"""The worlds part of this process, which remembers what it drew lately."""


def _world(prepared: Prepared) -> WorldPart:
    choice = prepared.config.choice(WORLD)
    if choice not in _worlds:
        _worlds.clear()
        _worlds[choice] = make_world(prepared.config, prepared.loaded.domain)
    return _worlds[choice]


@cache
def _memory(
    task: str, profile: str, ways: int, settings: Settings
) -> tuple[tuple[Demonstration, ...], str]:
    config = run_config(task, given=_household(profile, settings))
    demonstrations, path = load_memory(config, workers=1, varied=ways, second=second_of(profile))
    return tuple(demonstrations), Path(path).name


def _name_of(memories: list[str]) -> str:
    """The name of a memory, or of several, whose names tell their content."""
    if len(memories) == 1:
        return memories[0]
    digest = hashlib.blake2b("\n".join(memories).encode(), digest_size=8).hexdigest()
    return f"{len(memories)}-memories-{digest}"


__all__ = [
    "PAGES",
    "Work",
    "broken_row",
    "config_of",
    "prepared_run",
    "run_one",
    "second_of",
    "varied",
]
