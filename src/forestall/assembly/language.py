"""Factories of what a language model does, and what `--llm` says.

Named in `tables`, called through `parts`; calls llm, diagnosis, replanning. Reasoner and
replanner of a model have the plain ones behind them, which answer where the model does not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from forestall.assembly.configuration import Given
from forestall.assembly.registry import known
from forestall.diagnosis.model import ModelReasoner
from forestall.diagnosis.state_reading import ModelStateEstimator, StateReadingConfig
from forestall.errors import InputError
from forestall.kinds import LLM, REASONER, REPLANNER, STORE, VALIDATOR
from forestall.llm.client import ClientConfig, OpenAIModel
from forestall.llm.recording import RecordingModel, ReplayingModel
from forestall.replanning.model import ModelReplanner
from forestall.seams.language import LanguageModel
from forestall.seams.running import Parts
from forestall.types.observation import Rgb
from forestall.types.verdict import Reference

_NO_MODEL = "none"


def none() -> LanguageModel:
    """No model; whoever asks for one is told how to name it.

    Raises:
        InputError: always.
    """
    raise InputError(
        "no language model is named: say --llm http://host:port/v1, --llm MODEL or "
        "--llm replay:FILE"
    )


def openai(*, endpoint: ClientConfig | None = None, record: Path | None = None) -> LanguageModel:
    """An OpenAI-compatible endpoint.

    Args:
        endpoint: which, and how it is asked.
        record: a file that all answers are written to, for the part replay.
    """
    model = OpenAIModel(endpoint)
    return model if record is None else RecordingModel(model, record)


def replay(*, file: Path) -> ReplayingModel:
    """The answers of an earlier run.

    Args:
        file: that `record` wrote.
    """
    return ReplayingModel(file)


def model_reasoner(
    parts: Parts,
    *,
    attempts: int = 2,
    pictures: bool = False,
    otherwise: str = "preconditions",
) -> ModelReasoner:
    """A language model explains.

    Args:
        parts: llm, domain.
        attempts: answers that are asked for.
        pictures: whether the robot's picture goes with the question, and beside it that of the
            nearest demonstration, where a memory that was named keeps pictures.
        otherwise: the reasoner that explains where the model does not; "none": nobody does.
    """
    _at_least_one(attempts)
    behind = None if otherwise == _NO_MODEL else parts.part(REASONER, otherwise)
    model = parts.part(LLM)
    shown = _pictures(parts) if pictures else None
    return ModelReasoner(
        model, parts.domain, behind, attempts=attempts, pictures=pictures, shown=shown
    )


@dataclass(frozen=True, slots=True)
class EyesConfig(ClientConfig):
    """An endpoint that is asked what is seen, again and again, so that its bounds are wider."""

    max_calls: int = 2_000
    max_tokens: int = 5_000_000


def model_states(
    parts: Parts,
    *,
    endpoint: EyesConfig | None = None,
    shown: StateReadingConfig | None = None,
    record: Path | None = None,
    file: Path | None = None,
) -> ModelStateEstimator:
    """States off pixels, by a vision-language model; another one than that of `--llm`.

    Args:
        parts: the domain.
        endpoint: which, and how it is asked.
        shown: how things are shown to it.
        record: a file that all answers are written to.
        file: answers that `record` wrote: nobody is asked.
    """
    model: LanguageModel
    model = (
        openai(endpoint=endpoint or EyesConfig(), record=record)
        if file is None
        else replay(file=file)
    )
    return ModelStateEstimator(model, parts.domain, shown)


def _pictures(parts: Parts) -> Callable[[Reference], Rgb | None] | None:
    """The pictures of the run's memory; None where it is the ready-made one, which keeps none."""
    from forestall.assembly.kept import picture_of

    path = parts.options(STORE).get("path")
    if path is None:
        return None

    def shown(reference: Reference) -> Rgb | None:
        steps = (
            s
            for d in parts.demonstrations
            if d.id == reference.demonstration
            for s in d.steps
            if s.index == reference.index
        )
        step = next(steps, None)
        return None if step is None else picture_of(Path(path), step, parts.domain)

    return shown


def model_replanner(
    parts: Parts,
    *,
    validator: str | None = None,
    attempts: int = 3,
    otherwise: str = "planner",
) -> ModelReplanner:
    """A language model plans.

    Args:
        parts: llm, validator, domain.
        validator: of what it answers; the run's own by default.
        attempts: answers that are asked for.
        otherwise: the replanner that plans where no answer is accepted; "none": nobody does.
    """
    _at_least_one(attempts)
    behind = None if otherwise == _NO_MODEL else parts.part(REPLANNER, otherwise)
    checks = parts.part(VALIDATOR) if validator is None else parts.part(VALIDATOR, validator)
    return ModelReplanner(parts.part(LLM), checks, parts.domain, behind, attempts=attempts)


def _at_least_one(attempts: int) -> None:
    if attempts < 1:
        raise InputError(f"attempts is {attempts}: at least 1 is needed")


def said_llm(text: str | None) -> Given:
    """What `--llm` says of a run: the model, and that it explains and plans; as `named_llm`."""
    named = named_llm(text)
    if text is None or text == _NO_MODEL:
        return named
    return named.over(Given.named({REASONER.name: "model", REPLANNER.name: "model"}))


def named_llm(text: str | None) -> Given:
    """The model that `--llm` names, and nothing of who asks it.

    Args:
        text: an address of an endpoint, "replay:FILE", "record:FILE", a part's name, or the name
            of a model at OpenAI.

    Raises:
        InputError: no file after the colon.
    """
    if text is None:
        return Given()
    return Given.named({LLM.name: _NO_MODEL if text == _NO_MODEL else _model(text)})


def _model(text: str) -> dict[str, str]:
    how, colon, rest = text.partition(":")
    if colon and how in ("replay", "record"):
        if not rest:
            raise InputError(f"--llm {text}: name the file, as in --llm {how}:answers.jsonl")
        return {"name": "replay", "file": rest} if how == "replay" else {
            "name": "openai", "record": rest,
        }  # fmt: skip
    if how in ("http", "https"):
        return {"name": "openai", "base_url": text}
    if text in known(LLM.name) or (colon and rest.isidentifier() and "." in how):
        return {"name": text}
    return {"name": "openai", "model": text}
