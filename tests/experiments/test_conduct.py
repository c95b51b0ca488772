"""Experiments: which episodes, resumed after a kill, refused where they do not fit."""

from __future__ import annotations

import errno
import json
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import IO, Any

import pytest

from experiments.episodes import DEADLY, computed_row, deadly_row
from forestall.assembly.configuration import Given
from forestall.errors import FileFormatError, ForestallError, InputError
from forestall.experiments.conduct import Experiment, conduct, implied
from forestall.experiments.folder import ABOUT, EFFORT, ROWS, ResultsFolder, episodes_in
from forestall.experiments.runs import PART, QUICK_TASKS, Choice, Run, by_scene, runs_for
from forestall.experiments.settings import Settings
from forestall.experiments.worker import Work
from forestall.statistics.cases import CASE_SETS, FURTHER_SETS, Case, cases
from forestall.statistics.rows import EpisodeRow

pytestmark = pytest.mark.slow

CHOICE = Choice("proactive", "development", limit=2, profiles=("kind",))
SMALL = Experiment(CHOICE, workers=2)


def quiet(done: int, total: int, what: str) -> None:
    """No progress."""


def play(experiment: Experiment, out: Path, compute: object = computed_row) -> list[EpisodeRow]:
    if compute is computed_row:  # which kills no worker
        experiment = replace(experiment, engine="inline")
    return conduct(experiment, out, quiet, compute, lambda *a: None)  # type: ignore[arg-type]


def test_splits_share_no_seed_and_every_failing_case_has_its_twin() -> None:
    for of in CASE_SETS:
        development, test = cases(of, "development"), cases(of, "test")
        assert {c.seed for c in development}.isdisjoint(c.seed for c in test)
        assert len(set(test)) == len(test)
    undisturbed = set(cases("undisturbed", "test"))
    for of in ("robofail", "irreversible", "harmless"):
        found = cases(of, "test")
        assert {c.twin for c in found} <= undisturbed
    assert len(cases("robofail", "test")) == 100
    assert len(cases("irreversible", "test")) >= 50
    assert len(undisturbed) >= 100
    assert len(cases("harmless", "test")) >= 100
    assert len(cases("robofail", "test", rounds=2)) == 200
    with pytest.raises(InputError, match="seeds"):
        cases("robofail", "test", rounds=0)
    with pytest.raises(InputError, match="development"):
        cases("robofail", "dev")


def test_all_holds_the_strategies_in_both_households_and_each_episode_once() -> None:
    everything = runs_for(Choice("all", part=1.0))
    assert len(set(everything)) == len(everything)
    assert len({r.key for r in everything}) == len(everything)
    assert set(runs_for(Choice("proactive", profiles=("kind",)))) <= set(everything)
    assert {r.profile for r in runs_for(Choice("proactive"))} == {"honest"}, "unless it is said"
    honest = [r for r in everything if r.profile == "honest"]
    assert {r.case.set for r in honest} == {*CASE_SETS, *FURTHER_SETS}
    assert {r.case.set for r in everything if r.profile == "kind"} == set(CASE_SETS)
    watched = {r.case for r in honest if r.strategy == "watch"}
    assert {c.twin for c in watched} <= watched
    acted = {s: {r.case for r in honest if r.strategy == s} for s in ("proactive", "post-hoc")}
    assert acted["proactive"] == acted["post-hoc"], "compared on the same cases"
    assert {(r.strategy, r.model) for r in honest} >= {
        (s, m) for s in ("proactive", "plan-check") for m in ("exact", "coarse", "wrong")
    }


