"""A recorded run as a world that can be looked at, and what a monitor would have said of it."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from log_samples import HEAD, STEPS, observation, run, write

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.log_folder import FolderWriter
from forestall.assembly.make import prepare, run_episode
from forestall.cli.main import call
from forestall.errors import InputError
from forestall.logs.layout import Layout, Step
from forestall.logs.moments import chosen, moments_of, notes_of
from forestall.logs.writing import Executed, LogWriter
from forestall.records.record import RunRecorder
from forestall.types.episode import SkillStatus
from forestall.types.plan import Subtask
from forestall.types.recorded import Look
from forestall.worlds.replay.world import ReplayWorld
from perception.synthetic import Solid, at, looking, observed

SYMBOLIC = Given.named({"world": "symbolic", "perceiver": "given-graph"})


def looks() -> Iterator[Look]:
    yield Look(observation(0, 0.0))
    yield Look(observation(1, 2.5), (0,), 0)
    yield Look(None, (1,), None)


def test_a_replay_shows_what_was_seen_and_refuses_to_act() -> None:
    world = ReplayWorld("a run", looks)
    with pytest.raises(InputError, match="was not begun"):
        world.observe()
    for _ in range(2):
        world.reset(7)
        assert world.time_s == world.scan(thorough=True).time_s == 0.0
        assert world.follow()
        assert world.observe([(1.0, 2.0, 0.5)]).time_s == world.time_s == 2.5
        assert not world.follow()
        assert world.next is not None
        assert world.next.before == (1,)
    with pytest.raises(InputError, match=r"a run is a recording, .* \(pick_up\(Potato\)\)"):
        world.execute(Subtask.parse("pick_up(Potato)"))
    with pytest.raises(InputError, match="drive to Potato"):
        world.approach("Potato")
    world.hold()
    assert world.time_s == 2.5
    with pytest.raises(InputError, match="nothing was recorded"):
        ReplayWorld("empty", lambda: iter(())).reset(0)


def recorded(folder: Path, task: str, scenario: str | None = None) -> Path:
    """The record of a run in a symbolic world."""
    config = run_config(task, scenario, seed=3, given=SYMBOLIC, strategy="none", final_look=True)
    run_episode(prepare(config), None, [RunRecorder(folder)])
    return folder


def test_a_record_is_judged_as_it_was_recorded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = recorded(tmp_path / "good", "fasten-plate")
    recorded(tmp_path / "runs" / "good", "fasten-plate")
    bad = recorded(tmp_path / "runs" / "bad", "fasten-plate", "hole-full-of-chips")
    flags = ["--domain", "bench"]
    assert call(["import", "record", str(good), str(tmp_path / "out"), *flags, "--quiet"]) == 0
    assert "1 good runs" in capsys.readouterr().out
    memory = ["--memory", str(tmp_path / "out" / "memory.db")]
    assert call(["replay", f"record:{good}", *flags, *memory]) == 0
    told = capsys.readouterr().out
    assert "went well" in told
    code = call(["replay", f"record:{tmp_path / 'runs'}", *flags, *memory, "--json"])
    assert code == 1
    two = {one["run"]: one for one in json.loads(capsys.readouterr().out)}
    assert two["good"]["fails_at_step"] is None
    assert not any(moment["alarm"] for moment in two["good"]["timeline"])
    failing = two["bad"]
    alarms = [m["step"] for m in failing["timeline"] if m["alarm"]]
    assert alarms[0] <= failing["fails_at_step"]
    assert all(m["in_the_log"] in ("succeeded", "failed", "refused") for m in failing["timeline"])
    page = tmp_path / "page.html"
    more = ["--run", "bad", "--page", str(page)]
    assert call(["replay", f"record:{tmp_path / 'runs'}", *flags, *memory, *more]) == 1
    assert "BoltHole-1" in page.read_text()
    assert bad.is_dir()


def test_what_cannot_be_replayed_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(FolderWriter(tmp_path / "log"), run())
    assert call(["replay", f"folder:{tmp_path / 'log'}"]) == 2
    assert "--memory FILE, or --strategy plan-check" in capsys.readouterr().err
    plan_check = ["--strategy", "plan-check", "--states", "given"]
    assert call(["replay", f"folder:{tmp_path / 'log'}", "--run", "two", *plan_check]) == 2
    assert "unknown run 'two'" in capsys.readouterr().err
    assert call(["replay", str(tmp_path / "log"), *plan_check]) == 2
    assert "a data set and its folder are expected" in capsys.readouterr().err
    file = tmp_path / "log" / "run.json"
    file.write_text(file.read_text().replace(STEPS[1], "pick up"))
    assert call(["replay", f"folder:{tmp_path / 'log'}", *plan_check]) == 2
    assert "cannot read 'pick up' as a subtask" in capsys.readouterr().err


def test_runs_that_cannot_be_read_are_named_beside_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = recorded(tmp_path / "runs" / "good", "fasten-plate")
    flags = ["--domain", "bench", "--strategy", "plan-check"]
    assert call(["replay", f"record:{good}", *flags]) == 0
    cut = recorded(tmp_path / "runs" / "cut", "fasten-plate") / "record.json"
    cut.write_text(cut.read_text("utf-8")[:500], "utf-8")
    capsys.readouterr()
    command = ["replay", f"record:{tmp_path / 'runs'}", *flags]
    assert call(command) == 4
    out, err = capsys.readouterr()
    assert "good: went well" in out
    assert err.startswith("cut: not judged: ") and len(err.splitlines()) == 1
    assert call([*command, "--json"]) == 4
    judged, unread = json.loads(capsys.readouterr().out)
    assert (judged["run"], judged["why_not"]) == ("good", "") and judged["timeline"]
    assert (unread["run"], unread["timeline"]) == ("cut", []) and unread["why_not"] in err
    assert judged.keys() == unread.keys()
    assert call([*command, "--run", "good"]) == 0
    assert call([*command, "--run", "cut"]) == 2


COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
PLATE = at("Plate-1", 0.1, 0.3, 0.9, (0.22, 0.22, 0.02), True)
POSE = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))


def plate_log(writer: LogWriter, name: str, times_s: tuple[float, ...] = (0.0, 1.0, 4.0)) -> None:
    """Looks at a plate on a counter, which is said to be taken and put back."""
    writer.begin(replace(HEAD, name=name))
    for number, time_s in enumerate(times_s):
        writer.look(observed([COUNTER, PLATE], POSE, time_s=time_s))
        if number + 1 < len(times_s):
            done = Subtask.parse(("pick_up(Plate-1)", "put_on(Plate-1, CounterTop-1)")[number])
            writer.executed(Executed(done, SkillStatus.SUCCEEDED, ""))
    writer.finish(True, "")


def test_a_look_that_cannot_be_read_does_not_hide_the_other_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("one", "two"):
        (tmp_path / "logs").mkdir(exist_ok=True)
        plate_log(FolderWriter(tmp_path / "logs" / name), name)
    (tmp_path / "logs" / "one" / "0002" / "observation.json").unlink()
    command = ["replay", f"folder:{tmp_path / 'logs'}", "--strategy", "plan-check", "--json"]
    assert call(command) != 0
    judged, unread = json.loads(capsys.readouterr().out)
    assert (judged["run"], unread["run"]) == ("two", "one")
    assert "0002" in unread["why_not"]
    (tmp_path / "logs" / "two" / "0002" / "observation.json").unlink()
    assert call(command) == 2
    assert "no run of it can be used" in (err := capsys.readouterr().err) and "one: " in err


def test_a_step_that_no_picture_shows_as_it_begins_is_not_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mcap")
    from forestall.logs.mcap_out import McapWriter

    log, steps = tmp_path / "run.mcap", tmp_path / "steps.csv"
    plate_log(McapWriter(log), "run", (0.0, 3.0, 100.0))
    command = ["replay", f"mcap:{log}", "--steps", str(steps), "--strategy", "plan-check", "--json"]

    def told(*begins_s: float) -> tuple[int, list[tuple[str, str]], list[str]]:
        rows = [f"{s},navigate_to_obj(Plate-1)\n" for s in begins_s]
        steps.write_text("time_s,subtask\n" + "".join(rows), "utf-8")
        code = call(command)
        (one,) = json.loads(capsys.readouterr().out)
        return code, [(m["outcome"], m["why"]) for m in one["timeline"]], one["left_out"]

    code, said, left_out = told(0.5, 12.5)
    assert (code, [outcome for outcome, _ in said]) == (0, ["proceed", "proceed"])
    assert left_out == []
    code, said, left_out = told(-2.0, 0.5, 63.0)
    assert (code, [o for o, _ in said]) == (4, ["not judged", "proceed", "not judged"])
    early, late = said[0][1], said[2][1]
    assert early == "step 1 begins 2.0 s before the first picture"
    assert late.startswith("step 3 begins 60.0 s after the last picture before it: at most 10 s")
    assert left_out == [early, late]
    as_demonstration = ["import", "mcap", str(log), "--steps", str(steps), "--json"]
    call([*as_demonstration[:3], str(tmp_path / "stale"), *as_demonstration[3:]])
    report = json.loads(capsys.readouterr().out)
    assert report["good"] == 0 and report["why_not"][0]["why"].startswith(early)
    call([*as_demonstration[:3], "--dry-run", *as_demonstration[3:]])
    assert early in json.loads(capsys.readouterr().out)[0]["why_not"]
    told(0.5, 12.5)
    call([*as_demonstration[:3], str(tmp_path / "shown"), *as_demonstration[3:]])
    assert json.loads(capsys.readouterr().out)["good"] == 1


def test_of_pictures_none_that_is_stale_shows_a_step() -> None:
    seconds = [1_000_000_000 * s for s in (10, 11, 12)]
    begun = [Step(n, Subtask.parse(STEPS[0])) for n in (9_960_000_000, 11_500_000_000)]
    looks = chosen(seconds, begun, Layout())
    assert notes_of(moments_of(looks, begun, Layout().stale_s)) == []
    late = [Step(9_900_000_000, begun[0].subtask), Step(13_100_000_000, begun[0].subtask)]
    moments = moments_of(chosen(seconds, late, Layout()), late, Layout().stale_s)
    assert [number for m in moments for number, _ in m.unshown] == [0, 1]
    assert notes_of(moments_of(seconds, late)) == []


BAD_RUNS = [
    ({"format": 2}, "format 2: this version reads 1"),
    ({"looks": []}, "looks"),
    ({"more": 1}, "more"),
    ({"looks": [{"observation": "../log/0001"}]}, "nowhere when a subtask begins"),
    ({"looks": [{"observation": "0001", "executed": [{"subtask": STEPS[0]}]}]}, "looks.0"),
]


@pytest.mark.parametrize(("change", "said"), BAD_RUNS)
def test_a_run_file_that_says_something_else_is_refused(
    change: dict[str, object], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(FolderWriter(tmp_path / "log"), run())
    file = tmp_path / "log" / "run.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), **change}))
    command = ["import", "folder", str(tmp_path / "log"), "--dry-run", "--json"]
    assert call(command) == 0
    (one,) = json.loads(capsys.readouterr().out)
    assert said in one["why_not"]


def test_an_observation_outside_the_folder_is_not_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(FolderWriter(tmp_path / "log"), run())
    file = tmp_path / "log" / "run.json"
    file.write_text(file.read_text().replace('"0002"', '"../log/0002"'))
    assert call(["import", "folder", str(tmp_path / "log"), "--dry-run", "--json"]) == 0
    (one,) = json.loads(capsys.readouterr().out)
    assert "is no file inside the folder" in one["why_not"]


def test_a_log_that_cannot_be_kept_does_not_stop_the_run(tmp_path: Path) -> None:
    from forestall.assembly.logs import logging_to

    config = run_config("fasten-plate", seed=3, given=SYMBOLIC, strategy="none")
    with logging_to(f"folder:{tmp_path / 'log'}") as logs:
        record = run_episode(prepare(config), None, logs)
    assert record.success
    assert any("EpisodeLog failed in on_look" in note for note in record.notes)
    assert not (tmp_path / "log").exists()
    assert list(tmp_path.glob(".*")) == []
    assert all(e.outcome.status is SkillStatus.SUCCEEDED for e in record.executed)


def test_the_command_says_which_logs_there_are_and_when_one_broke_off(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["run", "fasten-plate", "--world", "symbolic", "--perceiver.name", "given-graph"]
    command += ["--strategy", "none", "--seed", "3", "--out", str(tmp_path / "run"), "--quiet"]
    assert call([*command, "--log", "mcap"]) == 2
    assert "what kind of log and where, one of folder:PATH" in capsys.readouterr().err
    assert call([*command, "--log", f"mcpa:{tmp_path / 'log'}"]) == 2
    assert "unknown log 'mcpa'" in capsys.readouterr().err
    assert call([*command, "--log", f"folder:{tmp_path / 'log'}"]) == 0
    assert "EpisodeLog failed in on_look" in capsys.readouterr().err
    assert not (tmp_path / "log").exists()
