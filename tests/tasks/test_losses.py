"""When a run is lost, and when that does harm: traces by hand, and both shipped domains."""

from __future__ import annotations

from dataclasses import replace

import pytest
from lost_runs import lost, run

from forestall.tasks.faults import parse_fault
from forestall.tasks.losses import Loss, losses
from forestall.tasks.truth import TrueMoment, TruthTrace
from forestall.types.episode import EpisodeRecord, Event, ExecutedRecord, SkillOutcome, SkillStatus
from forestall.types.facts import Literal

Peg = tuple[EpisodeRecord, TruthTrace]

FREE = Literal.parse("free(RoundHole-1)")
HELD = Literal.parse("gripped_by(RoundPeg-1, gripper)")
DROP = parse_fault({"kind": "drop", "step": "pick(RoundPeg)"})


@pytest.fixture(scope="module")
def peg() -> Peg:
    record, trace, _ = run("glue-peg")
    assert record.success and len(trace.moments) == 6
    return record, trace


def made(
    peg: Peg,
    lacking: str,
    wrong: dict[int, SkillStatus] | None = None,
    harmed: int | None = None,
) -> tuple[TruthTrace, EpisodeRecord]:
    """A trace of six moments ("." all is well, a letter: what lacks), and the record of the run.

    `wrong`: steps that were refused or failed. `harmed`: the step that did harm.
    """
    record, before = peg
    facts = {"F": FREE, "H": HELD}
    trace = TruthTrace()
    trace.moments = [TrueMoment(True, x == ".", () if x == "." else (facts[x],)) for x in lacking]
    trace.left = [replace(left, events=k) for k, left in enumerate(before.left)]
    executed = tuple(
        ExecutedRecord(e.subtask, SkillOutcome((wrong or {}).get(e.index, e.outcome.status), 1.0),
                       e.index)
        for e in record.executed
    )  # fmt: skip
    events = tuple(Event(float(k), "note", (), f"event {k}") for k in range(6))
    harm = () if harmed is None else ((float(harmed), f"event {harmed}"),)
    return trace, replace(record, executed=executed, success=False, events=events, harmed=harm)


REFUSED, FAILED = SkillStatus.REFUSED, SkillStatus.FAILED


def test_a_run_that_succeeds_has_no_loss(peg: Peg) -> None:
    assert losses(peg[1], peg[0]) is None


def test_it_is_lost_from_when_it_stays_so(peg: Peg) -> None:
    trace, record = made(peg, ".F.FFF", {1: REFUSED, 4: REFUSED, 5: REFUSED})
    assert losses(trace, record) == Loss(known=3, effect=4, at=3)


def test_a_loss_at_the_last_step_is_known_after_it(peg: Peg) -> None:
    trace, record = made(peg, "......", {5: FAILED})
    assert losses(trace, record) == Loss(known=6, effect=6, at=6)


def test_where_nothing_is_refused_the_effect_is_the_end(peg: Peg) -> None:
    trace, record = made(peg, "..FFFF")
    assert losses(trace, record) == Loss(known=2, effect=6, at=2)


def test_the_failed_subtask_itself_cannot_be_foreseen(peg: Peg) -> None:
    trace, record = made(peg, "..HHHH", {1: FAILED, 2: REFUSED})
    assert losses(trace, record) == Loss(known=2, effect=2, at=2)


def test_a_slip_that_does_harm_at_once_was_not_to_be_foreseen(
    peg: Peg,
) -> None:
    trace, record = made(peg, "...FFF", {4: REFUSED}, harmed=2)
    assert losses(trace, record) == Loss(known=3, effect=2, at=3)


def test_harm_that_is_foreseen_comes_before_a_later_refusal(
    peg: Peg,
) -> None:
    trace, record = made(peg, ".FFFFF", {5: REFUSED}, harmed=3)
    assert losses(trace, record) == Loss(known=1, effect=3, at=1)


def test_harm_from_the_start_is_of_the_first_step(peg: Peg) -> None:
    trace, record = made(peg, "FFFFFF")
    record = replace(record, harmed=((0.0, "smeared from the start"),))
    assert losses(trace, record) == Loss(known=0, effect=0, at=0)


def test_what_nobody_can_see_yet_is_known_when_the_scenario_says(
    peg: Peg,
) -> None:
    trace, record = made(peg, "FFFFFF", {4: REFUSED})
    assert losses(trace, record, (), (3, 4)) == Loss(known=3, effect=4, at=0)
    trace, record = made(peg, "..FFFF", {5: REFUSED})
    assert losses(trace, record, [DROP], (4, 5)) == Loss(known=4, effect=5, at=2)


def test_a_slip_before_the_scenarios_fault_counts_from_when_it_happens(
    peg: Peg,
) -> None:
    trace, record = made(peg, ".HHHHH", {1: REFUSED})
    assert losses(trace, record, [DROP], (4, 5)) == Loss(known=1, effect=1, at=1)


@pytest.mark.parametrize(
    ("wrong", "known", "effect"),
    [({1: FAILED, 2: REFUSED}, 2, 2), ({3: REFUSED}, 2, 3)],
)
def test_a_slip_that_ruins_a_run_sooner_than_the_fault_is_what_fails(
    peg: Peg, wrong: dict[int, SkillStatus], known: int, effect: int
) -> None:
    trace, record = made(peg, "FFHHHH", wrong)
    assert losses(trace, record, (), (5, 5)) == Loss(known, effect, at=0)


@pytest.mark.parametrize(
    "scenario",
    [
        *("hole-occupied", "hole-full-of-chips", "tray-full", "irreversible-fasten-plate-1-thread"),
        *("composed-heat-potato-2", "midrun-heat-potato-3", "midrun-heat-potato-5"),
        *("irreversible-store-egg-1-wine", "irreversible-heat-potato-4-coffee"),
        *("robofail-heat-potato-2", "robofail-warm-water-10", "robofail-boil-water-9"),
        *("robofail-store-egg-8", "eyes-heat-potato-1"),
    ],
)
def test_where_nothing_else_goes_wrong_a_loss_is_when_the_scenario_says(scenario: str) -> None:
    loss, _, said = lost(scenario)
    assert loss is not None
    assert (loss.known, loss.effect) == said


def test_what_has_happened_and_cannot_be_undone_stays_a_loss() -> None:
    loss, why, _ = lost("irreversible-heat-potato-4-coffee")
    assert loss is not None and loss.effect < loss.known
    assert "spoiled(Potato-1)" in why