def test_a_quick_experiment_is_a_balanced_tenth() -> None:
    quick, usual, whole = (
        runs_for(Choice("all", **how)) for how in ({"quick": True}, {}, {"part": 1.0})
    )
    for some, part in ((quick, PART / 10), (usual, PART), (whole, 1.0)):
        for of in (*CASE_SETS, *FURTHER_SETS):
            every = cases(of, "test", further=True)
            found = {r.case for r in some if r.case.set == of and r.profile == "honest"}
            if of == "undisturbed":
                others = {r.case for r in some if r.profile == "honest"} - found
                if some is quick:
                    assert len(found) == 1
                    continue
                assert found >= {c.twin for c in others if c.twin.set == of}
                assert len(found) <= max(1, len(others))
                continue
            assert len(found) == max(1, round(len(every) * part))
            assert len({c.task for c in found}) == min(len(found), len({c.task for c in every}))
        of_kind = {r.case.task for r in some if r.profile == "kind"}
        assert len(of_kind) >= (1 if some is quick else 4), "not one task alone"
    assert {r.case for r in usual} <= {r.case for r in whole} >= {r.case for r in quick}
    rooms = {(r.profile, r.case.task, r.case.seed) for r in quick}
    assert len(rooms) == QUICK_TASKS + 2, "those of the sets, a long one, the kind one"
    honest = {r.case for r in usual if r.profile == "honest"}
    long = {"long", "long-undisturbed"}
    assert {c.twin for c in honest if c.set not in long} <= honest
    disturbed = {c for c in honest if c.set != "undisturbed"}
    assert len({(c.task, c.seed) for c in disturbed}) > len(disturbed) / 2, "many rooms"


def test_what_is_not_possible_is_said_with_what_is() -> None:
    for name in ("detection", "ablation"):
        assert runs_for(Choice(name, profiles=("kind",)))
    for wrong, why in (
        (Choice("all", profiles=("kindly",)), "did you mean kind"),
        (Choice("all", demonstrations=33), "1 to 32"),
        (Choice("all", part=0.0), "above 0"),
    ):
        with pytest.raises(InputError, match=why):
            runs_for(wrong)
    with pytest.raises(InputError, match="ablation"):
        runs_for(Choice("ablations"))
    some = runs_for(Choice("all", sets=("robofail",), strategies=("proactive",)))
    assert {(r.case.set, r.strategy) for r in some} == {("robofail", "proactive")}
    few = runs_for(Choice("proactive", tasks=("make-coffee",), sets=("robofail", "undisturbed")))
    assert {r.case.task for r in few} == {"make-coffee"}
    assert {r.case.set for r in few} == {"robofail", "undisturbed"}
    for wrong in (
        Choice("all", sets=("robofails",)),
        Choice("all", strategies=("proactve",)),
        Choice("all", tasks=("make-cofee",)),
    ):
        with pytest.raises(InputError, match="did you mean"):
            runs_for(wrong)
    with pytest.raises(InputError, match="no run of strategy online on undisturbed"):
        runs_for(
            Choice(
                "proactive",
                sets=("undisturbed",),
                strategies=("online",),
                profiles=("kind",),
            )
        )
    with pytest.raises(InputError, match="limit"):
        runs_for(Choice("all", limit=0))


def test_a_limit_takes_cases_of_all_tasks_in_turn() -> None:
    chosen = Choice("proactive", limit=10, profiles=("kind",))
    runs = [r for r in runs_for(chosen) if r.case.set == "robofail"]
    assert len({r.case.task for r in runs}) == 10
    assert len({r.case for r in runs}) == 10


def test_the_unmonitored_run_of_a_case_comes_first_within_its_scene() -> None:
    for group in by_scene(runs_for(Choice("all", limit=5))):
        assert len({r.scene for r in group}) == 1
        for run in group:
            alone = replace(run, strategy="watch", without=None, model="exact")
            assert group.index(alone) <= group.index(run)


def test_a_killed_experiment_goes_on_where_it_was(tmp_path: Path) -> None:
    whole = play(SMALL, tmp_path / "whole")
    lines = (tmp_path / "whole" / ROWS).read_text().splitlines(keepends=True)
    assert len(lines) == len(whole) == len(runs_for(CHOICE))
    half = tmp_path / "half"
    half.mkdir()
    (half / ABOUT).write_bytes((tmp_path / "whole" / ABOUT).read_bytes())
    (half / ROWS).write_text("".join(lines[:5]) + lines[5][:40])
    told: list[int] = []
    rows = conduct(SMALL, half, lambda d, t, w: told.append(d), computed_row, lambda *a: None)
    assert told[0] == 5
    assert told[-1] == len(whole)
    assert [r.key for r in rows] == [r.key for r in whole]
    assert (half / ROWS).read_text().startswith("".join(lines[:5]))
    again = play(SMALL, half, deadly_row)  # nothing is left to compute
    assert again == rows


