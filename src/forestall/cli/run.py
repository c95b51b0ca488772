"""`forestall run`: the main job."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

if TYPE_CHECKING:
    from forestall.build import RunConfig
    from forestall.types.demonstration import Demonstration

Json = Annotated[bool, Parameter(name="--json", negative="")]


def run(
    task: str,
    /,
    *,
    scenario: str | None = None,
    strategy: str = "proactive",
    seed: int = 0,
    out: Path | None = None,
    memory: Path | None = None,
    states: str = "learned",
    feature: str = "parts",
    encoder: str = "hashed-words",
    renderer: str = "auto",
    threshold: float = 0.9,
    detector: str = "scene-graph",
    without: str | None = None,
    image_encoder: str = "two-tower",
    captioner: str = "listing",
    as_json: Json = False,
    quiet: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Run one household task from pixels to a plan that works, and write a page about it.

    Args:
        task: a task's name (see `forestall tasks`) or a task file.
        scenario: what goes wrong (see `forestall scenarios`), or a scenario file.
        strategy: when a run may be interrupted: none, proactive, online,
            online-scene, post-hoc; watch lets every detector judge and never interrupts.
        seed: of the scene.
        out: folder for the record, its pictures and the page; a new one under runs/ by default.
        memory: a demonstration file; the ready-made one by default.
        states: where object states come from: learned (pixels, by the shipped encoder), clip
            (pixels, by CLIP, whose weights it needs), oracle (the simulator's truth).
        feature: what a node's feature encodes: text, parts (category and states) or image.
        encoder: of texts, for references and node features: hashed-words, two-tower, sentence.
        renderer: auto, embree, rays or gl.
        threshold: alarm when no demonstration reaches this score.
        detector: of a strategy that steps in: scene-graph, objects, caption or image.
        without: a part to leave out: subtask-node, structure, nodes, edges, reasoning, validation.
        image_encoder: of whole pictures, for the detector image: two-tower or clip.
        captioner: of whole pictures, for the detector caption: listing or blip.
        as_json: print one record as JSON and nothing else on standard output.
        quiet: no progress on standard error.
    """
    from forestall.build import RunConfig, prepare, run_episode
    from forestall.records.codec import record_to_json
    from forestall.records.listeners import ProgressLine
    from forestall.records.record import RunRecorder, read_record
    from forestall.report.page import write_page

    config = RunConfig(
        task,
        scenario,
        strategy,
        seed,
        renderer,
        states=states,
        feature=feature,
        encoder=encoder,
        threshold=threshold,
        detector=detector,
        without=without,
        image_encoder=image_encoder,
        captioner=captioner,
    )
    prepared = prepare(config)
    name = None if prepared.scenario is None else prepared.scenario.name
    folder = out or _new_folder(prepared.loaded.task.name, name, strategy, seed)
    folder.mkdir(parents=True, exist_ok=True)
    demonstrations, used = _memory(config, memory, quiet)
    page = folder / "index.html"
    recorder = RunRecorder(folder, page=str(page))
    with ProgressLine(quiet=quiet) as line:
        record = run_episode(prepared, demonstrations, [recorder, line], used)
    write_page(record, page)
    data = record_to_json(read_record(folder), page=str(page))
    if as_json:
        print(json.dumps(data, indent=2))
    else:
        _summary(data)
    return 0 if record.success else 1


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _memory(
    config: RunConfig, memory: Path | None, quiet: bool
) -> tuple[list[Demonstration] | None, str | None]:
    if config.strategy == "none":
        return None, None
    from forestall.cli.demos import load_memory

    return load_memory(
        memory,
        config.task,
        config.states,
        quiet,
        config.feature,
        config.image_encoder,
        config.captioner,
    )


def _new_folder(task: str, scenario: str | None, strategy: str, seed: int) -> Path:
    stamp = time.strftime("%Y%m%d-%H%M%S")
    folder = Path("runs") / "-".join((task, scenario or "undisturbed", strategy, str(seed), stamp))
    number = 2
    while folder.exists():
        folder = folder.with_name(f"{folder.name.partition('+')[0]}+{number}")
        number += 1
    return folder


def _summary(data: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.markup import escape

    console = Console(highlight=False)
    good = bool(data["success"])
    console.print(
        f"[bold {'green' if good else 'red'}]{'success' if good else 'failed'}[/] "
        f"{escape(str(data['task']))} · {escape(str(data['scenario'] or 'undisturbed'))} · "
        f"{data['strategy']} · seed {data['seed']}"
    )
    for failure in data["failures"]:
        console.print(f"  not reached: {escape(failure)}")
    for alarm in data["alarms"]:
        score = "plan check"
        if alarm["score"] is not None:
            score = f"score {alarm['score']:.2f} < {alarm['threshold']:.2f}"
        console.print(
            f"  alarm before {escape(alarm['subtask'])}: {score}: {escape(alarm['cause'] or '')}",
            soft_wrap=True,
        )
    console.print(
        f"  {len(data['executed'])} subtasks, {_count(data['replans'], 'new plan')}, "
        f"{data['simulated_s']:.0f} s of robot time, {data['reasoning_s']:.1f} s of reasoning; "
        f"states: {escape(str(data['perception']['state_estimator']))}",
        soft_wrap=True,
    )
    print(data["page"], file=sys.stdout)
