# mypy: disable-error-code="index, misc"
"""Workers: groups stay together, the dead are replaced, nothing is lost."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from experiments.jobs import broken, doubled, fatal
from forestall.errors import InputError, UnknownNameError
from forestall.experiments.engines import WorkerDiedError, computed, make_lanes


def test_every_job_is_answered_and_a_group_stays_with_one_worker() -> None:
    groups = [[1, 2, 3], [4], [], [5, 6]]
    found = dict(computed(groups, make_lanes("local", 2), doubled))
    assert {job: answer[0] for job, answer in found.items()} == {k: 2 * k for k in range(1, 7)}
    for group in groups:
        assert len({found[job][1] for job in group}) <= 1
    assert len({pid for _, pid in found.values()}) == 2


def test_a_job_that_need_not_be_computed_is_answered_here() -> None:
    known = {2: (0, -1), 3: (0, -1)}
    found = dict(computed([[1, 2], [3]], make_lanes("local", 1), doubled, known.get))
    assert found[1][0] == 2
    assert found[2] == found[3] == (0, -1)


def test_a_worker_that_dies_once_is_replaced_and_its_job_done_again(tmp_path: Path) -> None:
    job = (str(tmp_path), 1)
    assert dict(computed([[job]], make_lanes("local", 1), fatal)) == {job: 1}


def test_a_job_that_kills_twice_is_given_up_and_the_others_are_done(tmp_path: Path) -> None:
    for name in ("deadly", "fine"):
        (tmp_path / name).mkdir()
    deadly, fine = (str(tmp_path / "deadly"), 9), (str(tmp_path / "fine"), 0)
    found = dict(computed([[deadly, fine]], make_lanes("local", 1), fatal))
    assert isinstance(found[deadly], WorkerDiedError)
    assert found[fine] == 0
    assert len(list((tmp_path / "deadly").iterdir())) == 2


def test_an_error_of_the_function_itself_is_not_swallowed() -> None:
    with pytest.raises(ValueError, match="job 7"):
        list(computed([[7]], make_lanes("local", 1), broken))


def test_unknown_engines_are_named() -> None:
    with pytest.raises(UnknownNameError, match="local"):
        make_lanes("slurm", 1)


def test_without_ray_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"forestall\[cluster\]"):
        make_lanes("ray", 1)


def test_inline_work_is_done_here() -> None:
    found = dict(computed([[1, 2], [3]], make_lanes("inline", 2), doubled))
    assert found == {job: (2 * job, os.getpid()) for job in (1, 2, 3)}
    with pytest.raises(ValueError, match="job 7"):
        list(computed([[7]], make_lanes("inline", 1), broken))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_local_cluster_of_two_workers_gives_the_same_answers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ray = pytest.importorskip("ray")
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[1]))
    try:
        (tmp_path / "a").mkdir()
        found = dict(computed([[1, 2], [3, 4]], make_lanes("ray", 2), doubled))
        assert {job: answer[0] for job, answer in found.items()} == {1: 2, 2: 4, 3: 6, 4: 8}
        assert found[1][1] == found[2][1]
        assert len({pid for _, pid in found.values()}) == 2
        job = (str(tmp_path / "a"), 1)
        assert dict(computed([[job]], make_lanes("ray", 1), fatal)) == {job: 1}
    finally:
        ray.shutdown()