@pytest.mark.slow
def test_a_worker_that_dies_leaves_a_failed_episode_and_no_smaller_table(tmp_path: Path) -> None:
    choice = replace(CHOICE, strategies=("none", "proactive"))  # each death is a start of a worker
    rows = play(Experiment(choice, workers=1), tmp_path, deadly_row)
    broken = [r for r in rows if r.end == "error"]
    assert len(rows) == len(runs_for(choice))
    assert {r.task for r in broken} == {DEADLY}
    assert all("died" in r.error and not r.success for r in broken)


def test_results_of_other_code_or_settings_are_not_mixed_in(tmp_path: Path) -> None:
    play(SMALL, tmp_path)
    with pytest.raises(InputError, match="split"):
        play(replace(SMALL, choice=replace(CHOICE, split="test")), tmp_path)
    with pytest.raises(InputError, match="states"):
        play(replace(SMALL, settings=Settings(Given.named({"states": "oracle"}))), tmp_path)
    about = json.loads((tmp_path / ABOUT).read_text())
    (tmp_path / ABOUT).write_text(json.dumps(about | {"version": "0.0.1"}))
    with pytest.raises(InputError, match=r"version '0\.0\.1'"):
        play(SMALL, tmp_path)


def test_two_commands_do_not_write_to_one_folder(tmp_path: Path) -> None:
    play(SMALL, tmp_path)
    with (
        episodes_in(tmp_path).alone(),
        pytest.raises(InputError, match="written by process"),
    ):
        play(SMALL, tmp_path)


def test_telling_pages_are_those_of_the_shipped_monitor_in_every_household(tmp_path: Path) -> None:
    runs = Choice("all", "development", limit=2).runs()
    settings = Settings(pages="telling")
    telling = [r for r in runs if Work(r, settings, str(tmp_path)).page_folder]
    assert {r.profile for r in telling} == {"honest", "kind"}
    assert {(r.strategy, r.model, r.without) for r in telling} == {("proactive", "exact", None)}
    assert len({(r.profile, r.case) for r in telling}) == len(telling)
    acted = {(r.profile, r.case) for r in runs if r.strategy == "proactive"}
    assert {(r.profile, r.case) for r in telling} == acted


def test_a_call_that_was_killed_while_it_noted_itself_is_no_call(tmp_path: Path) -> None:
    play(SMALL, tmp_path)
    calls = episodes_in(tmp_path).asked()
    rows = (tmp_path / ROWS).read_text().splitlines(keepends=True)
    (tmp_path / ROWS).write_text("".join(rows[:-1]))
    with (tmp_path / EFFORT).open("a") as lines:
        lines.write('{"choice": {"exp')
    play(SMALL, tmp_path)
    assert episodes_in(tmp_path).asked() == calls
    assert "episodes" in episodes_in(tmp_path).effort()["duration"]


