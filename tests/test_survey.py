"""Many episodes: seeds, resuming, tables."""

import json
from pathlib import Path

import pytest

from forestall.errors import FileFormatError, InputError
from forestall.survey import Job, jobs_for, parse_seeds, survey, table


def row(job: Job, success: bool, alarms: int = 0) -> dict[str, object]:
    return {
        "task": job.task,
        "scenario": job.scenario,
        "strategy": job.strategy,
        "success": success,
        "boundaries": 10,
        "alarms": [{"index": k} for k in range(alarms)],
        "replans": 0,
    }


def test_seeds_are_read_and_those_of_demonstrations_refused() -> None:
    assert list(parse_seeds("100:103")) == [100, 101, 102]
    assert list(parse_seeds("7")) == [7]
    for text in ("a", "5:5", "-3:2", "1000000:1000001", "1:2:3"):
        with pytest.raises(InputError, match="seeds"):
            parse_seeds(text)


def test_jobs_are_checked_before_anything_runs() -> None:
    jobs = jobs_for(["toast-bread"], ["knife-blocked"], ["none"], [1, 2])
    assert [(j.task, j.scenario, j.seed) for j in jobs] == [
        ("toast-bread", None, 1),
        ("toast-bread", None, 2),
        ("toast-bread", "knife-blocked", 1),
        ("toast-bread", "knife-blocked", 2),
    ]
    with pytest.raises(InputError, match="toast-bread"):
        jobs_for(["toast-bred"], [], ["none"], [1])


def test_finished_episodes_are_not_run_again(tmp_path: Path) -> None:
    out = tmp_path / "episodes.jsonl"
    jobs = [Job("toast-bread", None, "none", seed) for seed in (1, 2)]
    lines = [json.dumps({"key": j.key, "row": row(j, True)}) for j in jobs]
    out.write_text("\n".join(lines) + "\n" + '{"key": "half')
    told: list[tuple[int, int]] = []
    rows = survey(jobs, 1, out, lambda done, total, what: told.append((done, total)))
    assert [r["success"] for r in rows] == [True, True]
    assert told == [(2, 2)]
    assert out.read_text().endswith("}\n")


def test_a_foreign_file_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "episodes.jsonl"
    out.write_text("hello\nworld\n")
    with pytest.raises(FileFormatError, match="line 1"):
        survey([], 1, out, lambda done, total, what: None)


def test_the_table_counts_and_gives_exact_intervals() -> None:
    jobs = [Job("toast-bread", None, "proactive", seed) for seed in range(20)]
    rows = [row(j, True, alarms=int(j.seed == 3)) for j in jobs]
    (line,) = table(rows)
    assert (line["succeeded"], line["n"], line["alarms"], line["runs_with_alarm"]) == (20, 20, 1, 1)
    assert line["low"] == pytest.approx(0.025 ** (1 / 20))  # Clopper-Pearson, no failure
    assert line["high"] == 1.0
