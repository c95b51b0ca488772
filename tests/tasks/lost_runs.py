"""Runs that nobody interrupts, with the trace of the truth, in worlds of facts."""

from __future__ import annotations

from forestall.assembly.configuration import run_config
from forestall.assembly.make import prepare, run_episode
from forestall.domain.model import Domain
from forestall.tasks.causes import causes
from forestall.tasks.files import load_scenario
from forestall.tasks.losses import Loss, losses
from forestall.tasks.truth import TruthTrace
from forestall.types.episode import EpisodeRecord

SEED = 10_003


def run(task: str, scenario: str | None = None) -> tuple[EpisodeRecord, TruthTrace, Domain]:
    """The record, the trace, and the domain of a run in a symbolic world."""
    config = run_config(
        task, scenario, seed=SEED, world="symbolic", perceiver="given-graph", strategy="none"
    )
    prepared = prepare(config)
    trace = TruthTrace()
    return run_episode(prepared, None, trace=trace), trace, prepared.loaded.domain


def lost(scenario: str) -> tuple[Loss | None, tuple[str, ...], tuple[int | None, int | None]]:
    """When a scenario's run is lost, why, and when the scenario says that it is."""
    loaded = load_scenario(scenario)
    record, trace, domain = run(loaded.task, scenario)
    said = loaded.moments(record.initial_plan)
    loss = losses(trace, record, loaded.faults, said)
    why = () if loss is None else causes(trace, loaded.faults, domain, loss.at)
    return loss, tuple(map(str, why)), said