def test_reading_while_another_writes_takes_nothing_away(tmp_path: Path) -> None:
    play(SMALL, tmp_path)
    with (tmp_path / ROWS).open("a") as lines:
        lines.write('{"format": 1, "set"')
    before = (tmp_path / ROWS).read_bytes()
    assert len(episodes_in(tmp_path).rows()) == len(runs_for(CHOICE))
    assert (tmp_path / ROWS).read_bytes() == before


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"workers": 0}, "jobs"),
        ({"engine": "slurm"}, "local, ray"),
        ({"settings": Settings(Given.named({"states": "learnd"}))}, "did you mean learned"),
        ({"settings": Settings(Given.named({"encoder": "words"}))}, "hashed-words"),
        ({"settings": Settings(pages="every")}, "telling"),
        ({"settings": Settings(Given.named({"memory": "nowhere.db"}))}, "nowhere.db"),
    ],
)
def test_what_cannot_be_is_said_before_anything_is_run(
    tmp_path: Path, changes: dict[str, Any], what: str
) -> None:
    with pytest.raises(ForestallError, match=what):
        play(replace(SMALL, **changes), tmp_path / "out", deadly_row)
    assert not (tmp_path / "out").exists()


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "precious.txt").write_text("mine")
    with pytest.raises(InputError, match="another --out"):
        play(SMALL, tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file"):
        play(SMALL, tmp_path / "file")


def test_a_damaged_line_is_named(tmp_path: Path) -> None:
    play(SMALL, tmp_path)
    lines = (tmp_path / ROWS).read_text().splitlines()
    lines[2] = json.dumps(json.loads(lines[2]) | {"format": 0})
    (tmp_path / ROWS).write_text("\n".join(lines) + "\n")
    with pytest.raises(FileFormatError, match="line 3: a result of format 0"):
        play(SMALL, tmp_path)


def test_a_full_disk_is_said_and_what_was_finished_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Full(StringIO):
        def flush(self) -> None:
            raise OSError(errno.ENOSPC, "No space left on device")

    real, calls = ResultsFolder.add, []

    def add(self: ResultsFolder[EpisodeRow], lines: IO[str], row: EpisodeRow) -> None:
        calls.append(row)
        real(self, Full() if len(calls) == 3 else lines, row)

    monkeypatch.setattr(ResultsFolder, "add", add)
    with pytest.raises(ForestallError, match="No space left on device"):
        play(SMALL, tmp_path)
    assert len((tmp_path / ROWS).read_text().splitlines()) == 2


def test_a_run_is_spared_only_where_its_detector_never_alarms() -> None:
    case = Case("robofail", "heat-potato", "microwave-occupied", 10_000)
    watched = EpisodeRow.from_json(computed_row_of(Run(case, "watch")))
    rows = {watched.key: watched}
    assert min(s for j in watched.judged if (s := j.scores["image"]) is not None) == 0.86
    found = implied(Run(case, "proactive", "image", 0.85), rows)
    assert found is not None
    assert found.implied
    assert found.key == Run(case, "proactive", "image", 0.85).key
    assert found.success == watched.success
    assert implied(Run(case, "proactive", "image", 0.90), rows) is None
    assert implied(Run(case, "proactive", "scene-graph", 0.85), rows) is None
    looked = replace(watched, judged=(replace(watched.judged[0], looks=2), *watched.judged[1:]))
    assert implied(Run(case, "proactive", "image", 0.85), {looked.key: looked}) is None
    assert implied(Run(case, "proactive", "image", 0.85), {}) is None


def computed_row_of(run: Run) -> dict[str, object]:
    from forestall.experiments.worker import Work

    return computed_row(Work(run, Settings()))


def test_a_quick_experiment_has_every_strategy_and_model_and_fewer_demonstrations() -> None:
    quick, usual = runs_for(Choice("all", quick=True)), runs_for(Choice("all"))
    honest = [[r for r in some if r.profile == "honest"] for some in (quick, usual)]
    who = [{(r.strategy, r.model) for r in some} for some in honest]
    assert who[0] == who[1]
    assert {r.demonstrations for r in honest[0]} == {"1 varied"}
    assert {r.demonstrations for r in honest[1]} == {"8 varied"}
    of = Choice("all", quick=True, demonstrations=4).runs()
    assert "4 varied" in {r.demonstrations for r in of}, "as was said"
    assert len(quick) * 4 < len(usual)


def test_in_a_transfer_nobody_has_shown_the_task_at_hand() -> None:
    runs = runs_for(Choice("transfer", profiles=("honest", "kind")))
    assert {r.strategy for r in runs} == {"watch"}
    assert {r.case for r in runs if r.profile == "honest"} == {
        r.case for r in runs_for(Choice("all", strategies=("watch",), profiles=("honest",)))
    }
    for run in runs:
        assert run.case.task not in run.shown_in
        assert len(run.shown_in) == (9 if run.case.task in TEN else 10)
    assert {r.demonstrations for r in runs} == {"8 varied of other tasks", "4 of other tasks"}
    assert len({r.key for r in runs}) == len(runs)
    own = runs_for(Choice("all"))
    assert {r.shown_in for r in own} == {(r.case.task,) for r in own}


TEN = {c.task for c in cases("undisturbed", "test")}
