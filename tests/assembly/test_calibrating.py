"""From demonstrations of the bench to calibrated runs, in symbolic worlds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import pytest

from forestall import Monitor
from forestall.assembly.calibrating import JUDGES, calibrate, judged_in, still_fits
from forestall.assembly.configuration import Given, run_config
from forestall.assembly.make import prepare, run_episode
from forestall.assembly.recording import RecordingJob, record_one
from forestall.assembly.sources import labelled
from forestall.calibration.file import write_calibration
from forestall.calibration.scores import Parts
from forestall.cli.main import call
from forestall.config import DEMONSTRATION_SEEDS
from forestall.errors import InputError
from forestall.memory.store import open_store
from forestall.types.demonstration import Demonstration
from forestall.types.episode import EpisodeRecord
from forestall.types.graph import SceneGraph
from forestall.types.verdict import Calibration, Decision, Verdict

SYMBOLIC = Given.named({"world": "symbolic", "perceiver": "given-graph"})
TASK, OTHER = "hand-over-washer", "glue-peg"


def recorded(task: str, count: int, first: int = 0) -> list[Demonstration]:
    seeds = (DEMONSTRATION_SEEDS + 10 * k for k in range(first, first + count))
    return [
        replace(record_one(RecordingJob(task, seed, SYMBOLIC)), id=f"{task}-{seed}")
        for seed in seeds
    ]


@pytest.fixture(scope="module")
def demonstrations() -> list[Demonstration]:
    return [*recorded(TASK, 10), *recorded(OTHER, 2)]


def ran(
    memory: Iterable[Demonstration], scenario: str | None = None, seed: int = 3, **detector: object
) -> EpisodeRecord:
    config = run_config(TASK, scenario, seed=seed, given=SYMBOLIC, detector=detector)
    return run_episode(prepare(config), list(memory))


def verdicts(record: EpisodeRecord) -> list[Verdict]:
    return [b.verdict for b in record.boundaries if b.verdict is not None]


def test_every_judge_sees_every_boundary_of_every_run(
    demonstrations: list[Demonstration],
) -> None:
    label = labelled("pick(Nut-1)", facts=["dirt(Nut-1)=clean"])
    made = calibrate([*demonstrations, label], judges=JUDGES, parts=Parts.NONE, level=0.25)
    assert made.scores.judges == JUDGES
    assert made.scores.runs == tuple(d.id for d in demonstrations)
    assert made.demonstrations == len(demonstrations)
    assert not made.held_out
    assert made.irreversible == ("glue_up", "hand_over", "place")
    assert made.fit(TASK).task == TASK
    assert made.fit(OTHER).task is None


def test_what_is_left_out_is_no_reference_of_itself(demonstrations: list[Demonstration]) -> None:
    """One demonstration of a task is judged by none; two by one another."""
    alone = calibrate([d for d in demonstrations if d.task == OTHER][:1] + demonstrations[:3])
    places = [i for i, task in enumerate(alone.scores.tasks) if task == OTHER]
    apart = calibrate([d for d in demonstrations if d.task == OTHER][:1], references=demonstrations)
    assert apart.held_out
    assert min(apart.scores.extremes[0]) <= 1.0
    assert alone.scores.extremes[places[0]] != apart.scores.extremes[0]


def test_a_calibrated_run_says_what_its_threshold_rests_on(
    demonstrations: list[Demonstration], tmp_path: Path
) -> None:
    file = tmp_path / "calibration.toml"
    write_calibration(file, calibrate(demonstrations, level=0.2))
    good = ran(demonstrations, name="scene-graph", calibration=file)
    assert good.success
    for verdict in verdicts(good):
        assert verdict.calibration is Calibration.CALIBRATED
        assert verdict.p_value is not None and 0 < verdict.p_value <= 1
        assert "at most 0.2 false alarms per run by 10 good runs of the task" in verdict.note
    bad = ran(demonstrations, "tray-full", name="scene-graph", calibration=file)
    first = next(v for v in verdicts(bad) if v.decision is Decision.REPLAN)
    assert first.p_value == pytest.approx(1 / 11)
    assert first.calibration is Calibration.CALIBRATED


def test_too_few_demonstrations_are_visible_in_every_verdict(
    demonstrations: list[Demonstration], tmp_path: Path
) -> None:
    file = tmp_path / "calibration.toml"
    write_calibration(file, calibrate(demonstrations, level=0.01))
    for verdict in verdicts(ran(demonstrations, name="scene-graph", calibration=file)):
        assert verdict.calibration is Calibration.UNCALIBRATED
        assert verdict.threshold == 0.9
        assert "87 more are needed" in verdict.note


def test_preconditions_are_calibrated_by_counted_alarms(
    demonstrations: list[Demonstration], tmp_path: Path
) -> None:
    file = tmp_path / "calibration.toml"
    given = Given.named({"detector.name": "preconditions"})
    write_calibration(file, calibrate(demonstrations, given, level=0.2))
    bad = ran(demonstrations, "tray-full", name="preconditions", calibration=file)
    first = next(v for v in verdicts(bad) if v.decision is Decision.REPLAN)
    assert (first.calibration, first.threshold) == (Calibration.CALIBRATED, 0.5)
    assert first.p_value == pytest.approx(1 / 11)


def test_a_judge_that_alarms_in_good_runs_is_silent_under_the_bound(
    demonstrations: list[Demonstration], tmp_path: Path
) -> None:
    file = tmp_path / "calibration.toml"
    made = calibrate(demonstrations, Given.named({"detector.name": "preconditions"}), level=0.2)
    rows = tuple(tuple(0.0 for _ in row) for row in made.scores.extremes)
    write_calibration(file, replace(made, scores=replace(made.scores, extremes=rows)))
    bad = ran(demonstrations, "tray-full", name="preconditions", calibration=file)
    silenced = [v for v in verdicts(bad) if "too many good runs had one" in v.note]
    assert silenced
    assert not any(v.judged for v in silenced)
    assert all(v.decision is Decision.PROCEED and v.score is None for v in silenced)


def test_a_monitor_takes_it_and_other_options_or_demonstrations_are_refused(
    demonstrations: list[Demonstration], tmp_path: Path
) -> None:
    file = tmp_path / "calibration.toml"
    write_calibration(file, calibrate(demonstrations, level=0.2))
    said = {"name": "scene-graph", "calibration": file}

    def monitor(memory: list[Demonstration], **more: object) -> Monitor:
        return Monitor.from_demonstrations(
            memory, "bench", detector={**said, **more}, perceiver="given-graph"
        )

    assert monitor(demonstrations).demonstrations
    with pytest.raises(InputError, match=r"with state_weight = 0\.15, this run has 0\.3"):
        monitor(demonstrations, state_weight=0.3)
    with pytest.raises(InputError, match="with 12 demonstrations, and this run compares with 11"):
        monitor(demonstrations[1:])
    with pytest.raises(InputError, match="is of scene-graph, not of preconditions"):
        monitor(demonstrations, name="preconditions")
    with pytest.raises(InputError, match=r"gone\.toml"):
        monitor(demonstrations, calibration=tmp_path / "gone.toml")


def test_what_other_eyes_saw_of_the_same_runs_is_another_memory(
    demonstrations: list[Demonstration], tmp_path: Path
) -> None:
    file, memory = tmp_path / "calibration.toml", tmp_path / "memory.db"
    write_calibration(file, calibrate(demonstrations, level=0.2))
    said = {"name": "scene-graph", "calibration": file}

    def monitor(source: object) -> Monitor:
        return Monitor.from_demonstrations(source, "bench", detector=said, perceiver="given-graph")

    with open_store(memory, create=True) as store:
        for d in demonstrations:
            store.add(d)
    assert monitor(memory).demonstrations
    assert monitor(demonstrations[::-1]).demonstrations

    def blind(graph: SceneGraph) -> SceneGraph:
        nodes = (replace(n, states=tuple((a, None) for a, _ in n.states)) for n in graph.nodes)
        return replace(graph, nodes=tuple(nodes))

    for other in (
        replace(demonstrations[0], perception=(("state_estimator", "other"),)),
        replace(
            demonstrations[0],
            steps=tuple(
                replace(s, graph=blind(s.graph), whole=blind(s.whole))
                for s in demonstrations[0].steps
            ),
        ),
    ):
        with pytest.raises(InputError, match="others or were seen otherwise: run forestall"):
            monitor([other, *demonstrations[1:]])


def test_later_runs_as_good_as_before_speak_for_it(demonstrations: list[Demonstration]) -> None:
    made = calibrate(demonstrations)
    later = [judged_in(ran(demonstrations, seed=s), made.scores.judges) for s in range(4)]
    (test,) = still_fits(made, later).values()
    assert test.added == 4
    assert not test.broken(0.05)
    strange = [
        replace(r, boundaries=tuple(replace(b, score=-float(i)) for b in r.boundaries))
        for i, r in enumerate(later * 10)
    ]
    (test,) = still_fits(made, strange).values()
    assert test.broken(0.05)


@pytest.mark.slow
def test_the_measured_false_alarms_are_within_the_bound(tmp_path: Path) -> None:
    """Twenty-four good runs calibrate, sixty others are held out: a binomial bound on alarms."""
    known, others = recorded(TASK, 24), recorded(TASK, 60, first=24)
    made = calibrate(known, level=0.2)
    judged = calibrate(others, references=known, level=0.2)
    columns = made.fit(TASK).lines
    alarms = sum(
        any(x.threshold is not None and s < x.threshold for x, s in zip(columns, row, strict=True))
        for row in judged.scores.extremes
    )
    assert alarms <= 23  # of 60 at 0.2: more has a chance below 1 in 1,000


def test_the_command_writes_file_and_picture(
    demonstrations: list[Demonstration], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    memory, out = tmp_path / "memory.db", tmp_path / "calibration.toml"
    with open_store(memory, create=True) as store:
        for d in demonstrations:
            store.add(d)
    args = ["calibrate", str(memory), "--quiet", "--level", "0.25", "--out", str(out)]
    assert call([*args, "--judge", "scene-graph", "plan-check"]) == 0
    printed = capsys.readouterr().out
    assert "12 good runs" in printed
    assert "its own" in printed and "all tasks" in printed
    assert "0.05 needs 39" in printed
    assert "<svg" in out.with_suffix(".svg").read_text(encoding="utf-8")
    run = ["run", TASK, "--memory", str(memory), "--detector.calibration", str(out), "--quiet"]
    folder = tmp_path / "run"
    assert call([*run, "--out", str(folder)]) == 0
    assert call([*args, "--judge", "scene-graph", "--later", str(folder)]) == 0
    assert "still fits (1 later runs" in capsys.readouterr().out
    assert call(["calibrate", str(memory), "--level", "0.001"]) == 0
    assert "uncalibrated" in capsys.readouterr().out
    assert call([*args, "--judge", "image"]) == 2
    assert "unknown judge that can be calibrated 'image'" in capsys.readouterr().err
    assert call(["calibrate", str(memory), "--level", "2"]) == 2


@pytest.mark.parametrize("detector", ["scene-graph", "preconditions"])
def test_of_all_that_watch_only_the_runs_own_detector_is_calibrated(
    demonstrations: list[Demonstration], tmp_path: Path, detector: str
) -> None:
    file = tmp_path / "calibration.toml"
    given = Given.named({"detector.name": detector})
    write_calibration(file, calibrate(demonstrations, given, level=0.2))
    said = {"name": detector, "calibration": file}
    config = run_config(TASK, seed=3, given=SYMBOLIC, detector=said, strategy="watch")
    record = run_episode(prepare(config), demonstrations)
    calibrated = {
        v.detector
        for b in record.boundaries
        for v in b.watched
        if v.calibration is Calibration.CALIBRATED
    }
    assert calibrated == {detector}
