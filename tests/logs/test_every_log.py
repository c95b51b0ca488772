"""What every kind of log keeps: all of a look to the bit, subtasks, how they ended, what failed."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from log_samples import STEPS, Run, run, write

from forestall.assembly.registry import data_set, log
from forestall.assembly.tables import DATA_SETS, LOGS
from forestall.domain.load import shipped
from forestall.errors import InputError
from forestall.logs.outlines import detections_of
from forestall.types.episode import SkillStatus
from forestall.types.observation import Observation
from forestall.types.recorded import RecordedRun, Unread

DOMAIN = shipped("household")
NEEDS = {"lerobot": ("pyarrow",), "mcap": ("mcap", "mcap_ros2")}
KINDS = [
    pytest.param(
        kind,
        marks=pytest.mark.skipif(
            any(find_spec(m) is None for m in NEEDS.get(kind, ())),
            reason=f"the extra [{kind}] is not installed",
        ),
    )
    for kind in LOGS
    if kind in DATA_SETS  # what is only shown cannot be read again
]


def read(kind: str, place: Path) -> RecordedRun | Unread:
    (found,) = data_set(kind)(place).runs(DOMAIN)
    assert isinstance(found, RecordedRun | Unread)
    return found


def kept(kind: str, folder: Path, told: Run, success: bool | None = True) -> RecordedRun | Unread:
    place = folder / "log"
    write(log(kind)(place), told, success)
    return read(kind, place)


def same(one: Observation, two: Observation) -> None:
    assert len(one.frames) == len(two.frames)
    for a, b in zip(one.frames, two.frames, strict=True):
        assert np.array_equal(a.rgb, b.rgb)
        assert np.array_equal(a.depth_m, b.depth_m)
        assert np.array_equal(a.camera_to_world, b.camera_to_world)
        assert a.intrinsics == b.intrinsics
        found = {d.instance or d.category: d for d in b.detections or ()}
        wanted = {d.instance or d.category: d for d in detections_of(a) or ()}
        assert found.keys() == wanted.keys()
        for name, detection in wanted.items():
            assert np.array_equal(found[name].mask, detection.mask)
            assert found[name].category == detection.category
            assert found[name].score == detection.score
    assert two.gripper == one.gripper
    assert two.others == one.others
    assert two.told == one.told
    assert two.time_s == one.time_s
    assert two.robot_position_world_m == one.robot_position_world_m


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("how", [{}, {"overlapping": True}, {"overlapping": True, "named": False}])
def test_all_of_a_run_comes_back(kind: str, how: dict[str, Any], tmp_path: Path) -> None:
    told = run(**how)
    found = kept(kind, tmp_path, told)
    assert isinstance(found, RecordedRun)
    assert found.plan.texts() == list(STEPS)
    assert (found.task, found.scene, found.name) == ("heat-potato", "kitchen-3", "one")
    assert found.fails is None
    looks = list(found.looks())
    assert [look.before for look in looks] == [(), (), (0,), (1,), (2,)]
    assert [look.done for look in looks] == [None, None, 0, 1, 2]
    for ours, theirs in zip(told.looks, looks, strict=True):
        assert theirs.observation is not None
        same(ours, theirs.observation)


@pytest.mark.parametrize("kind", KINDS)
def test_a_failing_run_says_where_and_why(kind: str, tmp_path: Path) -> None:
    statuses = (SkillStatus.SUCCEEDED, SkillStatus.REFUSED, SkillStatus.FAILED)
    found = kept(kind, tmp_path, run(statuses), success=False)
    assert isinstance(found, RecordedRun)
    assert (found.fails, found.kind, found.why) == (1, "refused", "stuck")
    looks = list(found.looks())
    assert [look.done for look in looks] == [None, None, 0, None, 2]
    assert [look.succeeded for look in looks] == [True, True, True, True, False]


@pytest.mark.parametrize("kind", KINDS)
def test_a_missed_goal_is_a_failure_of_the_last_step(kind: str, tmp_path: Path) -> None:
    found = kept(kind, tmp_path, run(), success=False)
    assert isinstance(found, RecordedRun)
    assert (found.fails, found.kind) == (2, "the goal was missed")


@pytest.mark.parametrize("kind", KINDS)
def test_who_did_not_look_at_the_end_shows_no_demonstration(kind: str, tmp_path: Path) -> None:
    found = kept(kind, tmp_path, run(looked_at_end=False))
    assert isinstance(found, Unread)
    assert "nobody looked after the last subtask, put_on(Potato-1, Plate-1)" in found.why
    failing = run((SkillStatus.SUCCEEDED, SkillStatus.SUCCEEDED, SkillStatus.REFUSED), False)
    found = kept(kind, tmp_path / "failing", failing, success=False)
    assert isinstance(found, RecordedRun)
    assert [look.observation is None for look in found.looks()][-1]


@pytest.mark.parametrize("kind", KINDS)
def test_what_ended_well_in_spite_of_a_refusal_is_told(kind: str, tmp_path: Path) -> None:
    statuses = (SkillStatus.SUCCEEDED, SkillStatus.REFUSED, SkillStatus.SUCCEEDED)
    found = kept(kind, tmp_path, run(statuses))
    assert isinstance(found, Unread)
    assert "step 2 was refused and the task succeeded all the same" in found.why


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_there_before_the_end_and_nothing_is_written_over(
    kind: str, tmp_path: Path
) -> None:
    place = tmp_path / "log"
    writer = log(kind)(place)
    from log_samples import HEAD

    writer.begin(HEAD)
    writer.look(run().looks[0])
    assert not place.exists()
    writer.abandon()
    assert list(tmp_path.iterdir()) == []
    write(log(kind)(place), run())
    with pytest.raises(InputError, match="is there already"):
        log(kind)(place)


@pytest.mark.parametrize("kind", KINDS)
def test_another_domain_than_that_of_the_log_is_said(kind: str, tmp_path: Path) -> None:
    place = tmp_path / "log"
    write(log(kind)(place), run())
    (found,) = data_set(kind)(place).runs(shipped("bench"))
    assert isinstance(found, Unread)
    assert "unknown skill" in found.why
