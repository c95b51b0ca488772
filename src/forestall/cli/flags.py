"""Flags that say which parts a command works with, and how their options are spelt.

`--detector.threshold 0.85` is short for `--set detector.threshold=0.85`; every option of a part can
be said that way, and every part (`--reasoner.name none`), in any command that takes parts.
A file (`--config`) says the same; flags come over it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter, UnknownOptionError

if TYPE_CHECKING:
    from forestall.assembly.configuration import Given

Flag = Annotated[bool, Parameter(negative="")]
"""Given or not; it has no opposite."""
Json = Annotated[bool, Parameter(name="--json", negative="")]
Names = Annotated[list[str] | None, Parameter(consume_multiple=True, negative="")]
"""One or several after the flag."""
Settings = Annotated[list[str] | None, Parameter(name="--set", negative="")]

_OPTION = re.compile(r"--([a-z][a-z-]*\.[\w-]+)(?:=(.*))?", re.DOTALL)


@Parameter(name="*")
@dataclass(frozen=True)
class SeeingFlags:
    """What a scene is seen with.

    Args:
        world: where the robot acts: kitchen, symbolic, ai2thor, frankakitchen, or
            package.module:Class.
        sensor: what the robot looks through: perfect, realsense, kinect, tof or realistic (stereo
            noise, pose and mask errors, no identities).
        domain: what the task is read in: household, bench, ai2thor, frankakitchen, or a file
            (.toml, .pddl); its own by default.
        segmenter: where masks come from: instance-ids (the simulator's), given-masks (a stored
            observation's own), finder (a detector's boxes, outlined).
        finder: of boxes, for the segmenter finder: grounding-dino, owlv2, onnx.
        outliner: of boxes, for the segmenter finder: depth, sam.
        states: where object states come from: learned (pixels, by the shipped encoder), clip or
            siglip (pixels, by a model whose weights it needs), oracle (the simulator's truth).
        feature: what a node's feature encodes: text, parts (category and states) or image.
        renderer: auto, embree, rays or gl.
        image_encoder: of whole pictures, for the detector image: two-tower, clip or siglip.
        captioner: of whole pictures, for the detector caption: listing or blip.
        config: a TOML file with a table for each kind of part; flags come over it.
        settings: one option of a part; --detector.threshold 0.85 is short for
            --set detector.threshold=0.85 (see `forestall parts`). Several values of one option
            stand between commas: --strategy.judges score,plan-check.
    """

    world: str | None = None
    sensor: str | None = None
    domain: str | None = None
    segmenter: str | None = None
    finder: str | None = None
    outliner: str | None = None
    states: str | None = None
    feature: str | None = None
    renderer: str | None = None
    image_encoder: str | None = None
    captioner: str | None = None
    config: Path | None = None
    settings: Settings = None

    def given(self) -> Given:
        """What flags and file say of the parts.

        Raises:
            InputError: an option that is not spelt right, or a file that is none.
        """
        return self.read()[0]

    def read(self) -> tuple[Given, dict[str, Any]]:
        """As `given`, and what else the file says of a run."""
        from forestall.assembly.configuration import Given, read_file

        named = {
            f.name: getattr(self, f.name)
            for f in fields(self)
            if f.name not in ("config", "settings", "llm")
        }
        flags = Given.said(self.settings or ()).over(Given.named(named))
        if self.config is None:
            return flags, {}
        below, run = read_file(self.config)
        return flags.over(below), run


@Parameter(name="*")
@dataclass(frozen=True)
class ComparingFlags(SeeingFlags):
    """What a scene is compared with, besides.

    Args:
        encoder: of texts, for references and node features: hashed-words, two-tower, sentence.
        memory: a demonstration file; the ready-made one of the task by default.
    """

    encoder: str | None = None
    memory: Path | None = None


@Parameter(name="*")
@dataclass(frozen=True)
class RunFlags(ComparingFlags):
    """Who judges and steps in, besides.

    Args:
        strategy: when a run may be interrupted: none, retry-once, plan-check, proactive, online,
            online-scene, post-hoc; watch lets every detector judge and never interrupts.
        detector: of a strategy that steps in: scene-graph, preconditions, objects, caption, image.
        threshold: alarm when no demonstration reaches this score.
        llm: the language model that explains and plans: an endpoint's address, a model's name,
            replay:FILE (the answers of an earlier run), record:FILE (write them down).
    """

    strategy: str | None = None
    detector: str | None = None
    threshold: float | None = None
    llm: str | None = None

    def read(self) -> tuple[Given, dict[str, Any]]:
        """See above; what other flags say of reasoner, replanner and model goes over `llm`."""
        from forestall.assembly.language import said_llm

        given, run = super().read()
        return given.over(said_llm(self.llm)), run


@Parameter(name="*")
@dataclass(frozen=True)
class AblationFlags(ComparingFlags):
    """Who explains in some of the runs, besides.

    Args:
        llm: a language model that reasons in runs of their own, beside templates and nobody: an
            endpoint's address, a model's name, or replay:FILE.
    """

    llm: str | None = None

    def read(self) -> tuple[Given, dict[str, Any]]:
        """See above; only some runs ask the model."""
        from forestall.assembly.language import named_llm

        given, run = super().read()
        return given.over(named_llm(self.llm)), run


def spelt(arguments: Iterable[str]) -> Iterator[str]:
    """Arguments with `--kind.option value` written as `--set kind.option=value`."""
    waiting: str | None = None
    for argument in arguments:
        if waiting is not None:
            yield f"{waiting}={argument}"
            waiting = None
            continue
        found = _OPTION.fullmatch(argument)
        if found is None:
            yield argument
            continue
        yield "--set"
        if found[2] is None:
            waiting = found[1]
        else:
            yield f"{found[1]}={found[2]}"
    if waiting is not None:
        yield waiting


def unknown_option(error: UnknownOptionError) -> str:
    """What is said of a flag that a command lacks: a kind of part is named with `--kind.name`."""
    from forestall import kinds
    from forestall.types.kind import Kind

    flag = (error.token.keyword or error.token.value).partition("=")[0]
    known = {k.name for k in vars(kinds).values() if isinstance(k, Kind)}
    takes_parts = any(a.field_info.name == "settings" for a in error.argument_collection)
    if takes_parts and flag.removeprefix("--") in known:
        return f"Unknown option: {flag}. Name the {flag[2:]} with {flag}.name NAME."
    return str(error)
