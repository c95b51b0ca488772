"""An episode of the kitchen, kept in every kind of log and added back: the same memory, and so the
same verdicts, as the one that was recorded directly.
"""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from small_kitchens import logged

from forestall.assembly.checking import Judgements, Question, judge_stored
from forestall.assembly.configuration import Given
from forestall.assembly.recorded import import_into, open_data
from forestall.assembly.replaying import replay, runs_of
from forestall.assembly.tables import LOGS
from forestall.memory.recording import demonstration_from
from forestall.memory.store import open_store
from forestall.types.decision import Outcome
from forestall.types.demonstration import Demonstration
from forestall.types.episode import EpisodeRecord

pytestmark = [pytest.mark.slow, pytest.mark.simulator]

TASK, SCENARIO = "heat-potato", "microwave-occupied"
NEEDS = {"lerobot": ("pyarrow",), "mcap": ("mcap", "mcap_ros2")}


def kinds() -> list[str]:
    """Logs whose packages are installed."""
    from importlib.util import find_spec

    return [k for k in LOGS if all(find_spec(m) is not None for m in NEEDS.get(k, ()))]


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> tuple[EpisodeRecord, dict[str, Path]]:
    """A good run, and its logs."""
    record, places = logged(tmp_path_factory.mktemp("good"), kinds(), TASK)
    assert record.success, record.failures
    assert record.notes == ()
    return record, places


@pytest.fixture(scope="module")
def failing(tmp_path_factory: pytest.TempPathFactory) -> tuple[EpisodeRecord, dict[str, Path]]:
    """A run in which something is in the way, and its logs."""
    record, places = logged(tmp_path_factory.mktemp("failing"), kinds(), TASK, SCENARIO)
    assert not record.success
    return record, places


def imported(kind: str, log: Path, out: Path) -> Demonstration:
    opened = open_data(kind, log, Given())
    report = import_into(opened, out)
    assert (len(report.good), report.unread, report.notes) == (1, [], {})
    with open_store(out / "memory.db") as store:
        (found,) = store.required()
    return found


def judged(record: EpisodeRecord, memory: Demonstration, folder: Path) -> Judgements:
    """What a monitor with one demonstration says of every scene of a run."""
    folder.mkdir()
    steps = []
    for number, boundary in enumerate(record.boundaries):
        if boundary.index < len(record.initial_plan):
            text = json.dumps(boundary.graph.to_json())
            (folder / f"{number:03d}.json").write_text(text)
            steps.append(boundary)
    plan = "; ".join(str(b.subtask) for b in steps)
    return judge_stored([folder], Question(plan=plan, task=TASK), [memory])


def said(found: Judgements) -> list[object]:
    return [
        (j.decision.outcome, j.decision.verdict, j.decision.diagnosis, j.decision.why)
        for j in found.each
    ]


@pytest.mark.parametrize("kind", LOGS)
def test_what_is_added_back_judges_as_what_was_recorded(
    kind: str,
    good: tuple[EpisodeRecord, dict[str, Path]],
    failing: tuple[EpisodeRecord, dict[str, Path]],
    tmp_path: Path,
) -> None:
    record, places = good
    if kind not in places:
        pytest.skip(f"the extra [{kind}] is not installed")
    direct = demonstration_from(record, "as recorded")
    assert direct is not None
    back = imported(kind, places[kind], tmp_path / "out")
    assert back.task == direct.task
    assert back.scene == direct.scene
    for ours, theirs in zip(direct.steps, back.steps, strict=True):
        assert theirs.subtask == ours.subtask
        assert theirs.whole == ours.whole
        assert theirs.graph == ours.graph
    assert back.final == direct.final
    one = judged(failing[0], replace(direct, id=back.id), tmp_path / "direct")
    two = judged(failing[0], back, tmp_path / "back")
    assert one.outcome is not Outcome.PROCEED
    assert said(two) == said(one)


@pytest.mark.parametrize("kind", LOGS)
def test_a_replayed_log_is_judged_as_it_would_have_been(
    kind: str,
    good: tuple[EpisodeRecord, dict[str, Path]],
    failing: tuple[EpisodeRecord, dict[str, Path]],
) -> None:
    if kind not in failing[1]:
        pytest.skip(f"the extra [{kind}] is not installed")
    direct = demonstration_from(good[0], "as recorded")
    assert direct is not None
    opened = open_data(kind, failing[1][kind], Given())
    (run,) = runs_of(opened, None)
    found = replay(opened, run, [direct])
    seen = {b.index: b.graph for b in failing[0].boundaries}
    assert len(found.timeline) == len(failing[0].executed)
    for one, executed in zip(found.timeline, failing[0].executed, strict=True):
        assert one.judgement.record.graph == seen[executed.index]
        assert one.ended == executed.outcome.status.value
    alarms = [str(s.judgement.record.subtask) for s in found.timeline if s.judgement.alarm]
    assert "put_in(Plate-1, Microwave-1)" in alarms
